"""Compiled: a reversible walk inside one part of a slice that has too many worlds to list."""

from __future__ import annotations

from mlnlite.compiled import compiled
from mlnlite.ground.network import Float, Int32
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.assign import assign
from mlnlite.infer.sample.mcsat.slice import Slice


@compiled
def walk(f: Factors, s: Slice, order: Int32, uniform: Float, true: Int32) -> None:
    """Gives each variable of a part in turn a value, uniformly among those that the slice allows given all others.

    Args:
        f: the factors.
        s: the slice.
        order: shape (n,), the variables of the part.
        uniform: shape (n_variables,), random numbers in [0, 1).
        true: shape (n_variables,), the true atom of each variable or -1; changed here.
    """
    for v in order:
        assign(f, s, v, true[v], 1)
    for v in order:
        assign(f, s, v, true[v], -1)
        target, chosen = -1, true[v]
        for _ in range(2):  # once to count what fits, once to take the one that was drawn
            n_fit = 0
            for a in range(f.first[v] - 1, f.first[v + 1]):
                if (a < f.first[v] and not f.none[v]) or (a >= f.first[v] and s.fixed[a] >= 0):
                    continue
                if assign(f, s, v, a, 1):
                    chosen = a if n_fit == target else chosen
                    n_fit += 1
                assign(f, s, v, a, -1)
            target = min(int(uniform[v] * n_fit), n_fit - 1)
        true[v] = chosen if chosen >= f.first[v] else -1
        assign(f, s, v, true[v], 1)
