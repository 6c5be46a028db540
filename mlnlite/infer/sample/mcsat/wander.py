"""Compiled: SampleSAT in the parts of a slice that have too many worlds to list."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Float, Int32, Int64
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.slice import Slice
from mlnlite.infer.sample.mcsat.turn import pull_of, turn, value_of

FOCUSED = 0.5
"""Share of the moves that start from a violated factor, where there is one."""


class Trips(NamedTuple):
    """Where trips go, and their chance.

    Attributes:
        variables: shape (n,), those of some parts, part by part.
        span: shape (n_trips, 2), where the variables of the part of each trip start and end.
        uniform: shape (n_trips, longest trip, 5), random numbers in [0, 1).
        heat: shape (n_trips,), what a violated factor costs.
    """

    variables: Int64
    span: Int64
    uniform: Float
    heat: Float


@compiled
def wander(f: Factors, s: Slice, owner: Int32, trips: Trips, true: Int32) -> None:
    """Takes many trips through worlds that the slice forbids, each from a world that it allows to such a world.

    Moves are those of SampleSAT: half of them change a variable of a violated factor, as WalkSAT does, half any
    variable, as annealing at a fixed temperature does. Each is taken with the probability of Metropolis and Hastings
    for weights exp(-heat * number of violated factors), so trips from world to world are as likely both ways, and the
    uniform distribution over the worlds that the slice allows stays as it is. A trip that takes too long is taken back.

    Args:
        f: the factors.
        s: the slice, propagated; what it holds about the parts changes.
        owner: shape (n_atoms,), variable of each atom.
        trips: through which parts.
        true: shape (n_variables,), the true atom of each variable or -1, in a world that the slice allows; changed.
    """
    broken, place = np.empty(len(f.row), np.int64), np.full(len(f.row), -1, np.int64)
    share, past = _shares(f, s, trips.variables, true), np.empty((trips.uniform.shape[1], 2), np.int64)
    for k in range(len(trips.heat)):
        part = trips.variables[trips.span[k, 0] : trips.span[k, 1]]
        n_broken, length = 0, 0
        for t in range(trips.uniform.shape[1]):
            u, before = trips.uniform[k, t], n_broken
            v = np.int64(part[int(u[1] * len(part))])
            if before > 0 and u[0] < FOCUSED:
                v = _near(f, s, owner, broken[int(u[1] * before)], u[2])
            old, new = np.int64(true[v]), value_of(f, s, v, np.int64(true[v]), u[3])
            there = _chance(before, pull_of(f, s, v, place, share), len(part))
            n_broken = turn(f, s, old, new, broken, place, before)
            back = _chance(n_broken, pull_of(f, s, v, place, share), len(part))
            if u[4] * there < np.exp(trips.heat[k] * (before - n_broken)) * back:
                true[v], past[length, 0], past[length, 1] = new, v, old
                length += 1
            else:
                n_broken = turn(f, s, new, old, broken, place, n_broken)
            if n_broken == 0:
                break
        if n_broken == 0:
            length = 0
        while length > 0:
            length -= 1
            v, old = past[length, 0], past[length, 1]
            n_broken = turn(f, s, np.int64(true[v]), old, broken, place, n_broken)
            true[v] = old


@compiled
def _shares(f: Factors, s: Slice, part: Int64, true: Int32) -> Float:
    """One over the number of open atoms of each factor; the states of factors get what the part adds to them."""
    n_open = np.zeros(len(f.row))
    for v in part:
        for a in range(f.first[v], f.first[v + 1]):
            if s.fixed[a] >= 0:
                continue
            for u in range(f.use[a], f.use[a + 1]):
                i = f.factor[u]
                n_open[i] += 1.0
                s.part[i] += f.step[u] * (a == true[v]) - min(f.step[u], 0) * f.counted[i]
    return 1.0 / np.maximum(n_open, 1.0)


@compiled
def _near(f: Factors, s: Slice, owner: Int32, factor: int, uniform: float) -> int:
    """The variable of a random open atom of a factor."""
    left, found = int(uniform * _n_open(f, s, factor)), 0
    for m in range(f.scope[factor], f.scope[factor + 1]):
        if s.fixed[f.member[m]] < 0:
            found = int(owner[f.member[m]]) if left == 0 else found
            left -= 1
    return found


@compiled
def _n_open(f: Factors, s: Slice, factor: int) -> int:
    """How many atoms of a factor are open."""
    n = 0
    for m in range(f.scope[factor], f.scope[factor + 1]):
        n += s.fixed[f.member[m]] < 0
    return n


@compiled
def _chance(n_broken: int, pull: float, n: int) -> float:
    """Probability that a move picks a variable: of a violated factor, if there is one, or any."""
    return 1.0 / n if n_broken == 0 else (1.0 - FOCUSED) / n + FOCUSED * pull / n_broken
