"""Sweeps of simulated annealing over variables of any number of values, compiled."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.infer.map.search.moves_kernel import count, gain_of, shift


@compiled
def sweeps(start, begin, cell, amount, counts, missing, state, world, best, temperatures, value, top, rng):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201, PLR0913
    """As many moves as there are variables at each temperature; returns the value of `world` and that of `best`.

    Args:
        start: as in `Landscape`; likewise `begin`, `cell`, `amount`.
        begin: see there.
        cell: see there.
        amount: see there.
        counts: see `Tallies.arrays`.
        missing: shape (n_cells,), literals of each cell that do not hold; kept up to date.
        state: shape (n_counting_factors,), likewise.
        world: shape (n,), changed in place.
        best: shape (n,), the best world so far.
        temperatures: shape (n_sweeps,).
        value: of `world`.
        top: value of `best`.
        rng: where chance comes from.
    """
    n = len(world)
    for temperature in temperatures:
        for _ in range(n):
            v = int(rng.random() * n)
            size = start[v + 1] - start[v]
            if size < 2:
                continue
            old = world[v]
            new = int(rng.random() * (size - 1))
            new += new >= old
            gone, come = start[v] + old, start[v] + new
            gain = gain_of(begin, cell, amount, missing, gone, come) + count(counts, state, gone, come)
            if gain < 0 and rng.random() >= np.exp(gain / temperature):
                count(counts, state, come, gone)
                continue
            shift(begin, cell, missing, gone, come)
            world[v] = new
            value += gain
        if value > top:
            top = value
            best[:] = world
    return value, top
