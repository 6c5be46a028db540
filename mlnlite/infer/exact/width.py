"""A proof that no elimination order is narrow enough, much cheaper than looking for one in a large tangle.

In every order some variable is eliminated first, with a table over it and its neighbours; so the smallest such table is
a lower bound, of the graph and of each of its minors. Contracting the variable of the smallest table into its neighbour
of the smallest makes a denser minor (Bodlaender, Koster & Wolle 2006, contraction degeneracy; here with the number of
values of each variable, of two that are contracted the smaller).
"""

from __future__ import annotations

from heapq import heapify, heappop, heappush
from itertools import combinations
from math import log2

import numpy as np

from mlnlite.ground.network import Bool
from mlnlite.infer.reduce.potentials import Potentials


def unavoidable_table(adjacent: list[set[int]], bits: list[float], limit: float) -> tuple[int, float] | None:
    """A table past a limit that every order makes, or a larger one.

    Args:
        adjacent: the neighbours of each variable; used up.
        bits: log2 number of values of each variable; changed.
        limit: log2 number of entries.

    Returns:
        Number of variables and log2 number of entries of the smallest table of a minor; None if none passes the limit.
    """
    weight = [bits[v] + sum(bits[u] for u in near) for v, near in enumerate(adjacent)]
    heap = [(w, v) for v, w in enumerate(weight)]
    heapify(heap)
    gone = [False] * len(adjacent)
    while heap:
        w, v = heappop(heap)
        if gone[v] or w != weight[v]:
            continue
        if w > limit:
            return len(adjacent[v]) + 1, w
        gone[v] = True
        for u in _contract(adjacent, bits, weight, v):
            heappush(heap, (weight[u], u))
    return None


def _contract(adjacent: list[set[int]], bits: list[float], weight: list[float], v: int) -> set[int]:
    """Contracts a variable into a neighbour; returns the variables whose table changes."""
    near = adjacent[v]
    if not near:
        return near
    into = min(near, key=lambda u: (weight[u], u))
    for u in near:
        adjacent[u].remove(v)
        weight[u] -= bits[v]
    for u in near - adjacent[into]:
        if u != into:
            adjacent[u].add(into)
            adjacent[into].add(u)
            weight[u] += bits[into]
            weight[into] += bits[u]
    less = bits[into] - min(bits[into], bits[v])
    if less == 0:
        return near
    bits[into] -= less
    for u in (into, *adjacent[into]):
        weight[u] -= less
    return near | adjacent[into]


def is_tangled(potentials: Potentials, variables: Bool, limit: int) -> bool:
    """Whether counting factors tie variables together so closely that writing them out as tables is of no use.

    Each one counts as a single variable of two values next to all that it counts: the tables have that as a minor.

    Args:
        potentials: with chains.
        variables: shape (n,), of one component.
        limit: largest number of entries of a table.
    """
    n, chains = len(potentials.cardinality), [row for c in potentials.chains for row in c.variable]
    adjacent: list[set[int]] = [set() for _ in range(n + len(chains))]
    pairs = [(n + i, v) for i, row in enumerate(chains) for v in row[variables[row]].tolist()]
    for cells in potentials.cells:
        of_part = cells.scope[variables[cells.scope].all(axis=1)]
        pairs += [(a, b) for scope in np.unique(of_part, axis=0).tolist() for a, b in combinations(scope, 2)]
    for a, b in pairs:
        adjacent[a].add(b)
        adjacent[b].add(a)
    bits = [*np.log2(np.maximum(potentials.cardinality, 2)).tolist(), *[1.0] * len(chains)]
    return unavoidable_table(adjacent, bits, log2(limit) + 1e-9) is not None
