"""The likelihood where it is too wide to be summed over: persistent chains, natural gradient, averaged iterates.

First a path of small steps, each along the natural gradient (Amari 1998) that chains show which go on from step to step
while the weights change (Tieleman, ICML 2008; Younes 1999); its second half is averaged (Polyak and Juditsky 1992).
Then rounds of longer runs at fixed weights, each followed by a Newton step, until the error that sampling leaves in a
weight is a small part of the error that the data leave in it. Where atoms are unknown, a second set of chains draws
them given what is known: a Monte Carlo E-step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mlnlite.infer.deadline import Deadline
from mlnlite.learn.objectives.chains import Chains, new_chains, sweep
from mlnlite.learn.optimise import information, likelihood
from mlnlite.learn.optimise.newton import stopped_by
from mlnlite.learn.optimise.problem import Problem
from mlnlite.learn.prior import Penalty

Float = NDArray[np.float64]
Pairs: TypeAlias = list[tuple[Chains, Chains]]

N_CHAINS = 8
STEPS = 300
ROUNDS = 12
FIRST_ROUND = 100
LONGEST_ROUND = 3200
BATCHES = 10
SMALL = 0.1
"""Monte Carlo error of a weight that is small enough, in standard errors from the data."""
LONGEST_STEP = 0.5
PATIENCE = 60.0
"""Seconds after which sampling stops, unless a limit is given."""


@dataclass(frozen=True, slots=True)
class Sampled:
    """Weights found by sampling.

    Attributes:
        x: the free weights.
        error: shape (n_free,), Monte Carlo standard error of each.
        gradient: largest entry of the gradient that was last seen, which is noisy.
        rounds: steps and rounds.
        status: `sampled`, or what stopped it before the errors were small.
    """

    x: Float
    error: Float
    gradient: float
    rounds: int
    status: str


@dataclass(frozen=True, slots=True)
class _Seen:
    """What chains say at some weights.

    Attributes:
        slope: gradient of log-likelihood and log prior, shape (n,).
        bend: minus the Hessian as if all atoms were known, plus that of the prior, shape (n, n).
        hidden: what unknown atoms take off it.
        noise: covariance of the slope, shape (n, n).
    """

    slope: Float
    bend: Float
    hidden: Float
    noise: Float


def sampled(problem: Problem, penalty: Penalty, start: Float, seed: int, deadline: Deadline) -> Sampled:
    """The most probable free weights, with the errors of sampling.

    Args:
        problem: with databases kept as networks.
        penalty: of the free weights, without an L1 part.
        start: shape (n_free,).
        seed: where chance starts.
        deadline: when to stop with the best so far.
    """
    random = np.random.default_rng(seed)
    if deadline.left == np.inf:
        deadline = deadline.within(PATIENCE)
    pairs = [(new_chains(w.every, N_CHAINS, random), new_chains(w.known, N_CHAINS, random)) for w in problem.wide]
    x, pairs = _path(problem, penalty, start, pairs, (random, deadline))
    n, status, rounds = FIRST_ROUND, "", 0
    while not status:
        rounds += 1
        seen, pairs = _look(problem, penalty, x, pairs, n, random)
        bend = _positive(seen.bend - seen.hidden, seen.bend)
        inverse = np.linalg.pinv(bend, hermitian=True)
        step = inverse @ seen.slope
        error = np.sqrt(np.maximum((inverse @ seen.noise @ inverse).diagonal(), 0.0))
        sure = np.sqrt(np.maximum(inverse.diagonal(), 1e-300))
        x = x + step / max(1.0, float(np.abs(step).max(initial=0.0)) / LONGEST_STEP)
        if (error <= SMALL * sure).all() and (np.abs(step) <= 3 * SMALL * sure).all():
            status = "sampled"
        elif deadline.is_over:
            status = stopped_by(deadline)
        elif rounds == ROUNDS:
            status = "limit of rounds"
        n = min(2 * n, LONGEST_ROUND)
    return Sampled(x, error, float(np.abs(seen.slope).max(initial=0.0)), STEPS + rounds, status)


def sampled_scores(problem: Problem, x: Float, seed: int) -> tuple[Float, Float]:
    """What chains say of databases kept as networks at some free weights, which they are given time to forget.

    Returns:
        The gradient of each, shape (n_wide, n_free), and minus the Hessian of all, shape (n_free, n_free).
    """
    random = np.random.default_rng(seed)
    weights, slopes, bend = problem.all_weights(x), [], np.zeros((len(x), len(x)))
    for one in problem.wide:
        means, sides = [], []
        for network in (one.known, one.every):
            chains, _ = sweep(new_chains(network, N_CHAINS, random), weights, problem.share, FIRST_ROUND, random)
            _, draws = sweep(chains, weights, problem.share, 4 * FIRST_ROUND, random)
            means.append(draws.mean(axis=(0, 1)))
            sides.append(_covariance(draws))
        slopes.append(one.times * (means[0] - means[1]))
        bend += one.times * (sides[1] - sides[0])
    return np.array(slopes).reshape(-1, len(x)), bend


def _path(
    problem: Problem, penalty: Penalty, x: Float, pairs: Pairs, how: tuple[np.random.Generator, Deadline]
) -> tuple[Float, Pairs]:
    """The mean of the second half of a path of steps, and where the chains end."""
    random, deadline = how
    bend, total, n_averaged = np.zeros((len(x), len(x))), np.zeros(len(x)), 0
    for t in range(STEPS):
        seen, pairs = _look(problem, penalty, x, pairs, 1, random)
        bend = bend + (seen.bend - bend) / min(t + 1, 50)
        ridge = np.diag(0.05 * bend.diagonal() + 1e-3)
        step = np.linalg.solve(bend + ridge, seen.slope) * (1 + t / 20) ** -0.7
        x = x + step / max(1.0, float(np.abs(step).max(initial=0.0)) / LONGEST_STEP)
        if 2 * t >= STEPS:
            total, n_averaged = total + x, n_averaged + 1
        if deadline.is_over:
            break
    return (total / n_averaged if n_averaged else x), pairs


def _look(
    problem: Problem, penalty: Penalty, x: Float, pairs: Pairs, n: int, random: np.random.Generator
) -> tuple[_Seen, Pairs]:
    """Gradient and curvature from `n` sweeps of each chain."""
    weights, share = problem.all_weights(x), problem.share
    point = likelihood.at(problem.every, x)
    _, pull, stiff = penalty.smooth(x)
    slope = point.gradient - pull
    bend = np.asarray(information.hessian(problem.every, x).todense(), float) + np.diag(stiff)
    hidden, noise = np.zeros_like(bend), np.zeros_like(bend)
    if problem.known is not None:
        slope = slope - likelihood.at(problem.known, x).gradient
        hidden += np.asarray(information.hessian(problem.known, x).todense(), float)
    moved = []
    for (every, known), times in zip(pairs, (w.times for w in problem.wide), strict=True):
        every, of_every = sweep(every, weights, share, n, random)
        known, of_known = sweep(known, weights, share, n, random)
        moved.append((every, known))
        slope = slope + times * (of_known.mean(axis=(0, 1)) - of_every.mean(axis=(0, 1)))
        bend, hidden = bend + times * _covariance(of_every), hidden + times * _covariance(of_known)
        noise = noise + times**2 * (_of_mean(of_every) + _of_mean(of_known))
    return _Seen(slope, bend, hidden, noise), moved


def _covariance(draws: Float) -> Float:
    """Covariance of counts in draws of shape (n_chains, n, k); of few draws around the mean of all chains at once."""
    flat = draws.reshape(-1, draws.shape[2])
    return np.cov(flat.T, ddof=1).reshape(draws.shape[2], draws.shape[2])


def _of_mean(draws: Float) -> Float:
    """Covariance of the mean of all draws, from means of batches (Flegal and Jones 2010)."""
    n_chains, n, k = draws.shape
    n_batches = min(BATCHES, n)
    kept = draws[:, : n // n_batches * n_batches]
    means = kept.reshape(n_chains * n_batches, n // n_batches, k).mean(axis=1)
    return _covariance(means[None]) / len(means)


def _positive(matrix: Float, above: Float) -> Float:
    """A symmetric matrix if it is positive, else one that is and larger: what sampling left negative is raised."""
    value, vector = np.linalg.eigh(matrix)
    low = 0.05 * np.einsum("ij,jk,ki->i", vector.T, above, vector)
    return np.asarray((vector * np.maximum(value, low)) @ vector.T)
