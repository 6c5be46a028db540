"""Learnt weights to tests: how much worse the data are explained without each formula, and held-out likelihood."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.errors import LimitReached, QueryMistake
from mlnlite.ground.ground import verify_same_vocabulary
from mlnlite.learn.data.merge import Choices
from mlnlite.learn.data.missing import is_incomplete
from mlnlite.learn.learned import How, LearnedModel, Objective, targets_of
from mlnlite.learn.objectives.choose import task_of
from mlnlite.learn.optimise import information
from mlnlite.learn.optimise.problem import Problem, log_likelihood
from mlnlite.learn.optimise.solve import best
from mlnlite.learn.trust.advice import formula_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]

MOST_TESTS = 2000
"""Weights up to which each is tested: one refit for each."""


@dataclass(frozen=True, slots=True)
class Effect:
    """How much a weight matters.

    Attributes:
        formula: with the constants of its row.
        weight: the learnt weight.
        probability: of the formula's head given its body when nothing else speaks, `1 / (1 + e^-weight)`.
        ratio: twice the log of the likelihood ratio of the model with and without the formula, all else learnt anew.
        score: Rao's score statistic at the model without it; nan where the likelihood is not concave there, as can be
            if some atoms were unknown.
        p_value: of the score statistic, or else of the ratio, chi-squared with one degree of freedom. Of the
            pseudo-likelihood of atoms that depend on each other it is too small (Kent 1982).
    """

    formula: str
    weight: float
    probability: float
    ratio: float
    score: float
    p_value: float


def effects(learned: LearnedModel) -> tuple[Effect, ...]:
    """The effect of each weight that was learnt from data, in order.

    Raises:
        LimitReached: if there are too many.
        QueryMistake: if components are too wide to list, or the weights are not those of a likelihood.
    """
    from scipy.stats import chi2

    problem = learned.problem
    if learned.how.objective == "max-margin":
        raise QueryMistake("formulas are tested by likelihood, which max-margin learning has none of")
    if problem.wide:
        hint = "learn by pseudo-likelihood, or predict fewer predicates"
        raise QueryMistake("formulas are tested where components can be listed; these are too wide", hint)
    if len(problem.free) > MOST_TESTS:
        hint = "learn with a Laplace prior first, and drop the formulas with weight 0"
        raise LimitReached(f"each of {len(problem.free):,} weights would be a test; the limit is {MOST_TESTS:,}", hint)
    x, found = learned.weights[problem.free], []
    value = log_likelihood(problem, x)[0]
    for j, w in enumerate(problem.free.tolist()):
        without = _refitted(learned, x, j)
        ratio = 2 * (value - log_likelihood(problem, without)[0])
        score = score_statistic(problem, without, j)
        chance = float(1.0 / (1.0 + np.exp(-x[j])))
        p_value = float(chi2.sf(ratio if np.isnan(score) else score, 1))
        found.append(Effect(formula_of(learned, w), float(x[j]), chance, ratio, score, p_value))
    return tuple(found)


def _refitted(learned: LearnedModel, x: Float, column: int) -> Float:
    """The best free weights with one of them 0."""
    problem = learned.problem
    others = np.flatnonzero(np.arange(len(x)) != column)
    known = None if problem.known is None else _over(problem.known, others)
    part = replace(problem, every=_over(problem.every, others), known=known, free=problem.free[others])
    result = np.zeros(len(x))
    result[others] = best(part, learned.penalty.of(part.free), x[others], None).x
    return result


def _over(found: Choices, columns: Int64) -> Choices:
    return replace(found, rows=sparse.csr_array(found.rows[:, columns]))


def score_statistic(problem: Problem, x: Float, column: int) -> float:
    """How much the likelihood at `x` wants one weight to move: squared slope over the information on it.

    Rao, Large sample tests of statistical hypotheses concerning several parameters, 1948.
    """
    bend, slope = _bend(problem.every, x, column)
    if problem.known is not None:
        more, back = _bend(problem.known, x, column)
        bend, slope = bend - more, slope - back
    others = np.flatnonzero(np.arange(len(x)) != column)
    coupled = bend[others, column]
    rest = np.linalg.pinv(bend[np.ix_(others, others)], hermitian=True)
    left = float(bend[column, column] - coupled @ rest @ coupled)
    if left < -1e-9:
        return np.nan
    return slope**2 / left if left > 1e-12 else 0.0


def _bend(found: Choices, x: Float, column: int) -> tuple[Float, float]:
    """Minus the Hessian, and minus the slope of one weight."""
    slope = float((found.many @ information.expected_rows(found, x))[column])
    return np.asarray(information.hessian(found, x).todense(), float), slope


def has_unknown(model: Model, databases: Evidence, how: How) -> bool:
    """Whether databases leave atoms unknown that matter to a learnt model."""
    return bool(how.open_predicates) or is_incomplete(model, databases, targets_of(model, how))


def held_out(learned: LearnedModel, databases: Evidence) -> float:
    """Pseudo-log-likelihood of databases that the model has not seen, per atom or block that is predicted.

    Where atoms are unknown (see `has_unknown`), it is the log-likelihood of what is known.

    Args:
        learned: what `learn` gave.
        databases: read for its model.

    Raises:
        LimitReached: if atoms are unknown, and components too wide for an exact likelihood.
    """
    problem = unseen(learned.model, databases, learned.how)
    weights = np.concatenate([np.empty(0), *(t.expanded(databases.types).weights for t in learned.model.templates)])
    return log_likelihood(problem, weights[problem.free])[0] / max(1, problem.every.n_choices)


def unseen(model: Model, databases: Evidence, how: How) -> Problem:
    """The likelihood of databases that a model has not seen, with all weights free that are not hard."""
    verify_same_vocabulary(model, databases)
    objective: Objective = "likelihood" if has_unknown(model, databases, how) else "pseudo-likelihood"
    how = replace(how, objective=objective, tied=(), database_weights=None)
    free = (replace(t.expanded(databases.types), fixed=t.hard) for t in model.templates)
    return task_of(replace(model, templates=tuple(free)), databases, how, targets_of(model, how), None).problem
