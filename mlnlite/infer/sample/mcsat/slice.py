"""Compiled: the slice of MC-SAT, and what it forces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Bool, Float, Int32, Int64
from mlnlite.infer.sample.factors import Factors


class Slice(NamedTuple):
    """Which states of factors a step allows, and what is fixed.

    Attributes:
        least: shape (n_factors,), smallest allowed log-weight; minus infinity where anything goes.
        low: shape (n_factors,), smallest allowed state.
        high: shape (n_factors,), largest allowed state.
        whole: shape (n_factors,), whether all states between are allowed.
        part: shape (n_factors,), what is fixed of the state: of the true literals, or of the place in the table.
        left: shape (n_factors,), sum of the steps of the atoms that are not fixed.
        fixed: shape (n_atoms,), 1 true, 0 false, -1 not fixed.
    """

    least: Float
    low: Int32
    high: Int32
    whole: Bool
    part: Int32
    left: Int32
    fixed: Int32


def empty_slice(factors: Factors) -> Slice:
    """Room for a slice."""
    n, counts = factors.n_factors, np.zeros((4, factors.n_factors), np.int32)
    fixed = np.empty(factors.n_atoms, np.int32)
    return Slice(np.empty(n), counts[0], counts[1], np.empty(n, np.bool_), counts[2], counts[3], fixed)


@compiled
def cut(f: Factors, s: Slice, state: Int32, uniform: Float, queue: Int64) -> int:
    """Draws the slice: the log-weight of each factor may not fall below a random level under its present one.

    Args:
        f: the factors.
        s: written here; nothing is fixed.
        state: shape (n_factors,), of the present world.
        uniform: shape (n_factors,), random numbers in [0, 1).
        queue: shape (n_factors + n_atoms,), gets the factors that force something.

    Returns:
        How many those are.
    """
    n_queued = 0
    s.fixed[:] = -1
    for i in range(len(f.row)):
        s.part[i], s.left[i] = 0, f.size[i] - 1
        s.least[i] = f.value[f.row[i] + state[i]] + np.log(1.0 - uniform[i])
        s.low[i], s.high[i], n_allowed = f.size[i], -1, 0
        for k in range(f.size[i]):
            if f.value[f.row[i] + k] >= s.least[i]:
                s.low[i], s.high[i] = min(s.low[i], k), k
                n_allowed += 1
        s.whole[i] = f.counted[i] and n_allowed == s.high[i] - s.low[i] + 1
        if n_allowed == f.size[i]:
            s.least[i] = -np.inf
        elif f.counted[i] and (s.low[i] == s.left[i] or s.high[i] == 0):
            queue[n_queued] = i
            n_queued += 1
    return n_queued
