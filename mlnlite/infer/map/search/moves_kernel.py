"""What it means for cells that a variable takes another value, compiled; for the searches of best worlds."""

from __future__ import annotations

from mlnlite.compiled import compiled


@compiled
def gain_of(begin, cell, amount, missing, gone, come):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """What the world gains when the literal `gone` ceases to hold and `come` holds; numbers of values as in `begin`."""
    gain = 0.0
    for i in range(begin[come], begin[come + 1]):
        if missing[cell[i]] == 1:
            gain += amount[cell[i]]
    for i in range(begin[gone], begin[gone + 1]):
        if missing[cell[i]] == 0:
            gain -= amount[cell[i]]
    return gain


@compiled
def shift(begin, cell, missing, gone, come):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Brings `missing` up to date after such a change."""
    for i in range(begin[come], begin[come + 1]):
        missing[cell[i]] -= 1
    for i in range(begin[gone], begin[gone + 1]):
        missing[cell[i]] += 1


@compiled
def enlist(begin, cell, amount, missing, unpaid, place, n_unpaid, literal):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Brings the list of cells that cost up to date for the cells of a literal; returns how many there are."""
    for i in range(begin[literal], begin[literal + 1]):
        d = cell[i]
        costs = (missing[d] == 0) == (amount[d] < 0)
        if costs and place[d] < 0:
            place[d] = n_unpaid
            unpaid[n_unpaid] = d
            n_unpaid += 1
        elif not costs and place[d] >= 0:
            n_unpaid -= 1
            moved = unpaid[n_unpaid]
            unpaid[place[d]] = moved
            place[moved] = place[d]
            place[d] = -1
    return n_unpaid
