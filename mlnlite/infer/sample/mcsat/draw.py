"""Compiled: a world drawn uniformly from a slice, part by part of it."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Float, Int32, Int64
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.list import list_worlds
from mlnlite.infer.sample.mcsat.reach import reach
from mlnlite.infer.sample.mcsat.slice import Slice


@compiled
def draw(f: Factors, s: Slice, owner: Int32, uniform: Float, true: Int32, steps: int) -> Int64:
    """Draws all variables that a slice leaves open, but for parts with too many worlds.

    The worlds of a part are listed twice: to count them, and to go to the one that a random number chose. Which parts
    have too many depends on the slice alone, so all others are drawn uniformly.

    Args:
        f: the factors.
        s: the slice, propagated; its `part` and `left` change.
        owner: shape (n_atoms,), variable of each atom.
        uniform: shape (n_variables,), random numbers in [0, 1).
        true: shape (n_variables,), the true atom of each variable or -1: the present world, then the new one.
        steps: how many values to try in a part at most, besides 16 for each variable.

    Returns:
        Shape (2, n): the variables that were not drawn, part by part, and a number for each one's part.
    """
    reached, asked = np.zeros(len(f.none), np.bool_), np.zeros(len(f.row), np.bool_)
    room, left, n_left = np.empty((2, len(f.none)), np.int64), np.empty((2, len(f.none)), np.int64), 0
    order, trial = room[0], room[1]
    for v in range(len(f.none)):
        n_open = 0
        for a in range(f.first[v], f.first[v + 1]):
            n_open += s.fixed[a] < 0
            if s.fixed[a] == 1:
                true[v] = a
        reached[v] = n_open == 0
        if n_open == 0 and true[v] >= 0 and s.fixed[true[v]] == 0:
            true[v] = -1
    for root in range(len(f.none)):
        if reached[root]:
            continue
        part = order[: reach(f, s, owner, root, reached, asked, order)]
        n_worlds = list_worlds(f, s, part, trial, np.int64(0), np.int64(steps + 16 * len(part)))
        if n_worlds < 0:
            for v in part:
                left[0, n_left], left[1, n_left] = v, root
                n_left += 1
            continue
        target = np.int64(min(int(uniform[root] * n_worlds), n_worlds - 1) + 1)
        list_worlds(f, s, part, trial, target, np.int64(1 << 62))
        for d in range(len(part)):
            true[part[d]] = trial[d] if trial[d] >= f.first[part[d]] else -1
    return left[:, :n_left]
