"""The engine in memory: plans run by NumPy, with joins through tables of places. Nothing to start, nothing to copy.

Constants are small numbers, so what a key matches stands in an array at the place of the key; only keys that are too
sparse for that are sorted. Columns keep their width: what is stored in 32 bits stays in 32 bits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import (
    AntiJoin,
    Compute,
    Count,
    Join,
    Lookup,
    One,
    Plan,
    Project,
    Relation,
    Run,
    Scan,
    Tables,
    Union,
    Where,
    columns_of,
)

Column = NDArray[Any]
Bool = NDArray[np.bool_]
Int64 = NDArray[np.int64]

DENSEST = 1 << 26
"""Places that an array for look-ups may have."""


class TooManyRowsError(Exception):
    """A join would have more rows than the engine is to hold."""


@dataclass(frozen=True, slots=True)
class NumpyEngine:
    """Runs plans on NumPy arrays.

    Attributes:
        most: rows of a join from which on it is refused with `TooManyRowsError`; None for any number.
    """

    most: int | None = None

    def load(self, tables: Tables) -> Run:
        """What runs plans over these tables."""

        def run(plan: Plan) -> Relation:
            rows = _run(plan, tables, self.most)
            return {c: rows.columns[c] for c in columns_of(plan)}

        return run


@dataclass(frozen=True, slots=True)
class _Rows:
    """A relation: columns of integers of length `n`."""

    columns: dict[str, Column]
    n: int

    def take(self, index: Int64 | None) -> _Rows:
        """Some of the rows; None for all."""
        if index is None:
            return self
        return _Rows({name: c[index] for name, c in self.columns.items()}, len(index))

    def keep(self, mask: Bool) -> _Rows:
        """The rows of a mask."""
        return self if mask.all() else self.take(np.flatnonzero(mask))

    def value(self, side: str | int) -> Column:
        """A column, or a constant as one."""
        kind = np.int32 if isinstance(side, int) and abs(side) < 2**31 else np.int64
        return self.columns[side] if isinstance(side, str) else np.broadcast_to(kind(side), self.n)


def _run(plan: Plan, tables: Tables, most: int | None) -> _Rows:
    match plan:
        case Scan():
            return _scan(plan, tables)
        case One():
            return _Rows({}, 1)
        case Join(left, right):
            return _join(_run(left, tables, most), _run(right, tables, most), most)
        case AntiJoin(left, right):
            return _antijoin(_run(left, tables, most), _run(right, tables, most))
        case Where(source, left_side, operator, right_side):
            rows = _run(source, tables, most)
            return rows.keep((rows.value(left_side) == rows.value(right_side)) == (operator == "="))
        case Compute():
            return _compute(plan, _run(plan.source, tables, most))
        case Lookup():
            return _lookup(plan, _run(plan.source, tables, most), tables)
        case Project(source, kept):
            rows = _run(source, tables, most)
            return _Rows({c: rows.columns[c] for c in kept}, rows.n)
        case Union(sources):
            return _union([_run(s, tables, most) for s in sources], columns_of(plan))
        case Count(source, by):
            return _count(_run(source, tables, most), by)


def _scan(plan: Scan, tables: Tables) -> _Rows:
    stored = tables[plan.table]
    if plan.part is not None:
        stored = tuple(column[slice(*plan.part)] for column in stored)
    keep: Bool | None = None
    columns: dict[str, Column] = {}
    for column, wanted in zip(stored, plan.columns, strict=True):
        if wanted is None:
            continue
        if isinstance(wanted, str) and wanted not in columns:
            columns[wanted] = column
            continue
        equal = column == (columns[wanted] if isinstance(wanted, str) else wanted)
        keep = equal if keep is None else keep & equal
    rows = _Rows(columns, len(stored[0]) if stored else 1)
    return rows if keep is None else rows.keep(keep)


def _compute(plan: Compute, rows: _Rows) -> _Rows:
    """In 32 bits, if the largest sum fits."""
    terms = [(rows.columns[column], factor) for column, factor in plan.terms]
    largest = abs(plan.constant) + sum(abs(factor) * _largest(column) for column, factor in terms)
    kind: Any = np.int32 if largest < 2**31 else np.int64
    total = np.full(rows.n, plan.constant, kind)
    for column, factor in terms:
        total += column.astype(kind, copy=False) * kind(factor)
    return _Rows({**rows.columns, plan.name: total}, rows.n)


def _largest(column: Column) -> int:
    return max(int(column.max(initial=0)), -int(column.min(initial=0)))


# --- keys


@dataclass(frozen=True, slots=True)
class _Keys:
    """Several columns as one integer, equal where all are: `(c1 - low1) * width2 + (c2 - low2)` and so on.

    Attributes:
        sides: the keys of each side.
        size: a bound of the keys.
        digits: lowest value and width of each column, if keys can be taken apart again.
    """

    sides: tuple[Column, ...]
    size: int
    digits: tuple[tuple[int, int], ...] | None

    @property
    def dense(self) -> bool:
        """Whether an array with a place for each key pays."""
        return self.size <= min(DENSEST, 8 * sum(map(len, self.sides)) + 4096)

    def columns(self, key: Column) -> list[Column]:
        """The columns that some keys stand for."""
        assert self.digits is not None
        found = []
        for low, width in reversed(self.digits):
            key, digit = np.divmod(key, width)
            found.append(digit + low)
        return found[::-1]


def _keys(*sides: list[Column]) -> _Keys:
    packed: list[Column] | None = None
    size, digits = 1, []
    exact = True
    for columns in zip(*sides, strict=True):
        low = min((int(c.min()) for c in columns if len(c)), default=0)
        width = max((int(c.max()) for c in columns if len(c)), default=0) - low + 1
        digits.append((low, width))
        if width == 1:
            continue
        if packed is None:
            packed = [c if low == 0 else c - low for c in columns]
        else:
            if size * width >= 2**62:
                _, ranks = np.unique(np.concatenate(packed), return_inverse=True)
                packed = list(np.split(ranks, np.cumsum([len(p) for p in packed])[:-1]))
                size, exact = int(ranks.max(initial=0)) + 1, False
            kind: Any = np.int32 if size * width < 2**31 else np.int64
            packed = [p.astype(kind) * kind(width) + (c - low) for p, c in zip(packed, columns, strict=True)]
        size *= width
    if packed is None:
        packed = [np.zeros(len(side[0]), np.int32) for side in sides]
    return _Keys(tuple(packed), size, tuple(digits) if exact else None)


# --- operators


def _shared(left: _Rows, right: _Rows) -> list[str]:
    return [c for c in right.columns if c in left.columns]


def _join(left: _Rows, right: _Rows, most: int | None) -> _Rows:
    shared = _shared(left, right)
    if not shared:
        _verify(left.n * right.n, most)
        left_index = None if right.n == 1 else np.repeat(np.arange(left.n), right.n)
        return _paired(left, left_index, right, np.tile(np.arange(right.n), left.n))
    keys = _keys([left.columns[c] for c in shared], [right.columns[c] for c in shared])
    left_key, right_key = keys.sides
    if len(right_key) > len(left_key) and not _rising(right_key):
        index = _matches(right_key, left_key, keys, most)
        return _paired(right, index[0], left, index[1])
    index = _matches(left_key, right_key, keys, most)
    return _paired(left, index[0], right, index[1])


def _matches(probe: Column, stored: Column, keys: _Keys, most: int | None) -> tuple[Int64 | None, Int64]:
    """All pairs of equal keys, as indices into both; None for each of the first once."""
    order = None if _rising(stored) else np.argsort(stored)
    if keys.dense:
        n_equal = np.bincount(stored, minlength=keys.size)
        start, many = (np.cumsum(n_equal) - n_equal)[probe], n_equal[probe]
    else:
        ordered = stored if order is None else stored[order]
        start = np.searchsorted(ordered, probe, "left")
        many = np.searchsorted(ordered, probe, "right") - start
    total = int(many.sum())
    _verify(total, most)
    first: Int64 | None
    if many.max(initial=0) <= 1:
        first = None if total == len(many) else np.flatnonzero(many)
        second = start if first is None else start[first]
    else:
        first = np.repeat(np.arange(len(many)), many)
        second = np.arange(total) - np.repeat(np.cumsum(many) - many - start, many)
    return first, second if order is None else order[second]


def _rising(key: Column) -> bool:
    return bool((key[1:] >= key[:-1]).all())


def _verify(n_rows: int, most: int | None) -> None:
    if most is not None and n_rows > most:
        raise TooManyRowsError(f"a join has {n_rows:,} rows")


def _paired(left: _Rows, left_index: Int64 | None, right: _Rows, right_index: Int64) -> _Rows:
    """Rows side by side; columns that both have come from the left."""
    others = _Rows({c: v for c, v in right.columns.items() if c not in left.columns}, right.n)
    return _Rows({**left.take(left_index).columns, **others.take(right_index).columns}, len(right_index))


def _antijoin(left: _Rows, right: _Rows) -> _Rows:
    shared = _shared(left, right)
    if not shared:
        return left if right.n == 0 else left.take(np.empty(0, np.int64))
    keys = _keys([left.columns[c] for c in shared], [right.columns[c] for c in shared])
    left_key, right_key = keys.sides
    if not keys.dense:
        return left.keep(~np.isin(left_key, right_key))
    absent = np.ones(keys.size, np.bool_)
    absent[right_key] = False
    return left.keep(absent[left_key])


def _lookup(plan: Lookup, rows: _Rows, tables: Tables) -> _Rows:
    *stored, value = tables[plan.table]
    default = rows.value(plan.default)
    if not len(value):
        return _Rows({**rows.columns, plan.name: np.array(default)}, rows.n)
    if not stored:
        return _Rows({**rows.columns, plan.name: np.full(rows.n, value[0])}, rows.n)
    key = _keys([rows.value(k) for k in plan.key], list(stored))
    wanted, given = key.sides
    if key.dense:
        place = np.full(key.size, -1, np.int32)
        place[given] = np.arange(len(given), dtype=np.int32)
        at: Column = place[wanted]
        hit = np.flatnonzero(at >= 0)
    else:
        order = np.argsort(given)
        at = order[np.minimum(np.searchsorted(given, wanted, sorter=order), len(given) - 1)]
        hit = np.flatnonzero(given[at] == wanted)
    found = np.array(default, np.result_type(default, value))
    found[hit] = value[at[hit]]
    return _Rows({**rows.columns, plan.name: found}, rows.n)


def _union(sources: list[_Rows], columns: tuple[str, ...]) -> _Rows:
    if not columns:
        return _Rows({}, int(any(s.n for s in sources)))
    keys = _keys([np.concatenate([s.columns[c] for s in sources]) for c in columns])
    (key,) = keys.sides
    if keys.digits is None:
        _, index = np.unique(key, return_index=True)
        every = {c: np.concatenate([s.columns[c] for s in sources]) for c in columns}
        return _Rows(every, len(key)).take(index)
    if keys.dense:
        present = np.zeros(keys.size, np.bool_)
        present[key] = True
        key = np.flatnonzero(present)
    else:
        key = np.sort(key)  # np.unique, which hashes, is slower on long arrays
        key = key[np.append(True, key[1:] != key[:-1])] if len(key) else key
    return _Rows(dict(zip(columns, keys.columns(key), strict=True)), len(key))


def _count(rows: _Rows, by: tuple[str, ...]) -> _Rows:
    if not by:
        return _Rows({"count": np.array([rows.n], np.int64)}, 1)
    keys = _keys([rows.columns[c] for c in by])
    (key,) = keys.sides
    if keys.digits is None:
        _, index, count = np.unique(key, return_index=True, return_counts=True)
        return _Rows({**{c: rows.columns[c][index] for c in by}, "count": count}, len(index))
    if keys.dense:
        every = np.bincount(key, minlength=keys.size)
        key = np.flatnonzero(every)
        count = every[key]
    else:
        key, count = np.unique(key, return_counts=True)
    return _Rows({**dict(zip(by, keys.columns(key), strict=True)), "count": count}, len(key))
