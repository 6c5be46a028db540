"""Compiled: one atom of a slice gets its value, and with it the others of its block that this decides."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Bool, Int32, Int64
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.slice import Slice


@compiled
def fix(f: Factors, s: Slice, owner: Int32, choices: Int32, atom: int, truth: bool, changed: Int64, waits: Bool) -> int:
    """Fixes an atom.

    Args:
        f: the factors.
        s: the slice.
        owner: shape (n_atoms,), variable of each atom.
        choices: shape (n_variables,), number of atoms that are not false, kept up to date.
        atom: which.
        truth: its value.
        changed: gets the counting factors that this touches and that are not waiting yet.
        waits: shape (n_factors,), which wait to be looked at, kept up to date.

    Returns:
        How many were put into `changed`.
    """
    v, n_changed = owner[atom], 0
    for a in range(f.first[v], f.first[v + 1]):
        if s.fixed[a] >= 0 or (a != atom and not truth and (f.none[v] or choices[v] > 2)):
            continue
        # another atom of the block is false next to a true one, and true if it is the last that is left
        s.fixed[a] = np.int32(truth if a == atom else not truth)
        for u in range(f.use[a], f.use[a + 1]):
            i = f.factor[u]
            s.left[i] -= abs(f.step[u])
            if not f.counted[i]:
                s.part[i] += f.step[u] * s.fixed[a]
            else:
                s.part[i] += abs(f.step[u]) * ((f.step[u] > 0) == (s.fixed[a] == 1))
                if s.least[i] > -np.inf and not waits[i]:
                    waits[i] = True
                    changed[n_changed] = i
                    n_changed += 1
    choices[v] -= not truth
    return n_changed
