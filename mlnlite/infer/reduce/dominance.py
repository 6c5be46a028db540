"""Drops values that another value of the same variable beats whatever the rest of the world is.

Comes in potentials, go out potentials over the same variables in which such values are forbidden, and the cells that
are left are shorter and fewer. At least one best world survives. (A pure literal is the special case of an atom that
only ever helps.) Goldstein, Efficient rotamer elimination (Biophysical Journal 1994), with bounds summed over cells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.reduce.conjunctions import Cells, starts_of, summed
from mlnlite.infer.reduce.counting import Chains
from mlnlite.infer.reduce.potentials import Potentials
from mlnlite.infer.reduce.propagate import propagate
from mlnlite.infer.reduce.settle import settled

_PASSES = 50
_LARGE = 100_000
_BITS = 62


def without_dominated(potentials: Potentials) -> Potentials:
    """Potentials with dominated values forbidden, equal cells merged."""
    reduced = settled(replace(potentials, cells=tuple(merged(c) for c in potentials.cells)))
    for _ in range(_PASSES):
        drop = dominated(reduced)
        if not drop.any() or np.isneginf(reduced.constant):
            return reduced
        few = np.count_nonzero(drop) < len(drop) / 20 and len(drop) > _LARGE
        flat = np.flatnonzero(drop)
        start = starts_of(reduced.cardinality)
        variable = np.searchsorted(start, flat, side="right") - 1
        value = (flat - start[variable]).astype(np.int32)[:, None]
        forbidden = Cells(variable.astype(np.int32)[:, None], value, np.full(len(flat), -np.inf))
        cells, constant = propagate([*reduced.cells, forbidden], reduced.cardinality, reduced.constant)
        reduced = settled(replace(reduced, cells=tuple(merged(c) for c in cells), constant=constant))
        if few:
            return reduced
    return reduced


def bounds(potentials: Potentials) -> tuple[Float, Float]:
    """The least and the most that each value can gain from its cells; shapes (total cardinality,)."""
    start, n = starts_of(potentials.cardinality), int(potentials.cardinality.sum())
    low, high = np.zeros(n), np.zeros(n)
    for c in potentials.cells:
        flat = start[c.scope] + c.value
        if c.scope.shape[1] == 1:
            own = np.bincount(flat[:, 0], c.amount, n)
            low += own
            high += own
            continue
        for column in flat.T:
            low += np.bincount(column, np.minimum(c.amount, 0.0), n)
            high += np.bincount(column, np.maximum(c.amount, 0.0), n)
    for chains in potentials.chains:
        _add_bounds(chains, start[chains.variable] + chains.value, low, high)
    return low, high


def _add_bounds(chains: Chains, flat: Int64, low: Float, high: Float) -> None:
    """Adds what a literal of a counting factor can do: a step from any count to a larger one, or back."""
    for rows, worth in chains.scaled():
        for i, step in enumerate(chains.steps.tolist()):
            allowed = np.isfinite(worth[step:]) | np.isfinite(worth[:-step])
            gain = worth[step:][allowed] - worth[:-step][allowed]
            least, most = (float(gain.min()), float(gain.max())) if len(gain) else (0.0, 0.0)
            for equal, down, up in ((True, least, most), (False, -most, -least)):
                at = flat[rows[chains.equal[rows, i] == equal], i]
                np.add.at(low, at, down if down < np.inf else 0.0)
                np.add.at(high, at, up if up > -np.inf else 0.0)


def dominated(potentials: Potentials) -> Bool:
    """Which values another value beats, or equals, in every world; shape (total cardinality,)."""
    low, high = bounds(potentials)
    start = starts_of(potentials.cardinality)
    if not len(start):
        return np.zeros(0, np.bool_)
    owner = np.repeat(np.arange(len(start)), potentials.cardinality)
    bar = np.maximum.reduceat(low, start)
    best = np.full(len(start), len(low))
    at = np.flatnonzero(low == bar[owner])
    np.minimum.at(best, owner[at], at)
    loses = (high <= bar[owner]) & np.isfinite(high)
    loses[best] = False
    return np.asarray(loses)


def merged(cells: Cells) -> Cells:
    """Equal cells made one, amounts that cancel left out."""
    k = cells.scope.shape[1]
    widths = [int(part.max(initial=0)).bit_length() for part in (cells.scope, cells.value)]
    columns = [
        (column, bits) for part, bits in zip((cells.scope, cells.value), widths, strict=True) for column in part.T
    ]
    if sum(bits for _, bits in columns) > _BITS:
        return _merged_by_columns(cells)
    key = np.zeros(len(cells.amount), np.int64)
    for column, bits in columns:
        key <<= bits
        key |= column
    found, total = summed(key, cells.amount)
    if found is key and (total != 0).all():
        return cells
    found, total = found[total != 0], total[total != 0]
    scope, value = np.empty((2, len(found), k), np.int32)
    for column, (_, bits) in zip([*value.T[::-1], *scope.T[::-1]], reversed(columns), strict=True):
        column[:] = found & ((1 << bits) - 1)
        found = found >> bits
    return Cells(scope, value, total)


def _merged_by_columns(cells: Cells) -> Cells:
    """The same for cells that one number does not tell apart."""
    order = np.lexsort((*cells.value.T[::-1], *cells.scope.T[::-1]))
    scope, value, amount = cells.scope[order], cells.value[order], cells.amount[order]
    new = np.ones(len(order), np.bool_)
    new[1:] = (scope[1:] != scope[:-1]).any(axis=1) | (value[1:] != value[:-1]).any(axis=1)
    first = np.flatnonzero(new)
    total = np.add.reduceat(amount, first)
    keep = total != 0
    return Cells(scope[first[keep]], value[first[keep]], total[keep])
