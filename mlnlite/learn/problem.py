"""Model and data to the problem to be solved: free weights only, hard and fixed ones put in."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.errors import Contradiction, Diagnostic, ModelMistake
from mlnlite.learn import likelihood
from mlnlite.learn.exact import Wide, wide_value
from mlnlite.learn.merge import Choices
from mlnlite.model.model import Model

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Problem:
    """A log-likelihood as a function of the free weights that it depends on.

    Attributes:
        every: choices, with as many columns as `free` has entries.
        known: those whose likelihood is taken off again: the worlds that agree with the data, where it leaves some
            unknown; None if it does not.
        wide: databases kept as networks.
        free: indices of the weights to be found.
        weights: all weights; those to be found are 0.
        learnable: which weights are to be learnt at all.
    """

    every: Choices
    known: Choices | None
    wide: tuple[Wide, ...]
    free: Int64
    weights: Float
    learnable: NDArray[np.bool_]


def problem_of(model: Model, every: Choices, known: Choices | None = None, wide: tuple[Wide, ...] = ()) -> Problem:
    """The problem over the free weights.

    Raises:
        ModelMistake: if there is nothing to learn.
        Contradiction: if the data violate a hard formula.
    """
    given = np.concatenate([np.empty(0), *(t.weights for t in model.templates)])
    sizes = [len(t.weights) for t in model.templates]
    fixed = np.repeat(np.array([t.fixed for t in model.templates], bool), sizes)
    learnable = ~np.isinf(given) & ~fixed
    if not learnable.any():
        raise ModelMistake("the model has no weight to learn", "give it a formula that is neither hard nor fixed")
    weights = np.where(learnable, 0.0, given)
    touched = np.diff(every.rows.tocsc().indptr) > 0
    for one in wide:
        touched |= one.every.n_open > 0
    free = np.flatnonzero(touched & learnable)
    return Problem(
        _over(model, every, weights, free),
        None if known is None or not len(known.choice) else _over(model, known, weights, free),
        wide,
        free,
        weights,
        learnable,
    )


def _over(model: Model, found: Choices, weights: Float, free: Int64) -> Choices:
    """Choices over the free weights; alternatives that hard formulas forbid are left out."""
    rows = found.rows.tocsc()
    hard = np.isinf(weights)
    stays = _possible(model, rows, hard)
    known = np.flatnonzero((weights != 0) & ~hard)
    log_times = found.log_times - rows[:, known] @ weights[known]
    kept = sparse.csr_array(rows[:, free])[stays]
    return replace(found, rows=kept, log_times=log_times[stays], choice=found.choice[stays])


def _possible(model: Model, rows: sparse.csc_array, hard: NDArray[np.bool_]) -> Int64:
    """Rows of the alternatives that no hard formula forbids."""
    columns = np.flatnonzero(hard)
    if not len(columns):
        return np.arange(rows.shape[0])
    change = rows[:, columns].tocsr()
    lowest = np.asarray(change.min(axis=1).todense()).reshape(-1)
    if (lowest < 0).any():
        row = change[[int(np.flatnonzero(lowest < 0)[0])]].tocoo()
        column = int(columns[row.col[row.data < 0][0]])
        sizes = np.cumsum([len(t.weights) for t in model.templates])
        template = model.templates[int(np.searchsorted(sizes, column, "right"))]
        message = f"the data violate {template.name}, which is hard: {template.text}"
        raise Contradiction([Diagnostic("E404", message, template.span, "give it a weight, or mend the data")])
    return np.flatnonzero(np.asarray(change.max(axis=1).todense()).reshape(-1) <= 0)


# --- the log-likelihood


def log_likelihood(problem: Problem, x: Float) -> tuple[float, Float]:
    """Value and gradient at free weights `x`."""
    point = likelihood.at(problem.every, x)
    value, gradient = point.value, point.gradient
    if problem.known is not None:
        known = likelihood.at(problem.known, x)
        value, gradient = value - known.value, gradient - known.gradient
    if problem.wide:
        more, slope = _wide(problem, x)
        value, gradient = value + more, gradient + slope
    return value, gradient


def _wide(problem: Problem, x: Float) -> tuple[float, Float]:
    weights = problem.weights.copy()
    weights[problem.free] = x
    wanted = np.zeros(len(weights), np.bool_)
    wanted[problem.free] = True
    value, gradient = wide_value(problem.wide, weights, wanted)
    return value, gradient[problem.free]


def information(problem: Problem, x: Float) -> likelihood.Operator:
    """Minus the Hessian of the log-likelihood at `x`, as a product with a vector."""
    every = likelihood.curvature(problem.every, likelihood.at(problem.every, x))
    known = None if problem.known is None else likelihood.curvature(problem.known, likelihood.at(problem.known, x))

    def product(direction: Float) -> Float:
        bend = every(direction)
        if known is not None:
            bend = bend - known(direction)
        if problem.wide:
            step = 1e-4 / max(1.0, float(np.abs(direction).max(initial=0.0)))
            ahead, behind = (_wide(problem, x + s * step * direction)[1] for s in (1, -1))
            bend = bend - (ahead - behind) / (2 * step)
        return bend

    return product


def information_diagonal(problem: Problem, x: Float) -> Float:
    """About the diagonal of the same, never below 0."""
    diagonal = likelihood.curvature_diagonal(problem.every, likelihood.at(problem.every, x))
    for one in problem.wide:
        diagonal = diagonal + np.minimum(one.every.n_open[problem.free], 10.0) / 4
    return diagonal


# --- weights without a finite best value


def one_sided(found: Choices) -> tuple[NDArray[np.int8], Int64]:
    """Weights that the likelihood pushes to infinity: no choice ever speaks against them.

    A weight whose column has no negative entry goes to plus infinity; the alternatives it speaks against then have
    probability 0 and drop out, which may leave other weights one-sided. (Directions that are only unbounded together
    are for `separable` to find.)

    Returns:
        For each weight 1, -1 or 0; and the rows that are left.
    """
    rows = found.rows.tocsc()
    unbounded = np.zeros(rows.shape[1], np.int8)
    left = np.ones(rows.shape[0], bool)
    column = np.repeat(np.arange(rows.shape[1]), np.diff(rows.indptr))
    while True:
        here = left[rows.indices]
        n_positive = np.bincount(column[here & (rows.data > 0)], minlength=rows.shape[1])
        n_negative = np.bincount(column[here & (rows.data < 0)], minlength=rows.shape[1])
        new = (unbounded == 0) & ((n_positive > 0) ^ (n_negative > 0))
        if not new.any():
            return unbounded, np.flatnonzero(left)
        unbounded[new] = np.where(n_positive[new] > 0, 1, -1)
        left[rows.indices[new[column] & here]] = False
