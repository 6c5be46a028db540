"""Problem and prior to weights: the search, and the spread that rows of a template share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.infer.deadline import Deadline
from mlnlite.learn.data.merge import Choices
from mlnlite.learn.optimise.newton import Optimum, maximise
from mlnlite.learn.optimise.problem import Problem, information, information_diagonal, log_likelihood, one_sided
from mlnlite.learn.prior import Hierarchical, OnePrior, Penalty

Float = NDArray[np.float64]

BOUND = 30.0
"""Largest size of a weight: odds of e^30, 10^13 to 1."""

AGREE = 1e-6
"""How much worse weights at their bounds may explain the data than weights without bounds."""

GRADIENT = "largest gradient entry"

NARROWEST = 0.05
"""Smallest spread that rows of a template are found to have."""

ROUNDS = 50
"""Most rounds of the search for the mean and spread that rows share."""


@dataclass(frozen=True, slots=True)
class Posterior:
    """Log-likelihood plus the smooth part of the log prior.

    With unknown atoms the gradient is that of the expected complete log-likelihood (an exact E-step), and a step is a
    Newton step where the function is concave, else one along the gradient (Lange, A gradient algorithm locally
    equivalent to the EM algorithm, JRSS B 1995); the search never goes down.
    """

    problem: Problem
    penalty: Penalty

    def value(self, x: Float) -> tuple[float, Float]:
        """Value and gradient."""
        value, gradient = log_likelihood(self.problem, x)
        loss, slope, _ = self.penalty.smooth(x)
        return value - loss, gradient - slope

    def curvature(self, x: Float) -> tuple[Callable[[Float], Float], Float]:
        """Minus the Hessian, and about its diagonal."""
        product, pull = information(self.problem, x), self.penalty.smooth(x)[2]
        return lambda d: product(d) + pull * d, information_diagonal(self.problem, x) + pull


@dataclass(frozen=True, slots=True)
class Solution:
    """The best weights.

    Attributes:
        optimum: over the free weights.
        unbounded: of each free weight, 1 or -1 if the likelihood alone pushes it to infinity.
        penalty: of all weights, with what was learnt of the prior put in.
        error: of each free weight, Monte Carlo standard error; None if nothing was sampled.
        measure: what `optimum.gradient` is.
    """

    optimum: Optimum
    unbounded: NDArray[np.int8]
    penalty: Penalty
    error: Float | None = None
    measure: str = GRADIENT


def solve(problem: Problem, penalty: Penalty, deadline: Deadline | None, start: Float) -> Solution:
    """The optimum over the free weights, looked for from `start`, and which of them have none without a prior."""
    from threadpoolctl import threadpool_limits  # BLAS threads make vectors of this size slower

    own = penalty.of(problem.free)
    plain = problem.known is None and not problem.wide
    with threadpool_limits(1, "blas"):
        if plain and not (own.precision + own.l1 + own.cauchy).any():
            return _without_prior(problem, penalty, deadline, start)
        n = len(problem.free)
        unbounded = one_sided(problem.every)[0] if plain else np.zeros(n, np.int8)
        optimum = best(problem, own, start, deadline)
        if not own.proper:
            at_bound = (np.abs(optimum.x) >= BOUND) & (own.precision + own.l1 + own.cauchy == 0)
            unbounded[at_bound] = np.sign(optimum.x[at_bound]).astype(np.int8)
        return Solution(optimum, unbounded, penalty)


def best(problem: Problem, penalty: Penalty, start: Float, deadline: Deadline | None) -> Optimum:
    """The most probable free weights; `penalty` is theirs."""
    tolerance = 1e-8 if not problem.wide and problem.known is None else 1e-6
    return maximise(Posterior(problem, penalty), start, BOUND, l1=penalty.l1, tolerance=tolerance, deadline=deadline)


def start_of(problem: Problem) -> Float:
    """Zero; a little off it if some atoms are unknown, as the likelihood can be level there."""
    n = len(problem.free)
    hidden = problem.known is not None or any(w.known.n_atoms for w in problem.wide)
    return 0.1 * np.random.default_rng(0).normal(size=n) if hidden else np.zeros(n)


def _without_prior(problem: Problem, penalty: Penalty, deadline: Deadline | None, start: Float) -> Solution:
    """Weights that nothing holds go to the bound first, then the others are found.

    Where one weight would have to be larger than another that is itself without bound, only what nothing holds *by
    itself* goes to the bound, and all others are looked for.
    """
    found = problem.every
    unbounded, left = one_sided(found)
    rest = replace(found, rows=found.rows[left], log_times=found.log_times[left], choice=found.choice[left])
    x, optimum = _inside(problem, rest, unbounded, penalty, start, deadline)
    value = log_likelihood(problem, x)[0]
    if value < optimum.value - AGREE:
        alone = np.where(
            (found.rows.min(axis=0).toarray() >= 0) | (found.rows.max(axis=0).toarray() <= 0), unbounded, 0
        )
        x, optimum = _inside(problem, found, alone, penalty, start, deadline)
        value = log_likelihood(problem, x)[0]
    at_bound = np.abs(x) >= BOUND
    unbounded[at_bound] = np.sign(x[at_bound]).astype(np.int8)
    return Solution(replace(optimum, x=x, value=value), unbounded, penalty)


def _inside(
    problem: Problem,
    choices: Choices,
    at_bound: NDArray[np.int8],
    penalty: Penalty,
    start: Float,
    deadline: Deadline | None,
) -> tuple[Float, Optimum]:
    """All weights, some at the bound; and the optimum over the others by what some choices say."""
    inner = np.flatnonzero(at_bound == 0)
    x = BOUND * at_bound.astype(float)
    log_times = choices.log_times - choices.rows @ x
    part = replace(
        problem, every=replace(choices, rows=choices.rows[:, inner], log_times=log_times), free=problem.free[inner]
    )
    optimum = best(part, penalty.of(part.free), start[inner], deadline)
    x[inner] = optimum.x
    return x, optimum


# --- means and spreads that are learnt


def solve_hierarchical(
    problem: Problem,
    penalty: Penalty,
    groups: Sequence[tuple[OnePrior | None, int]],
    deadline: Deadline | None,
    start: Float,
) -> Solution:
    """Weights with the means and spreads that rows of templates share.

    Empirical Bayes by approximate EM: given mean and spread the most probable weights and how sure they are (Laplace's
    approximation), given these the mean and spread; Gelman and others, Bayesian Data Analysis, 2013, section 5.4.

    Args:
        problem: what to solve.
        penalty: of all weights, to start from.
        groups: prior and number of weights of each template.
        deadline: when to stop.
        start: where to look first.
    """
    solution = solve(problem, penalty, deadline, start)
    for _ in range(ROUNDS):
        x = solution.optimum.x
        sure = information_diagonal(problem, x) + solution.penalty.of(problem.free).precision
        penalty = _shared(problem, solution, 1.0 / sure, groups)
        moved = np.abs(penalty.mean - solution.penalty.mean).max(initial=0.0)
        moved += np.abs(np.log(penalty.precision / solution.penalty.precision)).max(initial=0.0)
        optimum = best(problem, penalty.of(problem.free), x, deadline)
        solution = replace(solution, optimum=optimum, penalty=penalty)
        if moved < 1e-3 or (deadline is not None and deadline.is_over):
            break
    return solution


def _shared(
    problem: Problem, solution: Solution, variance: Float, groups: Sequence[tuple[OnePrior | None, int]]
) -> Penalty:
    """The penalty with the mean and spread of each template's rows put in."""
    mean, precision = solution.penalty.mean.copy(), solution.penalty.precision.copy()
    first = 0
    for prior, size in groups:
        rows, first = slice(first, first + size), first + size
        inside = (problem.free >= rows.start) & (problem.free < rows.stop)
        n = int(inside.sum())
        if not isinstance(prior, Hierarchical) or n < 2:
            continue
        x = solution.optimum.x[inside]
        spread = float(precision[rows][0]) ** -0.5
        centre = float(x.sum()) / (n + (spread / prior.sd) ** 2)
        square = float(((x - centre) ** 2 + variance[inside]).mean())
        mean[rows], precision[rows] = centre, 1.0 / np.clip(square, NARROWEST**2, prior.sd**2)
    return replace(solution.penalty, mean=mean, precision=precision)
