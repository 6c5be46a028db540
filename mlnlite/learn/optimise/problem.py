"""Model and data to the problem to be solved: free weights only, hard and fixed ones put in."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.errors import ModelMistake
from mlnlite.learn.data.counts import violated
from mlnlite.learn.data.merge import Choices
from mlnlite.learn.data.wide import Wide, wide_value
from mlnlite.learn.optimise import likelihood
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
        free: indices of the weights to be found; of weights that are tied together, the first.
        weights: all weights; those to be found are 0.
        learnable: which weights are to be learnt at all.
        share: shape (n_weights, n_free), 1 where a weight is a free one, or tied to it.
    """

    every: Choices
    known: Choices | None
    wide: tuple[Wide, ...]
    free: Int64
    weights: Float
    learnable: NDArray[np.bool_]
    share: sparse.csr_array

    def all_weights(self, x: Float) -> Float:
        """All weights, where the free ones are `x`."""
        return np.asarray(self.weights + self.share @ x)


def problem_of(
    model: Model,
    every: Choices,
    known: Choices | None = None,
    wide: tuple[Wide, ...] = (),
    tied: Int64 | None = None,
) -> Problem:
    """The problem over the free weights.

    Args:
        model: expanded.
        every: choices.
        known: those that agree with the data.
        wide: databases kept as networks.
        tied: shape (n_weights,), for each weight the first one that it is equal to; None for itself.

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
    n = len(weights)
    tied = np.arange(n) if tied is None else tied
    free = np.unique(tied[touched & learnable])
    place = np.searchsorted(free, tied)
    shares = np.flatnonzero(learnable & np.isin(tied, free))
    share = sparse.csr_array((np.ones(len(shares)), (shares, place[shares])), shape=(n, len(free)))
    return Problem(
        _over(model, every, weights, share),
        None if known is None or not len(known.choice) else _over(model, known, weights, share),
        wide,
        free,
        weights,
        learnable,
        share,
    )


def _over(model: Model, found: Choices, weights: Float, share: sparse.csr_array) -> Choices:
    """Choices over the free weights; alternatives that hard formulas forbid are left out."""
    rows = found.rows.tocsc()
    hard = np.isinf(weights)
    stays = _possible(model, rows, hard)
    known = np.flatnonzero((weights != 0) & ~hard)
    log_times = found.log_times - rows[:, known] @ weights[known]
    kept = sparse.csr_array(found.rows @ share)[stays]
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
        raise violated(model.templates[int(np.searchsorted(sizes, column, "right"))])
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
    wanted = np.asarray(np.diff(problem.share.indptr) > 0)
    value, gradient = wide_value(problem.wide, problem.all_weights(x), wanted)
    return value, np.asarray(problem.share.T @ gradient)


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
        diagonal = diagonal + np.minimum(problem.share.T @ one.every.n_open, 10.0) / 4
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
