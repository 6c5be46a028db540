"""Learnt weights to those under Laplace priors of all scales: which formulas come in first."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import QueryMistake
from mlnlite.learn.learned import How, LearnedModel
from mlnlite.learn.optimise.problem import log_likelihood
from mlnlite.learn.optimise.solve import best
from mlnlite.learn.trust.advice import formula_of

Float = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LaplacePath:
    """Weights under Laplace priors.

    Attributes:
        scales: shape (n,), scales of the prior, rising; at the first all weights are just 0.
        weights: shape (n, k), of each scale.
        formulas: of each weight, with the constants of its row.
        values: shape (n,), log-likelihood.
    """

    scales: Float
    weights: Float
    formulas: tuple[str, ...]
    values: Float

    @property
    def n_nonzero(self) -> NDArray[np.int64]:
        """How many weights are not 0, shape (n,)."""
        return np.asarray(np.count_nonzero(self.weights, axis=1))


def verify_path(how: How, sampled: bool) -> None:
    """Complains of what has no path of Laplace priors."""
    if how.objective == "max-margin":
        raise QueryMistake("max-margin weights have no likelihood whose path under Laplace priors could be followed")
    if sampled:
        raise QueryMistake("the path of Laplace priors needs a likelihood that is worked out, not sampled")


def laplace_path(learned: LearnedModel, points: int = 50, longest: float = 1e3) -> LaplacePath:
    """The best weights under Laplace priors from the scale at which the first formula comes in.

    Friedman, Hastie and Tibshirani, Regularization paths for generalized linear models via coordinate descent, 2010.

    Args:
        learned: what `learn` gave; its own prior does not matter.
        points: how many scales, a constant factor apart.
        longest: the last scale over the first.

    Raises:
        QueryMistake: if the likelihood was sampled.
    """
    problem, k = learned.problem, len(learned.problem.free)
    verify_path(learned.how, bool(learned.monte_carlo.any()))
    x, none = np.zeros(k), np.zeros(k)
    steepest = float(np.abs(log_likelihood(problem, x)[1]).max(initial=1e-300))
    scales = np.geomspace(1.0, longest, points) / steepest
    weights, values = np.zeros((points, k)), np.zeros(points)
    for i, scale in enumerate(scales.tolist()):
        penalty = replace(learned.penalty.of(problem.free), mean=none, precision=none, cauchy=none, l1=none + 1 / scale)
        x = best(problem, penalty, x, None).x
        weights[i], values[i] = x, log_likelihood(problem, x)[0]
    return LaplacePath(scales, weights, tuple(formula_of(learned, w) for w in problem.free.tolist()), values)
