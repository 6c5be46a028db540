"""Chains of worlds: comes in factors and a world to start from, go out sums of conditional probabilities.

Blocked Gibbs sampling (Geman and Geman 1984) gives a functional block its value at once. What is averaged is not
whether an atom is true but how probable that is given all others (Rao-Blackwell; Gelfand and Smith 1990).
Where atoms softly exclude each other (a counting factor), a further move changes which of them is the true one: one
flip at a time would have to pass through worlds with two, or none.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32
from mlnlite.infer.sample.factors import Factors

_AT_ONCE = 1 << 20


@dataclass(frozen=True, slots=True)
class Chain:
    """One chain; its arrays change from draw to draw.

    Attributes:
        factors: of which.
        true: shape (n_variables,), the true atom of each variable, -1 for none.
        state: shape (n_factors,), of each factor.
        groups: shape (n_groups, n), atoms of which most often one is true, -1 after the last of a group.
        rng: where its chance comes from.
        beta: what log-weights are multiplied by.
        hotter: chains with ever smaller beta that it may trade worlds with.
    """

    factors: Factors
    true: Int32
    state: Int32
    groups: Int32 = field(repr=False)
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
    return Chain(factors, true, states(factors, true), groups_of(factors), rng, beta)


def owners(factors: Factors) -> Int32:
    """Variable of each atom."""
    return np.repeat(np.arange(factors.n_variables, dtype=np.int32), np.diff(factors.first))


def groups_of(factors: Factors) -> Int32:
    """The atoms of each counting factor over variables of two values: shape (n_groups, n), padded with -1."""
    binary = (np.diff(factors.first) == 1)[owners(factors)] & factors.none[owners(factors)]
    size = np.diff(factors.scope)
    free = np.logical_and.reduceat(binary[factors.member], factors.scope[:-1]) if len(size) else np.zeros(0, np.bool_)
    chosen = np.flatnonzero(free & factors.grouped)
    groups = np.full((len(chosen), int(size[chosen].max(initial=1))), -1, np.int32)
    for row, i in zip(groups, chosen.tolist(), strict=True):
        row[: size[i]] = factors.member[factors.scope[i] : factors.scope[i + 1]]
    return groups


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
    from mlnlite.infer.sample.gibbs_kernel import sweep
    from mlnlite.infer.sample.swap_kernel import swap

    f, rng, n_groups = chain.factors, chain.rng, len(chain.groups)
    sums = Sums(np.zeros((2, f.n_atoms)), np.zeros((n, len(watched)), np.bool_))
    owner = owners(f) if n_groups else np.zeros(0, np.int32)
    step = 1 if n_groups else max(1, _AT_ONCE // f.n_variables)
    for begin in range(0, n, step):
        seen = sums.seen[begin : begin + step]
        if n_groups:
            swap(f, chain.state, chain.true, chain.groups, owner, rng.random(n_groups), chain.beta)
        uniform = rng.random((len(seen), f.n_variables))
        sweep(f, chain.state, chain.true, uniform, chain.beta, sums.total, watched, seen)
    return sums
