"""Databases to weights: the entry function `learn`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from time import monotonic

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.engines.choose import engine_for
from mlnlite.engines.plan import Engine
from mlnlite.errors import Contradiction, Diagnostic, ModelMistake, QueryMistake, did_you_mean
from mlnlite.ground.ground import row_tables
from mlnlite.ground.tables import tables_of
from mlnlite.learn import likelihood
from mlnlite.learn.choices import choices
from mlnlite.learn.counts import entries
from mlnlite.learn.learned import LearnedModel
from mlnlite.learn.merge import Choices
from mlnlite.learn.newton import Optimum, maximise
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import closed
from mlnlite.model.model import Model
from mlnlite.model.symbols import Type

Float = NDArray[np.float64]

PRIOR_SD = 5.0
"""Default standard deviation of the Gaussian prior of each weight."""

BOUND = 30.0
"""Largest size of a weight: odds of e^30, 10^13 to 1."""


def learn(
    model: Model,
    databases: Evidence,
    *,
    prior_sd: float | None = PRIOR_SD,
    predict: Iterable[str] | None = None,
    time_limit: float | None = None,
    engine: Engine | None = None,
) -> LearnedModel:
    """Weights that make the databases most likely, by pseudo-likelihood (Besag 1975; Richardson and Domingos 2006).

    The databases are complete: an atom that is not a fact is false. Each atom, and each block of a functional
    predicate, is predicted from all others.

    Args:
        model: its weights are ignored, except fixed ones and hard formulas.
        databases: the data.
        prior_sd: standard deviation of the Gaussian prior with mean 0; None for none.
        predict: predicates whose atoms are predicted; the others are only conditions (conditional
            pseudo-likelihood). By default all.
        time_limit: seconds after which to stop with the best weights so far.
        engine: what runs the counting joins; by default chosen by size.

    Raises:
        ModelMistake: if there is nothing to learn.
        Contradiction: if the data violate a hard formula.
        EvidenceMistake: if a block that must have a value has none.
    """
    deadline = None if time_limit is None else monotonic() + time_limit
    if prior_sd is not None and not prior_sd > 0:
        raise QueryMistake(f"the standard deviation of the prior must be positive, found {prior_sd:g}")
    start = monotonic()
    model = replace(model, templates=tuple(t.expanded(databases.types) for t in model.templates))
    found = _choices(model, databases, _targets(model, predict), engine)
    counted = monotonic()
    problem = _problem(model, found)
    optimum, unbounded = _solved(problem, prior_sd, deadline)
    solved = monotonic()
    seconds = {"count": counted - start, "solve": solved - counted}
    types = _types(model, databases)
    return _learned(replace(model, types=types), problem, (optimum, unbounded), prior_sd, seconds)


def _types(model: Model, databases: Evidence) -> dict[str, Type]:
    """The types of the learnt model: the constants of the databases come in where there is a weight for each."""
    keys = {t.formula.variables[k].type for t in model.templates for k in t.keys}
    return {name: databases.types[name] if name in keys else t for name, t in model.types.items()}


def _targets(model: Model, predict: Iterable[str] | None) -> frozenset[str]:
    names = frozenset(model.predicates if predict is None else predict)
    for name in sorted(names - set(model.predicates)):
        hint = did_you_mean(name, list(model.predicates))
        raise QueryMistake([Diagnostic("E510", f"there is no predicate {name} to predict", hint=hint)])
    return names


def _choices(model: Model, databases: Evidence, targets: frozenset[str], engine: Engine | None) -> Choices:
    evidence = closed(databases, databases.predicates)
    tables = {**tables_of(evidence), **row_tables(model)}
    found = entries(model.templates, evidence, (engine or engine_for(tables)).load(tables), targets)
    return choices(found, evidence, sum(len(t.weights) for t in model.templates))


# --- the problem: free weights, with hard and fixed ones put in


@dataclass(frozen=True, slots=True)
class _Problem:
    """Choices over the free weights that some choice depends on.

    Attributes:
        choices: with as many columns as `free` has entries.
        free: indices of the weights to be found.
        weights: all weights; those to be found are 0.
        learnable: which weights are to be learnt at all.
    """

    choices: Choices
    free: NDArray[np.int64]
    weights: Float
    learnable: NDArray[np.bool_]


def _problem(model: Model, found: Choices) -> _Problem:
    given = np.concatenate([np.empty(0), *(t.weights for t in model.templates)])
    fixed = np.repeat([t.fixed for t in model.templates], [len(t.weights) for t in model.templates])
    hard = np.isinf(given)
    learnable = ~hard & ~fixed.astype(bool)
    if not learnable.any():
        raise ModelMistake("the model has no weight to learn", "give it a formula that is neither hard nor fixed")
    rows = found.rows.tocsc()
    stays = _possible(model, rows, hard)
    weights = np.where(learnable, 0.0, given)
    known = np.flatnonzero(fixed & ~hard)
    log_times = found.log_times - rows[:, known] @ weights[known]
    touched = np.flatnonzero(np.diff(rows.indptr) > 0)
    free = touched[learnable[touched]]
    kept = replace(
        found, rows=sparse.csr_array(rows[:, free])[stays], log_times=log_times[stays], choice=found.choice[stays]
    )
    return _Problem(kept, free, weights, learnable)


def _possible(model: Model, rows: sparse.csc_array, hard: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Rows of the alternatives that no hard formula forbids."""
    columns = np.flatnonzero(hard)
    change = np.asarray(rows[:, columns].sum(axis=1)).reshape(-1) if len(columns) else np.zeros(rows.shape[0])
    if (change < 0).any():
        column = columns[rows[:, columns].tocsr()[np.flatnonzero(change < 0)[0]].indices[0]]
        sizes = np.cumsum([len(t.weights) for t in model.templates])
        template = model.templates[int(np.searchsorted(sizes, column, "right"))]
        message = f"the data violate {template.name}, which is hard: {template.text}"
        raise Contradiction([Diagnostic("E404", message, template.span, "give it a weight, or mend the data")])
    return np.flatnonzero(change <= 0)


