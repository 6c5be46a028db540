"""Compiled: in groups of which one atom is true, draws which one."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Float, Int32
from mlnlite.infer.sample.factors import Factors


@compiled
def swap(f: Factors, state: Int32, true: Int32, groups: Int32, owner: Int32, uniform: Float, beta: float) -> None:
    """Where exactly one atom of a group is true, draws which one, given all other atoms.

    Args:
        f: the factors.
        state: shape (n_factors,), of each factor, kept up to date.
        true: shape (n_variables,), the true atom of each variable, -1 for none, kept up to date.
        groups: shape (n_groups, n), atoms that are variables of their own, -1 after the last of a group.
        owner: shape (n_atoms,), variable of each atom.
        uniform: shape (n_groups,), random numbers in [0, 1).
        beta: what log-weights are multiplied by.
    """
    worth = np.empty(groups.shape[1])
    for g in range(len(groups)):
        n_true, now, size = 0, -1, 0
        for a in groups[g]:
            size += a >= 0
            if a >= 0 and true[owner[a]] == a:
                n_true, now = n_true + 1, a
        if n_true != 1:
            continue
        for u in range(f.use[now], f.use[now + 1]):
            state[f.factor[u]] -= f.step[u]
        for i in range(size):
            worth[i] = 0.0
            for u in range(f.use[groups[g, i]], f.use[groups[g, i] + 1]):
                at = f.row[f.factor[u]] + state[f.factor[u]]
                worth[i] += beta * (f.value[at + f.step[u]] - f.value[at])
        top = worth[:size].max()
        cumulated = np.cumsum(np.exp(worth[:size] - top))
        chosen = groups[g, min(np.searchsorted(cumulated, uniform[g] * cumulated[-1], side="right"), size - 1)]
        true[owner[now]] = -1
        true[owner[chosen]] = chosen
        for u in range(f.use[chosen], f.use[chosen + 1]):
            state[f.factor[u]] += f.step[u]
