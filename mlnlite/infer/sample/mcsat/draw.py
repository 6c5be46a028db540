"""Compiled: a world drawn uniformly from a slice, part by part of it."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Bool, Float, Int32
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.list import list_worlds
from mlnlite.infer.sample.mcsat.reach import reach
from mlnlite.infer.sample.mcsat.slice import Slice
from mlnlite.infer.sample.mcsat.walk import walk


@compiled
def draw(f: Factors, s: Slice, owner: Int32, uniform: Float, true: Int32, exact: Bool) -> None:
    """Draws all variables that a slice leaves open.

    The worlds of a part are listed twice: to count them, and to go to the one that a random number chose. In a part
    that has too many for that the variables get new values one at a time (`walk`). Which way is taken depends on the
    slice alone, so both leave the uniform distribution over it as it is.

    Args:
        f: the factors.
        s: the slice, propagated; its `part` and `left` change.
        owner: shape (n_atoms,), variable of each atom.
        uniform: shape (n_variables,), random numbers in [0, 1).
        true: shape (n_variables,), the true atom of each variable or -1: the present world, then the new one.
        exact: shape (n_variables,), set to False for variables that were not drawn uniformly.
    """
    reached, asked = np.zeros(len(f.none), np.bool_), np.zeros(len(f.row), np.bool_)
    order, trial = np.empty(len(f.none), np.int32), np.empty(len(f.none), np.int32)
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
        n_worlds = list_worlds(f, s, part, trial, 0, 4096 + 16 * len(part))
        if n_worlds < 0:
            exact[part] = False
            walk(f, s, part, uniform, true)
            continue
        list_worlds(f, s, part, trial, min(int(uniform[root] * n_worlds), n_worlds - 1) + 1, 1 << 62)
        for d in range(len(part)):
            true[part[d]] = trial[d] if trial[d] >= f.first[part[d]] else -1
