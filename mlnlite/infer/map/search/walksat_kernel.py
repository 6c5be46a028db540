"""Steps of MaxWalkSAT over variables of any number of values, compiled."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled
from mlnlite.infer.map.search.moves_kernel import count, enlist, enlist_counts, gain_of, shift


@compiled
def walk(start, begin, cell, first, literal, amount, counts, owner, missing, state, world, best, unpaid, place, last, n_unpaid, steps, noise, tabu, now, value, top, rng):  # type: ignore[no-untyped-def]  # fmt: skip  # noqa: ANN001, ANN201, E501, PLR0913
    """Steps: take what costs, at random, and change one of its variables so that it does not.

    A cell costs if it holds and its amount is negative, or fails to hold and its amount is positive; a counting factor
    if another count is worth more. Counting factors are numbered after the cells.

    Args:
        start: as in `Landscape`; likewise `begin`, `cell`, `amount`.
        begin: see there.
        cell: see there.
        first: shape (n + 1,), where the literals of each cell and counting factor start.
        literal: the values that they need, or that move their count.
        amount: see there.
        counts: see `Tallies.arrays`.
        owner: shape (total cardinality,), the variable of each value.
        missing: shape (n_cells,), literals of each cell that do not hold; kept up to date, like the next five.
        state: shape (n_counting_factors,).
        world: shape (n,).
        best: shape (n,), the best world so far.
        unpaid: shape (n,), what costs, `n_unpaid` of them.
        place: shape (n,), where each of them stands, -1 for the others.
        last: shape (n,), the step in which each variable was changed last.
        n_unpaid: how many cost.
        steps: how many to take.
        noise: how often to change any variable instead of the best one.
        tabu: for how many steps a variable rests.
        now: number of the first step.
        value: of `world`.
        top: value of `best`.
        rng: where chance comes from.

    Returns:
        `n_unpaid`, `value`, `top` after the steps.
    """
    n_cells = len(amount)
    for step in range(now, now + steps):
        if n_unpaid == 0:
            break
        c = unpaid[int(rng.random() * n_unpaid)]
        width = first[c + 1] - first[c]
        any_of_them = rng.random() < noise
        chosen = int(rng.random() * width)
        move_v, move_new, move_gain = -1, 0, -np.inf
        for k in range(width):
            if any_of_them and k != chosen:
                continue
            flat = literal[first[c] + k]
            v = owner[flat]
            own, size = flat - start[v], start[v + 1] - start[v]
            if c < n_cells and (world[v] == own) == (amount[c] > 0):
                continue
            for new in range(size):
                if new == world[v] or (world[v] != own and new != own):
                    continue
                gone, come = start[v] + world[v], start[v] + new
                gain = gain_of(begin, cell, amount, missing, gone, come) + count(counts, state, gone, come)
                count(counts, state, come, gone)
                rests = step - last[v] <= tabu and value + gain <= top
                if gain > move_gain and not rests:
                    move_v, move_new, move_gain = v, new, gain
        if move_v < 0:
            continue
        gone, come = start[move_v] + world[move_v], start[move_v] + move_new
        shift(begin, cell, missing, gone, come)
        count(counts, state, gone, come)
        for changed in (come, gone):
            n_unpaid = enlist(begin, cell, amount, missing, unpaid, place, n_unpaid, changed)
            n_unpaid = enlist_counts(counts, state, n_cells, unpaid, place, n_unpaid, changed)
        world[move_v], last[move_v] = move_new, step
        value += move_gain
        if value > top + 1e-9:
            top = value
            best[:] = world
    return n_unpaid, value, top
