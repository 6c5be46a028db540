"""Chains of worlds: comes in factors and a world to start from, go out sums of conditional probabilities.

Blocked Gibbs sampling (Geman and Geman 1984) gives a functional block its value at once. What is averaged is not
whether an atom is true but how probable that is given all others (Rao-Blackwell; Gelfand and Smith 1990).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32
from mlnlite.infer.factors import Factors

_AT_ONCE = 1 << 20


@dataclass(frozen=True, slots=True)
class Chain:
    """One chain; its arrays change from draw to draw.

    Attributes:
        factors: of which.
        true: shape (n_variables,), the true atom of each variable, -1 for none.
        state: shape (n_factors,), of each factor.
        rng: where its chance comes from.
        beta: what log-weights are multiplied by.
        hotter: chains with ever smaller beta that it may trade worlds with.
    """

    factors: Factors
    true: Int32
    state: Int32
    rng: np.random.Generator = field(repr=False)
    beta: float = 1.0
    hotter: tuple[Chain, ...] = ()


@dataclass(frozen=True, slots=True)
class Sums:
    """What some draws add up to.

    Attributes:
        total: shape (2, n_atoms): of the probabilities given all others, of their squares.
        seen: shape (n_draws, n_watched), truth of some atoms after each draw.
    """

    total: Float
    seen: Bool


def start(factors: Factors, truth: Bool, rng: np.random.Generator, beta: float = 1.0) -> Chain:
    """A chain that starts in a world.

    Args:
        factors: of which.
        truth: shape (n_atoms,), one atom or none of each variable is true.
        rng: where its chance comes from.
        beta: what log-weights are multiplied by.
    """
    owner = owners(factors)
    true = np.full(factors.n_variables, -1, np.int32)
    true[owner[truth]] = np.flatnonzero(truth)
    return Chain(factors, true, states(factors, true), rng, beta)


def owners(factors: Factors) -> Int32:
    """Variable of each atom."""
    return np.repeat(np.arange(factors.n_variables, dtype=np.int32), np.diff(factors.first))


def states(factors: Factors, true: Int32) -> Int32:
    """State of each factor where some atoms are true.

    Args:
        factors: of which.
        true: shape (n_variables,), the true atom of each variable, -1 for none.
    """
    truth = np.zeros(factors.n_atoms, np.bool_)
    truth[true[true >= 0]] = True
    gains = np.concatenate([[0], np.cumsum(factors.gain * truth[factors.member])])
    return (factors.base + np.diff(gains[factors.scope])).astype(np.int32)


def log_weights(chain: Chain) -> Float:
    """Shape (n_factors,): the log-weight of each factor in the present world."""
    return np.asarray(chain.factors.value[chain.factors.row + chain.state])


def gibbs_draws(chain: Chain, n: int, watched: Int32) -> Sums:
    """Sweeps.

    Args:
        chain: changed.
        n: how many sweeps.
        watched: shape (n_watched, 2), variables and atoms to follow.
    """
    from mlnlite.infer.gibbs_kernel import sweep

    n_variables = chain.factors.n_variables
    sums = Sums(np.zeros((2, chain.factors.n_atoms)), np.zeros((n, len(watched)), np.bool_))
    step = max(1, _AT_ONCE // n_variables)
    for begin in range(0, n, step):
        seen = sums.seen[begin : begin + step]
        uniform = chain.rng.random((len(seen), n_variables))
        sweep(chain.factors, chain.state, chain.true, uniform, chain.beta, sums.total, watched, seen)
    return sums
