"""Maximises a concave function within bounds, less an L1 penalty: projected Newton, conjugate gradients, backtracking.

Methods: D. Bertsekas, Projected Newton methods for optimization problems with simple constraints, SIAM J. Control 1982;
truncated conjugate gradients as in Nocedal and Wright, Numerical Optimization, 2006, chapter 7; orthants for the L1
penalty as in G. Andrew and J. Gao, Scalable training of L1-regularized log-linear models, ICML 2007.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mlnlite.infer.deadline import Deadline

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
        value: the function there, L1 penalty included.
        gradient: its largest projected gradient entry.
        iterations: Newton steps.
        status: `converged`, `no further increase`, `iteration limit`, `time limit` or `interrupted`.
        history: the function at the start and after each step.
    """

    x: Float
    value: float
    gradient: float
    iterations: int
    status: str
    history: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Problem:
    """What is maximised, and where."""

    function: Concave
    l1: Float
    bound: float


@dataclass(frozen=True, slots=True)
class _Point:
    """A point of the search; `slope` is the gradient, that of the better side where the L1 penalty has a kink."""

    x: Float
    value: float
    slope: Float


def maximise(
    function: Concave,
    start: Float,
    bound: float,
    *,
    l1: Float | None = None,
    tolerance: float = 1e-8,
    iterations: int = 500,
    deadline: Deadline | None = None,
) -> Optimum:
    """The maximum of a concave function, less `l1 @ |x|`, over `|x_i| <= bound`.

    Args:
        function: what to maximise.
        start: first point, shape (n,).
        bound: of each coordinate.
        l1: shape (n,), not negative.
        tolerance: of the largest projected gradient entry.
        iterations: most Newton steps.
        deadline: when to stop with the best point so far.
    """
    problem = _Problem(function, np.zeros(len(start)) if l1 is None else l1, bound)
    point = _at(problem, np.clip(start, -bound, bound))
    history = [point.value]
    status = ""
    while not status:
        free = _free(problem, point)
        size = float(np.abs(point.slope[free]).max(initial=0.0))
        status = _why_stop(size <= tolerance, len(history) > iterations, deadline)
        if status:
            break
        step = _newton_step(function, point.x, point.slope, free)
        moved = _line_search(problem, point, np.where(free, step, 0.0))
        if moved is None:
            status = "no further increase"
        else:
            point = moved
            history.append(point.value)
    return Optimum(point.x, point.value, size, len(history) - 1, status, tuple(history))


def _why_stop(flat: bool, many: bool, deadline: Deadline | None) -> str:
    """Why to stop, empty to go on."""
    if flat:
        return "converged"
    if deadline is not None and deadline.is_over:
        return stopped_by(deadline)
    return "iteration limit" if many else ""


def stopped_by(deadline: Deadline) -> str:
    """What ended a search before its end."""
    return "interrupted" if deadline.stop.is_set() else "time limit"


def _at(problem: _Problem, x: Float) -> _Point:
    value, gradient = problem.function.value(x)
    l1 = problem.l1
    at_kink = np.sign(gradient) * np.maximum(np.abs(gradient) - l1, 0.0)
    slope = np.where(x == 0, at_kink, gradient - l1 * np.sign(x))
    return _Point(x, value - float(l1 @ np.abs(x)), slope)


def _free(problem: _Problem, point: _Point) -> NDArray[np.bool_]:
    """Coordinates that may move: not held by a bound, and not by a kink."""
    x, slope, bound = point.x, point.slope, problem.bound
    held = (x >= bound) & (slope > 0) | (x <= -bound) & (slope < 0)
    kink = (problem.l1 > 0) & (x == 0) & (slope == 0)
    return np.asarray(~held & ~kink)


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


def _line_search(problem: _Problem, point: _Point, step: Float) -> _Point | None:
    """The first of step, step/2, step/4, ... that increases the function enough; None if none does.

    With an L1 penalty no coordinate crosses zero: it stops there.
    """
    side = np.where(point.x != 0, np.sign(point.x), np.sign(point.slope))
    low = np.where((problem.l1 > 0) & (side > 0), 0.0, -problem.bound)
    high = np.where((problem.l1 > 0) & (side < 0), 0.0, problem.bound)
    length = 1.0
    slack = 1e-12 * max(1.0, abs(point.value))
    for _ in range(50):
        candidate = _at(problem, np.clip(point.x + length * step, low, high))
        gain = float(point.slope @ (candidate.x - point.x))
        if candidate.value >= point.value + 1e-4 * gain - slack:
            return candidate if (candidate.x != point.x).any() else None
        length /= 2
    return None