# --- the search


@dataclass(frozen=True, slots=True)
class _Posterior:
    """Pseudo-log-likelihood plus log prior."""

    choices: Choices
    precision: float

    def value(self, x: Float) -> tuple[float, Float]:
        point = likelihood.at(self.choices, x)
        return point.value - 0.5 * self.precision * float(x @ x), point.gradient - self.precision * x

    def curvature(self, x: Float) -> tuple[Callable[[Float], Float], Float]:
        point = likelihood.at(self.choices, x)
        diagonal = likelihood.curvature_diagonal(self.choices, point) + self.precision
        return lambda d: likelihood.curvature(self.choices, point, d) + self.precision * d, diagonal


def _solved(problem: _Problem, prior_sd: float | None, deadline: float | None) -> tuple[Optimum, NDArray[np.int8]]:
    """The optimum over the free weights, and which of them have none without a prior."""
    from threadpoolctl import threadpool_limits  # BLAS threads make vectors of this size slower

    found = problem.choices
    unbounded, left = one_sided(found)
    precision = 0.0 if prior_sd is None else prior_sd**-2
    with threadpool_limits(1, "blas"):
        if prior_sd is not None:
            start = np.zeros(found.rows.shape[1])
            return maximise(_Posterior(found, precision), start, BOUND, deadline=deadline), unbounded
        inner = np.flatnonzero(unbounded == 0)
        rest = replace(
            found, rows=found.rows[left][:, inner], log_times=found.log_times[left], choice=found.choice[left]
        )
        optimum = maximise(_Posterior(rest, 0.0), np.zeros(len(inner)), BOUND, deadline=deadline)
        x = BOUND * unbounded.astype(float)
        x[inner] = optimum.x
        at_bound = inner[np.abs(optimum.x) >= BOUND]
        unbounded[at_bound] = np.sign(x[at_bound]).astype(np.int8)
        return replace(optimum, x=x, value=likelihood.at(found, x).value), unbounded


def one_sided(found: Choices) -> tuple[NDArray[np.int8], NDArray[np.int64]]:
    """Weights that the likelihood pushes to infinity: no choice ever speaks against them.

    A weight whose column has no negative entry goes to plus infinity; the alternatives it speaks against then have
    probability 0 and drop out, which may leave other weights one-sided. (Directions that are only unbounded together
    are not found here.)

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


def _learned(
    model: Model,
    problem: _Problem,
    solved: tuple[Optimum, NDArray[np.int8]],
    prior_sd: float | None,
    seconds: dict[str, float],
) -> LearnedModel:
    optimum, of_free = solved
    weights = problem.weights.copy()
    weights[problem.free] = optimum.x
    unbounded = np.zeros(len(weights), np.int8)
    unbounded[problem.free] = of_free
    unsupported = problem.learnable.copy()
    unsupported[problem.free] = False
    parts = np.split(weights, np.cumsum([len(t.weights) for t in model.templates])[:-1])
    templates = tuple(replace(t, weights=part) for t, part in zip(model.templates, parts, strict=True))
    return LearnedModel(
        model=replace(model, templates=templates),
        objective="pseudo-log-likelihood",
        value=likelihood.at(problem.choices, optimum.x).value,
        prior_sd=prior_sd,
        bound=BOUND,
        unbounded=unbounded,
        unsupported=unsupported,
        n_choices=problem.choices.n_choices,
        status=optimum.status,
        gradient=optimum.gradient,
        iterations=optimum.iterations,
        seconds=seconds,
    )
