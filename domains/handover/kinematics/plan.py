"""A joint path: two configurations and a test in, a collision-free path out, or none within the limit of steps.

RRT-Connect (Kuffner & LaValle 2000), seeded and limited in steps, after a look at the straight line.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mlnlite.domains.handover.kinematics.chain import Chain
from mlnlite.domains.handover.kinematics.pose import FloatArray, locked

STEP = 0.1
"""Longest joint step between two tested configurations [rad]."""

Test = Callable[[FloatArray], bool]


def plan_path(
    chain: Chain, start: FloatArray, goal: FloatArray, free: Test, *, limit: int = 1500, seed: int = 0
) -> FloatArray | None:
    """Waypoints from start to goal, shape (m, n) [rad], whose straight lines pass `free` at every `STEP`.

    Args:
        chain: joints and limits.
        start: configuration, shape (n,) [rad].
        goal: configuration, shape (n,) [rad].
        free: whether a configuration is collision-free.
        limit: of tree extensions.
        seed: of the samples.
    """  # fmt: skip
    if not (free(start) and free(goal)):
        return None
    if _line_is_free(start, goal, free):
        return locked(np.stack([start, goal]))
    rng = np.random.default_rng(seed)
    trees: tuple[_Tree, _Tree] = ([(start, -1)], [(goal, -1)])
    for i in range(limit):
        here, there = trees[i % 2], trees[1 - i % 2]
        sample = rng.uniform(chain.lower, chain.upper)
        if _extend(here, sample, free) and _connect(there, here[-1][0], free):
            halves = [_branch(trees[0]), _branch(trees[1])[::-1]]
            return locked(np.concatenate([halves[0], halves[1][1:]]))
    return None


_Tree = list[tuple[FloatArray, int]]


def _line_is_free(a: FloatArray, b: FloatArray, free: Test) -> bool:
    n = max(1, int(np.ceil(np.abs(b - a).max() / STEP)))
    return all(free(a + (b - a) * i / n) for i in range(1, n + 1))


def _extend(tree: _Tree, target: FloatArray, free: Test, reach: float = 0.4) -> bool:
    """Grows the tree from its nearest node by at most `reach` [rad] towards the target."""
    distance = [float(np.abs(node - target).max()) for node, _ in tree]
    nearest = int(np.argmin(distance))
    origin = tree[nearest][0]
    new = origin + (target - origin) * min(1.0, reach / max(distance[nearest], 1e-12))
    if not _line_is_free(origin, new, free):
        return False
    tree.append((new, nearest))
    return True


def _connect(tree: _Tree, target: FloatArray, free: Test) -> bool:
    while _extend(tree, target, free):
        if np.abs(tree[-1][0] - target).max() < 1e-9:
            return True
    return False


def _branch(tree: _Tree) -> FloatArray:
    """From the root to the last node, shape (m, n)."""
    nodes, i = [], len(tree) - 1
    while i >= 0:
        node, i = tree[i]
        nodes.append(node)
    return np.stack(nodes[::-1])
