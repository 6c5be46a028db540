"""Compiled: the worlds of one part of a slice, one after the other."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Int64
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.assign import assign
from mlnlite.infer.sample.mcsat.slice import Slice


@compiled
def list_worlds(f: Factors, s: Slice, order: Int64, trial: Int64, target: int, steps: int) -> int:
    """Counts the worlds of a part by depth-first search, or goes to one of them.

    Args:
        f: the factors.
        s: the slice.
        order: shape (n,), the variables of the part.
        trial: shape (n,), gets the true atom of each in the world where the search stops; smaller than all for none.
        target: number of the world to stop at, from 1 on; 0 to count all.
        steps: values to try at most.

    Returns:
        How many worlds were met, -1 if there were too many steps.
    """
    depth, n_worlds = 0, 0
    trial[0] = f.first[order[0]] - 2
    while depth >= 0:
        v = order[depth]
        if trial[depth] >= f.first[v] - 1:
            assign(f, s, v, trial[depth], np.int64(-1))
        trial[depth] += 1
        if trial[depth] == f.first[v] - 1 and not f.none[v]:
            trial[depth] += 1
        while f.first[v] <= trial[depth] < f.first[v + 1] and s.fixed[trial[depth]] >= 0:
            trial[depth] += 1
        if trial[depth] == f.first[v + 1]:
            depth -= 1
            continue
        steps -= 1
        if assign(f, s, v, trial[depth], np.int64(1)):
            if depth == len(order) - 1:
                n_worlds += 1
                if n_worlds == target:
                    return n_worlds
            else:
                depth += 1
                trial[depth] = f.first[order[depth]] - 2
        if steps < 0:
            for d in range(depth + 1):
                if trial[d] >= f.first[order[d]] - 1:
                    assign(f, s, order[d], trial[d], np.int64(-1))
            return -1
    return n_worlds
