"""Compiled: one variable of a slice gets a value, or loses it again."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.slice import Slice


@compiled
def assign(f: Factors, s: Slice, variable: int, atom: int, sign: int) -> bool:
    """Makes one atom of a variable true and its other atoms that are not fixed false.

    Args:
        f: the factors.
        s: the slice, whose `part` and `left` change.
        variable: which.
        atom: the true one; any other number for none.
        sign: 1 to do it, -1 to take it back.

    Returns:
        Whether all factors that it touches are allowed, as far as can be seen.
    """
    fits = True
    for a in range(f.first[variable], f.first[variable + 1]):
        if s.fixed[a] >= 0:
            continue
        for u in range(f.use[a], f.use[a + 1]):
            i, step = f.factor[u], f.step[u]
            true = step if a == atom else 0
            s.part[i] += sign * (true - step if step < 0 and f.counted[i] else true)
            s.left[i] -= sign * abs(step)
    if sign < 0:
        return fits
    for a in range(f.first[variable], f.first[variable + 1]):
        if s.fixed[a] >= 0:
            continue
        for u in range(f.use[a], f.use[a + 1]):
            i = f.factor[u]
            if s.least[i] == -np.inf:
                continue
            if s.left[i] == 0:
                fits = fits and f.value[f.row[i] + s.part[i]] >= s.least[i]
            elif f.counted[i]:
                fits = fits and s.part[i] <= s.high[i] and s.part[i] + s.left[i] >= s.low[i]
    return fits
