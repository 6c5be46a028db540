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
def count(counts, state, gone, come):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """What counting factors gain by such a change, and brings their states up to date; see `Tallies.arrays`."""
    begin, factor, step, offset, table, _ = counts
    gain = 0.0
    for i in range(begin[gone], begin[gone + 1]):
        f = factor[i]
        gain -= table[offset[f] + state[f]]
        state[f] -= step[i]
        gain += table[offset[f] + state[f]]
    for i in range(begin[come], begin[come + 1]):
        f = factor[i]
        gain -= table[offset[f] + state[f]]
        state[f] += step[i]
        gain += table[offset[f] + state[f]]
    return gain


@compiled
def enlist_counts(counts, state, first, unpaid, place, n_unpaid, literal):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """As `enlist`, for the counting factors of a literal, whose numbers start at `first`."""
    begin, factor, _, offset, table, most = counts
    for i in range(begin[literal], begin[literal + 1]):
        f = factor[i]
        n_unpaid = put(table[offset[f] + state[f]] < most[f], first + f, unpaid, place, n_unpaid)
    return n_unpaid


@compiled
def put(costs, d, unpaid, place, n_unpaid):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Puts something on the list of what costs, or takes it off; returns how much there is."""
    if costs and place[d] < 0:
        place[d] = n_unpaid
        unpaid[n_unpaid] = d
        return n_unpaid + 1
    if not costs and place[d] >= 0:
        n_unpaid -= 1
        moved = unpaid[n_unpaid]
        unpaid[place[d]] = moved
        place[moved] = place[d]
        place[d] = -1
    return n_unpaid


@compiled
def enlist(begin, cell, amount, missing, unpaid, place, n_unpaid, literal):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Brings the list of cells that cost up to date for the cells of a literal; returns how many there are."""
    for i in range(begin[literal], begin[literal + 1]):
        d = cell[i]
        n_unpaid = put((missing[d] == 0) == (amount[d] < 0), d, unpaid, place, n_unpaid)
    return n_unpaid
