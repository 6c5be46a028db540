"""Compiled: one connected part of what a slice leaves open."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Bool, Int32, Int64
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.slice import Slice


@compiled
def reach(f: Factors, s: Slice, owner: Int32, root: int, reached: Bool, asked: Bool, order: Int64) -> int:
    """The variables that hang together with one of them through factors that the slice could still violate.

    Args:
        f: the factors.
        s: the slice, propagated.
        owner: shape (n_atoms,), variable of each atom.
        root: where to start.
        reached: shape (n_variables,), which variables have been reached, kept up to date.
        asked: shape (n_factors,), which factors have been crossed, kept up to date.
        order: gets the variables, nearest first.

    Returns:
        How many.
    """
    reached[root] = True
    order[0], n, done = root, 1, 0
    while done < n:
        v = order[done]
        done += 1
        for a in range(f.first[v], f.first[v + 1]):
            if s.fixed[a] >= 0:
                continue
            for u in range(f.use[a], f.use[a + 1]):
                i = f.factor[u]
                if asked[i] or s.least[i] == -np.inf:
                    continue
                asked[i] = True
                if s.whole[i] and s.part[i] >= s.low[i] and s.part[i] + s.left[i] <= s.high[i]:
                    continue
                for m in range(f.scope[i], f.scope[i + 1]):
                    if s.fixed[f.member[m]] < 0 and not reached[owner[f.member[m]]]:
                        reached[owner[f.member[m]]] = True
                        order[n] = owner[f.member[m]]
                        n += 1
    return n
