"""Tables of log-potentials: comes in which cells belong to which scope, goes out one dense table per scope.

Scopes of equal shape are filled together. A cell is entered once, at the place where all variables that it leaves free
have their base value; sums along each axis then carry it to the rest of the table (a zeta transform), so the cost is
that of the tables however many cells there are. A few cells in a large table are added to slices of it instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64

_SLICE_OVERHEAD = 2000
_STRIDED = 3
_SHORT = 32
_ONE_THREAD = 1 << 17


@dataclass(frozen=True, slots=True)
class Placed:
    """Cells of equal arity, placed in tables of one shape.

    Attributes:
        table: shape (n,), which of the tables.
        axis: shape (n, k).
        value: shape (n, k).
        amount: shape (n,).
    """

    table: Int64
    axis: Int64
    value: Int64
    amount: Float


def fill(n_tables: int, shape: Sequence[int], cells: Sequence[Placed]) -> Float:
    """Tables of the sums of their cells.

    Args:
        n_tables: how many.
        shape: of each of them.
        cells: what to add up.

    Returns:
        Shape (n_tables, *shape).
    """
    shape = (n_tables, *shape)
    soft = [part for c in cells if len((part := _pick(c, np.isfinite(c.amount))).amount)]
    hard = [part for c in cells if len((part := _pick(c, ~np.isfinite(c.amount))).amount)]
    tables = _total(shape, soft)
    if hard and _slices_are_cheaper(shape, hard):
        for c in hard:
            _add_slices(tables, c)
    elif hard:
        counts = [Placed(c.table, c.axis, c.value, np.ones(len(c.table))) for c in hard]
        tables += np.where(_on_used_axes(shape, counts) > 0.5, -np.inf, 0.0)
    return tables


def _total(shape: tuple[int, ...], cells: Sequence[Placed]) -> Float:
    """Sums of cells with finite amounts."""
    if cells and not _slices_are_cheaper(shape, cells):
        sums = _on_used_axes(shape, cells)
        return sums if sums.shape == shape else sums + np.zeros(shape)
    tables = np.zeros(shape)
    for c in cells:
        _add_slices(tables, c)
    return tables


def _pick(cells: Placed, which: Bool) -> Placed:
    """Some of the cells."""
    return Placed(cells.table[which], cells.axis[which], cells.value[which], cells.amount[which])


def _slices_are_cheaper(shape: tuple[int, ...], cells: Sequence[Placed]) -> bool:
    """Whether adding each cell to its slice beats sums along all axes."""
    sizes = np.array(shape[1:], float)
    size = float(np.prod(sizes))
    touched = sum(
        _STRIDED * float(np.sum(size / np.prod(sizes[c.axis], axis=1))) + _SLICE_OVERHEAD * len(c.table) for c in cells
    )
    return touched < len(sizes) * (shape[0] * size + _SLICE_OVERHEAD)


def _add_slices(tables: Float, cells: Placed) -> None:
    """Adds each cell to the part of its table that agrees with it."""
    n_axes = tables.ndim - 1
    rows = zip(cells.table.tolist(), cells.axis.tolist(), cells.value.tolist(), cells.amount.tolist(), strict=True)
    for table, axes, values, amount in rows:
        index: list[int | slice] = [table] + [slice(None)] * n_axes
        for axis, value in zip(axes, values, strict=True):
            index[axis + 1] = value
        tables[tuple(index)] += amount


def _on_used_axes(shape: Sequence[int], cells: Sequence[Placed]) -> Float:
    """Sums of cells, with one entry along the axes that none of them asks about."""
    used = np.unique(np.concatenate([c.axis.ravel() for c in cells]))
    small = np.ones(len(shape) - 1, np.int64)
    small[used] = np.array(shape[1:], np.int64)[used]
    number = np.cumsum(np.isin(np.arange(len(small)), used)) - 1
    compact = [Placed(c.table, number[c.axis], c.value, c.amount) for c in cells]
    return _sums(shape[0], small[used], compact).reshape(shape[0], *small.tolist())


def _sums(n_tables: int, sizes: Int64, cells: Sequence[Placed]) -> Float:
    """Tables by sums along all axes, flat."""
    size = int(np.prod(sizes))
    stride = size // np.cumprod(sizes)
    base = _base_values(sizes, cells)
    entries = [_entries(c, sizes, stride, base) for c in cells]
    place, amount = (np.concatenate(part) for part in zip(*entries, strict=True))
    flat = np.asarray(np.bincount(place + int(base @ stride), amount, minlength=n_tables * size), np.float64)
    head = n_tables == 1 and len(sizes) > 1
    for slab in flat.reshape(sizes[0], -1) if head else [flat]:
        if slab.any():  # most often empty where a variable that is about to be eliminated has its base value
            _spread(slab, sizes[head:], base[head:])
    if head:
        _spread_axis(flat.reshape(1, sizes[0], -1), int(base[0]))
    return flat


def _spread(flat: Float, sizes: Int64, base: Int64) -> None:
    """Sums along all axes of tables of the given sizes, in place; along the last few axes as a matrix product."""
    stride = int(np.prod(sizes)) // np.cumprod(sizes)
    short = stride * sizes <= _SHORT
    for axis in np.flatnonzero(~short).tolist():
        _spread_axis(flat.reshape(-1, sizes[axis], stride[axis]), int(base[axis]))
    if short.any():
        tail = int(np.prod(sizes[short]))
        matrix = np.eye(tail)
        for axis in np.flatnonzero(short).tolist():
            _spread_axis(matrix.reshape(-1, sizes[axis], stride[axis]), int(base[axis]))
        rows = flat.reshape(-1, tail)
        block = max(1, _ONE_THREAD // tail**2)  # matrix products so small that no library starts threads for them
        for begin in range(0, len(rows), block):
            rows[begin : begin + block] = rows[begin : begin + block] @ matrix


def _spread_axis(view: Float, base: int) -> None:
    """Adds what stands at the base value of the middle axis to its other values."""
    for value in range(view.shape[1]):
        if value != base:
            view[:, value] += view[:, base]


def _base_values(sizes: Int64, cells: Sequence[Placed]) -> Int64:
    """For each axis the value that the fewest cells ask for."""
    widest = int(sizes.max(initial=1))
    asked = np.zeros(len(sizes) * widest)
    for c in cells:
        asked += np.bincount((c.axis * widest + c.value).ravel(), minlength=len(asked))
    table = asked.reshape(len(sizes), widest)
    table[np.arange(widest) >= sizes[:, None]] = np.inf
    return np.asarray(table.argmin(axis=1))


def _entries(cells: Placed, sizes: Int64, stride: Int64, base: Int64) -> tuple[Int64, Float]:
    """Where to enter which amounts so that sums along the axes spread each cell as it should be.

    A condition "has its base value" is entered as "anywhere" minus each of the other values.
    """
    row, place, amount = np.arange(len(cells.table)), cells.table * int(np.prod(sizes)), cells.amount
    for c in range(cells.axis.shape[1]):
        axis, value = cells.axis[row, c], cells.value[row, c]
        place = place + (value - base[axis]) * stride[axis]
        at_base = np.flatnonzero(value == base[axis])
        rows, places, amounts = [row], [place], [amount]
        for other in range(int(sizes[axis[at_base]].max(initial=0))):
            use = at_base[(base[axis[at_base]] != other) & (sizes[axis[at_base]] > other)]
            rows.append(row[use])
            places.append(place[use] + (other - base[axis[use]]) * stride[axis[use]])
            amounts.append(-amount[use])
        row, place, amount = np.concatenate(rows), np.concatenate(places), np.concatenate(amounts)
    return place, amount
