"""The pseudo-log-likelihood of choices: value, gradient, and product with the Hessian."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mlnlite.learn.data.merge import Choices

Float = NDArray[np.float64]

Operator: TypeAlias = Callable[[Float], Float]
"""A matrix as its product with a vector."""


@dataclass(frozen=True, slots=True)
class Point:
    """The likelihood at some weights.

    Attributes:
        value: log-likelihood.
        gradient: shape (n_weights,).
        chance: shape (n_rows,), probability of the alternatives of each row, given the rest.
    """

    value: float
    gradient: Float
    chance: Float


def at(choices: Choices, weights: Float) -> Point:
    """The pseudo-log-likelihood and its gradient at `weights`."""
    score = choices.log_times - choices.rows @ weights
    n = len(choices.many)
    top = np.maximum(_maximum(score, choices.choice, n), 0.0)
    odds = np.exp(score - top[choices.choice])
    total = np.exp(-top) + np.bincount(choices.choice, odds, n)
    chance = odds / total[choices.choice]
    value = choices.constant - float(choices.many @ (top + np.log(total)))
    gradient = choices.rows.T @ (choices.many[choices.choice] * chance)
    return Point(value, np.asarray(gradient), chance)


def curvature(choices: Choices, point: Point) -> Operator:
    """Minus the Hessian of the log-likelihood at a point, as a product with a direction."""
    back, weight, n = choices.rows.T, choices.many[choices.choice] * point.chance, len(choices.many)

    def product(direction: Float) -> Float:
        along = choices.rows @ direction
        mean = np.bincount(choices.choice, point.chance * along, n)
        return np.asarray(back @ (weight * (along - mean[choices.choice])))

    return product


def curvature_diagonal(choices: Choices, point: Point) -> Float:
    """An upper bound on the diagonal of minus the Hessian (exact for binary choices)."""
    squared = choices.rows.copy()
    squared.data = squared.data**2
    return np.asarray(squared.T @ (choices.many[choices.choice] * point.chance * _rest(choices, point)))


def _rest(choices: Choices, point: Point) -> Float:
    alone = np.bincount(choices.choice, minlength=len(choices.many))[choices.choice] == 1
    return np.where(alone, 1.0 - point.chance, 1.0)


def _maximum(values: Float, group: NDArray[np.int64], n: int) -> Float:
    result = np.full(n, -np.inf)
    np.maximum.at(result, group, values)
    return result
