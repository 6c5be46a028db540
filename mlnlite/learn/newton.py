"""Maximises a concave function within bounds: projected Newton, steps by conjugate gradients, backtracking.

Method: D. Bertsekas, Projected Newton methods for optimization problems with simple constraints, SIAM J. Control 1982;
truncated conjugate gradients as in Nocedal and Wright, Numerical Optimization, 2006, chapter 7.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


class Concave(Protocol):
    """A concave function with two derivatives."""

    def value(self, x: Float) -> tuple[float, Float]:
        """Value and gradient."""
        ...

    def curvature(self, x: Float) -> tuple[Callable[[Float], Float], Float]:
        """Minus the Hessian as a product with a vector, and about its diagonal (positive)."""
        ...


@dataclass(frozen=True, slots=True)
class Optimum:
    """Where the search ended.

    Attributes:
        x: the point.
        value: the function there.
        gradient: its largest projected gradient entry.
        iterations: Newton steps.
        status: `converged`, `no further increase`, `iteration limit` or `time limit`.
    """

    x: Float
    value: float
    gradient: float
    iterations: int
    status: str


def maximise(
    function: Concave,
    start: Float,
    bound: float,
    *,
    tolerance: float = 1e-8,
    iterations: int = 500,
    deadline: float | None = None,
) -> Optimum:
    """The maximum of a concave function over `|x_i| <= bound`.

    Args:
        function: what to maximise.
        start: first point, shape (n,).
        bound: of each coordinate.
        tolerance: of the largest projected gradient entry.
        iterations: most Newton steps.
        deadline: `time.monotonic()` at which to stop with the best point so far.
    """
    x = np.clip(start, -bound, bound)
    value, gradient = function.value(x)
    for iteration in range(iterations):
        free = ~((x >= bound) & (gradient > 0) | (x <= -bound) & (gradient < 0))
        size = float(np.abs(gradient[free]).max(initial=0.0))
        if size <= tolerance:
            return Optimum(x, value, size, iteration, "converged")
        if deadline is not None and monotonic() > deadline:
            return Optimum(x, value, size, iteration, "time limit")
        step = _newton_step(function, x, gradient, free)
        moved = _line_search(function, x, value, gradient, np.where(free, step, 0.0), bound)
        if moved is None:
            return Optimum(x, value, size, iteration, "no further increase")
        x, value, gradient = moved
    return Optimum(x, value, size, iterations, "iteration limit")


def _newton_step(function: Concave, x: Float, gradient: Float, free: NDArray[np.bool_]) -> Float:
    """Solves `H step = gradient` on the free coordinates by preconditioned conjugate gradients."""
    product, diagonal = function.curvature(x)
    scale = 1.0 / np.maximum(diagonal, 1e-12)
    residual = np.where(free, gradient, 0.0)
    norm = float(np.sqrt(residual @ (scale * residual)))
    goal = norm * min(0.5, np.sqrt(norm)) * 1e-2
    step = np.zeros_like(x)
    direction = preconditioned = scale * residual
    slope = float(residual @ preconditioned)
    for _ in range(min(10 * len(x), 2000)):
        image = np.where(free, product(direction), 0.0)
        bend = float(direction @ image)
        if bend <= 1e-14 * float(direction @ direction):
            return step if step.any() else direction
        length = slope / bend
        step = step + length * direction
        residual = residual - length * image
        preconditioned = scale * residual
        new_slope = float(residual @ preconditioned)
        if np.sqrt(max(new_slope, 0.0)) <= goal:
            return step
        direction = preconditioned + new_slope / slope * direction
        slope = new_slope
    return step


def _line_search(
    function: Concave, x: Float, value: float, gradient: Float, step: Float, bound: float
) -> tuple[Float, float, Float] | None:
    """The first of step, step/2, step/4, ... that increases the function enough; None if none does."""
    length = 1.0
    slack = 1e-12 * max(1.0, abs(value))
    for _ in range(50):
        candidate = np.clip(x + length * step, -bound, bound)
        new_value, new_gradient = function.value(candidate)
        if new_value >= value + 1e-4 * float(gradient @ (candidate - x)) - slack:
            return (candidate, new_value, new_gradient) if (candidate != x).any() else None
        length /= 2
    return None
