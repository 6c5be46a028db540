"""Compiled: unit propagation in a slice of MC-SAT."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.ground.network import Int32, Int64
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.mcsat.fix import fix
from mlnlite.infer.sample.mcsat.slice import Slice


@compiled
def propagate(f: Factors, s: Slice, owner: Int32, queue: Int64, n_queued: int) -> None:
    """Fixes all atoms that some factor forces, until nothing more follows.

    Args:
        f: the factors.
        s: as `cut` left it; atoms are fixed here.
        owner: shape (n_atoms,), variable of each atom.
        queue: the factors that force something, `n_queued` of them.
        n_queued: how many.
    """
    choices = f.first[1:] - f.first[:-1]
    changed = np.empty(len(f.row) + 1, np.int64)
    waits = np.zeros(len(f.row), np.bool_)
    while n_queued > 0:
        n_queued -= 1
        i = queue[n_queued]
        waits[i] = False
        if s.left[i] == 0 or (s.part[i] != s.high[i] and s.part[i] + s.left[i] != s.low[i]):
            continue
        literal = s.part[i] != s.high[i]
        for m in range(f.scope[i], f.scope[i + 1]):
            if s.fixed[f.member[m]] < 0:
                n_changed = fix(f, s, owner, choices, f.member[m], literal == (f.gain[m] > 0), changed, waits)
                for c in range(n_changed):
                    queue[n_queued] = changed[c]
                    n_queued += 1
