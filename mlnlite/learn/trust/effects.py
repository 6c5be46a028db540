"""Learnt weights to tests: how much worse the data are explained without each formula, and held-out likelihood."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.errors import LimitReached, QueryMistake
from mlnlite.learn.learned import LearnedModel
from mlnlite.learn.objectives.choose import pseudo_problem
from mlnlite.learn.optimise import information
from mlnlite.learn.optimise.problem import Problem, log_likelihood
from mlnlite.learn.optimise.solve import best
from mlnlite.learn.trust.advice import formula_of
from mlnlite.model.evidence import Evidence

Float = NDArray[np.float64]

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
        score: Rao's score statistic at the model without it.
        p_value: of the score statistic, chi-squared with one degree of freedom. Of the pseudo-likelihood of atoms that
            depend on each other it is too small (Kent 1982).
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
        QueryMistake: if some atoms were unknown in training, or components too wide to list.
    """
    from scipy.stats import chi2

    problem = learned.problem
    if problem.known is not None or problem.wide:
        raise QueryMistake("formulas are tested on complete data with components that can be listed")
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
        found.append(Effect(formula_of(learned, w), float(x[j]), chance, ratio, score, float(chi2.sf(score, 1))))
    return tuple(found)


def _refitted(learned: LearnedModel, x: Float, column: int) -> Float:
    """The best free weights with one of them 0."""
    problem = learned.problem
    others = np.flatnonzero(np.arange(len(x)) != column)
    rows = sparse.csr_array(problem.every.rows[:, others])
    part = replace(problem, every=replace(problem.every, rows=rows), free=problem.free[others])
    result = np.zeros(len(x))
    result[others] = best(part, learned.penalty.of(part.free), x[others], None).x
    return result


def score_statistic(problem: Problem, x: Float, column: int) -> float:
    """How much the likelihood at `x` wants one weight to move: squared slope over the information on it.

    Rao, Large sample tests of statistical hypotheses concerning several parameters, 1948.
    """
    bend = np.asarray(information.hessian(problem.every, x).todense(), float)
    slope = float((problem.every.many @ information.expected_rows(problem.every, x))[column])
    others = np.flatnonzero(np.arange(len(x)) != column)
    coupled = bend[others, column]
    rest = np.linalg.pinv(bend[np.ix_(others, others)], hermitian=True)
    left = float(bend[column, column] - coupled @ rest @ coupled)
    return slope**2 / left if left > 1e-12 else 0.0


def held_out(learned: LearnedModel, databases: Evidence) -> float:
    """Pseudo-log-likelihood of databases that the model has not seen, per atom or block that is predicted.

    Args:
        learned: what `learn` gave.
        databases: read for its model; complete.
    """
    model = learned.model
    model = replace(model, templates=tuple(t.expanded(databases.types) for t in model.templates))
    targets = frozenset(model.predicates if learned.how.predict is None else learned.how.predict)
    free = tuple(replace(t, fixed=t.hard) for t in model.templates)
    problem = pseudo_problem(replace(model, templates=free), databases, targets)
    weights = np.concatenate([np.empty(0), *(t.weights for t in model.templates)])
    return log_likelihood(problem, weights[problem.free])[0] / max(1, problem.every.n_choices)
