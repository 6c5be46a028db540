"""Compiled: sweeps of blocked Gibbs sampling."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Bool, Float, Int32
from mlnlite.infer.sample.factors import Factors


@compiled
def sweep(  # noqa: C901
    f: Factors, state: Int32, true: Int32, uniform: Float, beta: float, total: Float, watched: Int32, seen: Bool
) -> None:
    """Gives each variable in turn a value drawn given all others.

    Args:
        f: the factors.
        state: shape (n_factors,), of each factor, kept up to date.
        true: shape (n_variables,), the true atom of each variable, -1 for none, kept up to date.
        uniform: shape (n_sweeps, n_variables), random numbers in [0, 1).
        beta: what log-weights are multiplied by.
        total: shape (2, n_atoms), gains the probability of each atom given all others, and its square.
        watched: shape (n_watched, 2), variables and their atoms.
        seen: shape (n_sweeps, n_watched), whether those atoms are true after each sweep, written here.
    """
    worth = np.empty(np.max(f.first[1:] - f.first[:-1]))
    for k in range(len(uniform)):
        for v in range(len(f.none)):
            begin, end = f.first[v], f.first[v + 1]
            if true[v] >= 0:
                for u in range(f.use[true[v]], f.use[true[v] + 1]):
                    state[f.factor[u]] -= f.step[u]
            top = 0.0 if f.none[v] else -np.inf
            for a in range(begin, end):
                gain = 0.0
                for u in range(f.use[a], f.use[a + 1]):
                    at = f.row[f.factor[u]] + state[f.factor[u]]
                    gain += f.value[at + f.step[u]] - f.value[at]
                worth[a - begin] = beta * gain
                top = max(top, beta * gain)
            mass = np.exp(-top) if f.none[v] else 0.0
            for a in range(end - begin):
                worth[a] = np.exp(worth[a] - top)
                mass += worth[a]
            left, chosen = uniform[k, v] * mass, -1
            for a in range(begin, end):
                p = worth[a - begin] / mass
                total[0, a] += p
                total[1, a] += p * p
                if left >= 0.0 and p > 0.0:
                    left -= worth[a - begin]
                    chosen = a if left < 0.0 or not f.none[v] else -1
            true[v] = chosen
            if chosen >= 0:
                for u in range(f.use[chosen], f.use[chosen + 1]):
                    state[f.factor[u]] += f.step[u]
        for i in range(len(watched)):
            seen[k, i] = true[watched[i, 0]] == watched[i, 1]
