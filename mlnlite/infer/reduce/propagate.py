"""Draws what hard formulas force: comes in cells, goes out an equal sum of cells with fewer and shorter ones.

A forbidden cell of which all literals but one hold in every world forbids the value of that one (unit propagation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlnlite.ground.network import Bool, Int32, Int64
from mlnlite.infer.reduce.conjunctions import Cells, gather, starts_of

_PASSES = 100


@dataclass(frozen=True, slots=True)
class _Known:
    """What is known of the variables.

    Attributes:
        start: shape (n_variables,), where the values of each start in `forbidden`.
        forbidden: shape (total cardinality,).
        fixed: shape (n_variables,), whether one value is left.
    """

    start: Int64
    forbidden: Bool
    fixed: Bool


def propagate(cells: Sequence[Cells], cardinality: Int32, constant: float) -> tuple[tuple[Cells, ...], float]:
    """Unit propagation.

    Args:
        cells: of any arities, in any order.
        cardinality: shape (n_variables,).
        constant: what every world gains.

    Returns:
        Cells, at most one for each arity, arity rising, and the new constant (minus infinity: no world is possible).
    """
    grouped = joined(cells)
    hard = [_pick(c, np.isneginf(c.amount)) for c in grouped]
    start = starts_of(cardinality)
    forbidden = np.zeros(int(cardinality.sum()), np.bool_)
    for _ in range(_PASSES):
        known = _Known(start, forbidden, _fixed(forbidden, cardinality, start))
        units = [u for c in hard for u in _units(c, known)]
        if forbidden[units].all():
            break
        forbidden[units] = True
    known = _Known(start, forbidden, _fixed(forbidden, cardinality, start))
    if not forbidden.any():
        return grouped, constant
    shorter: list[Cells] = [_as_cells(known)]
    for c in grouped:
        add, gain = _shortened(c, known)
        shorter, constant = [*shorter, *add], constant + gain
    return joined(shorter), constant


def _fixed(forbidden: Bool, cardinality: Int32, start: Int64) -> Bool:
    """Which variables have one value left."""
    left = np.add.reduceat(~forbidden, start, dtype=np.int64) if len(start) else np.zeros(0, np.int64)
    return np.asarray(left == 1)


def _units(cells: Cells, known: _Known) -> Int64:
    """Values that forbidden cells forbid by themselves."""
    flat = known.start[cells.scope] + cells.value
    impossible = known.forbidden[flat]
    open_ = ~known.fixed[cells.scope]
    rows = ~impossible.any(axis=1) & (open_.sum(axis=1) == 1)
    return np.asarray(flat[rows][open_[rows]])


def _as_cells(known: _Known) -> Cells:
    """A forbidden cell for each forbidden value."""
    flat = np.flatnonzero(known.forbidden)
    variable = np.searchsorted(known.start, flat, side="right") - 1
    value = flat - known.start[variable]
    scope = variable.astype(np.int32)[:, None]
    return Cells(scope, value.astype(np.int32)[:, None], np.full(len(flat), -np.inf))


def _shortened(cells: Cells, known: _Known) -> tuple[list[Cells], float]:
    """Cells that can still hold, without the literals that always do."""
    flat = known.start[cells.scope] + cells.value
    alive = ~known.forbidden[flat].any(axis=1)
    shorter = known.fixed[cells.scope].any(axis=1)
    same, rows = _pick(cells, alive & ~shorter), np.flatnonzero(alive & shorter)
    scope = np.where(known.fixed[cells.scope[rows]], -1, cells.scope[rows])
    found, gain = gather(scope.astype(np.int32), cells.value[rows], cells.amount[rows])
    return [c for c in (same, *found) if len(c.amount)], gain


def _pick(cells: Cells, which: Bool) -> Cells:
    """Some of the cells."""
    return Cells(cells.scope[which], cells.value[which], cells.amount[which])


def joined(cells: Sequence[Cells]) -> tuple[Cells, ...]:
    """Cells of equal arity joined."""
    found = []
    for k in sorted({c.scope.shape[1] for c in cells}):
        same = [c for c in cells if c.scope.shape[1] == k]
        fields = zip(*((c.scope, c.value, c.amount) for c in same), strict=True)
        found.append(Cells(*(np.concatenate(f) for f in fields)))
    return tuple(found)
