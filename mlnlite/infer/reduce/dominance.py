"""Drops values that another value of the same variable beats whatever the rest of the world is.

Comes in potentials, go out potentials over the same variables in which such values are forbidden, and the cells that
are left are shorter and fewer. At least one best world survives. (A pure literal is the special case of an atom that
only ever helps.) Goldstein, Efficient rotamer elimination (Biophysical Journal 1994), with bounds summed over cells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.potentials import Potentials
from mlnlite.infer.reduce.propagate import propagate

_PASSES = 50
_LARGE = 100_000


def without_dominated(potentials: Potentials) -> Potentials:
    """Potentials with dominated values forbidden, equal cells merged."""
    reduced = replace(potentials, cells=tuple(merged(c) for c in potentials.cells))
    for _ in range(_PASSES):
        drop = dominated(reduced)
        if not drop.any() or np.isneginf(reduced.constant):
            return reduced
        few = np.count_nonzero(drop) < len(drop) / 20 and len(drop) > _LARGE
        flat = np.flatnonzero(drop)
        start = starts_of(reduced)
        variable = np.searchsorted(start, flat, side="right") - 1
        value = (flat - start[variable]).astype(np.int32)[:, None]
        forbidden = Cells(variable.astype(np.int32)[:, None], value, np.full(len(flat), -np.inf))
        cells, constant = propagate([*reduced.cells, forbidden], reduced.cardinality, reduced.constant)
        reduced = replace(reduced, cells=tuple(merged(c) for c in cells), constant=constant)
        if few:
            return reduced
    return reduced


def starts_of(potentials: Potentials) -> Int64:
    """Shape (n_variables,), where the values of each variable start in an array over all values."""
    return np.cumsum(potentials.cardinality, dtype=np.int64) - potentials.cardinality


def bounds(potentials: Potentials) -> tuple[Float, Float]:
    """The least and the most that each value can gain from its cells; shapes (total cardinality,)."""
    start, n = starts_of(potentials), int(potentials.cardinality.sum())
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
    return low, high


def dominated(potentials: Potentials) -> Bool:
    """Which values another value beats, or equals, in every world; shape (total cardinality,)."""
    low, high = bounds(potentials)
    start = starts_of(potentials)
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
    key = _key(cells)
    if key is not None and (np.diff(key) > 0).all() and (cells.amount != 0).all():
        return cells
    order = _lexical(cells) if key is None else np.argsort(key, kind="stable")
    scope, value, amount = cells.scope[order], cells.value[order], cells.amount[order]
    new = np.ones(len(order), np.bool_)
    new[1:] = (scope[1:] != scope[:-1]).any(axis=1) | (value[1:] != value[:-1]).any(axis=1)
    first = np.flatnonzero(new)
    total = np.add.reduceat(amount, first) if len(first) else amount
    keep = total != 0
    return Cells(scope[first[keep]], value[first[keep]], total[keep])


def _lexical(cells: Cells) -> Int64:
    """An order in which equal cells are neighbours."""
    return np.lexsort((*cells.value.T[::-1], *cells.scope.T[::-1]))


def _key(cells: Cells) -> Int64 | None:
    """A number for each cell, the same for equal ones only; None if that takes more than 62 bits."""
    n, k = int(cells.scope.max(initial=0)) + 1, int(cells.value.max(initial=0)) + 1
    if cells.scope.shape[1] * np.log2(float(n) * k) > 62:
        return None
    key = np.zeros(len(cells.amount), np.int64)
    for column, width in [*((c, n) for c in cells.scope.T), *((c, k) for c in cells.value.T)]:
        key *= width
        key += column
    return key
