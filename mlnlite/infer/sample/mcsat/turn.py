"""Compiled: one variable of a slice gets another value, and factors are violated or mended by that."""

from __future__ import annotations

from mlnlite.compiled import compiled
from mlnlite.ground.network import Float, Int64
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.slice import Slice


@compiled
def turn(f: Factors, s: Slice, old: int, new: int, broken: Int64, place: Int64, n_broken: int) -> int:
    """Makes one atom of a variable false and another true.

    Args:
        f: the factors.
        s: the slice, whose `part` is the state of all factors, kept up to date.
        old: the true atom, negative for none.
        new: the one to be true, negative for none.
        broken: the violated factors, `n_broken` of them, kept up to date.
        place: shape (n_factors,), where each stands in `broken`, -1 for those that hold, kept up to date.
        n_broken: how many are violated.

    Returns:
        How many are violated now.
    """
    for a in (old, new):
        if a >= 0:
            for u in range(f.use[a], f.use[a + 1]):
                s.part[f.factor[u]] += f.step[u] if a == new else -f.step[u]
    for a in (old, new):
        for u in range(f.use[max(a, 0)], f.use[max(a, 0) + (a >= 0)]):
            i = f.factor[u]
            bad = f.value[f.row[i] + s.part[i]] < s.least[i]
            if bad and place[i] < 0:
                broken[n_broken], place[i] = i, n_broken
                n_broken += 1
            elif not bad and place[i] >= 0:
                n_broken -= 1
                last = broken[n_broken]
                broken[place[i]], place[last] = last, place[i]
                place[i] = -1
    return n_broken


@compiled
def value_of(f: Factors, s: Slice, variable: int, now: int, uniform: float) -> int:
    """Another value of a variable, each as likely.

    Args:
        f: the factors.
        s: the slice.
        variable: which; it has another value.
        now: its true atom, -1 for none.
        uniform: random number in [0, 1).

    Returns:
        Its new true atom, -1 for none.
    """
    n = -1 if not f.none[variable] else 0
    for a in range(f.first[variable], f.first[variable + 1]):
        n += s.fixed[a] < 0
    left = int(uniform * n)
    for a in range(f.first[variable], f.first[variable + 1]):
        if s.fixed[a] < 0 and a != now:
            if left == 0:
                return a
            left -= 1
    return -1


@compiled
def pull_of(f: Factors, s: Slice, variable: int, place: Int64, share: Float) -> float:
    """How often a violated factor picked at random, and an open atom of it, lead to a variable, times their number.

    Args:
        f: the factors.
        s: the slice.
        variable: which.
        place: shape (n_factors,), negative for factors that hold.
        share: shape (n_factors,), one over the number of open atoms of each.
    """
    pull = 0.0
    for a in range(f.first[variable], f.first[variable + 1]):
        if s.fixed[a] < 0:
            for u in range(f.use[a], f.use[a + 1]):
                if place[f.factor[u]] >= 0:
                    pull += share[f.factor[u]]
    return pull
