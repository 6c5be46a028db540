"""The engine in memory: plans run by NumPy, with joins through tables of places. Nothing to start, nothing to copy.

Constants are small numbers, so what a key matches stands in an array at the place of the key; only keys that are too
sparse for that are sorted. Columns keep their width: what is stored in 32 bits stays in 32 bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.keys import Dictionary, Packing, dictionary, packing_of
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
_Found = tuple[Column, int]

MOST_DICTIONARIES = 16
"""Dictionaries that are kept for other plans."""

MANY = 1000
"""How many times as many rows are worth a look at what they can match."""


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
        store = _Store(tables, self.most, {}, {})

        def run(plan: Plan) -> Relation:
            rows = _run(plan, store)
            return _Rows({c: rows.columns[c] for c in columns_of(plan)}, rows.n, rows.mask).whole().columns

        return run


@dataclass(frozen=True, slots=True)
class _Rows:
    """A relation: columns of integers of length `n`, of which the rows of a mask count; None for all."""

    columns: dict[str, Column]
    n: int
    mask: Bool | None = None

    def take(self, index: Int64 | None) -> _Rows:
        """Some of the rows; None for all."""
        if index is None:
            return self
        return _Rows({name: _taken(c, index) for name, c in self.columns.items()}, len(index))

    def keep(self, mask: Bool) -> _Rows:
        """The rows of a mask. As long as these are most, the others stay, for fewer copies."""
        mask = mask if self.mask is None else self.mask & mask
        n = np.count_nonzero(mask)
        if n == self.n:
            return self
        rows = _Rows(self.columns, self.n, mask)
        return rows if 2 * n > self.n else rows.whole()

    def with_column(self, name: str, values: Column) -> _Rows:
        """The same with one more column."""
        return _Rows({**self.columns, name: values}, self.n, self.mask)

    def whole(self) -> _Rows:
        """The same without other rows."""
        return self if self.mask is None else self.take(np.flatnonzero(self.mask))

    def values(self, names: Sequence[str]) -> list[Column]:
        """Some of the columns."""
        return [self.columns[name] for name in names]

    def value(self, side: str | int) -> Column:
        """A column, or a constant as one."""
        kind = np.int32 if isinstance(side, int) and abs(side) < 2**31 else np.int64
        return self.columns[side] if isinstance(side, str) else np.broadcast_to(kind(side), self.n)


def _taken(column: Column, index: Int64) -> Column:
    """The values at some places; `take` is faster, but copies the whole of a column that is not contiguous."""
    return column.take(index, mode="clip") if column.flags.c_contiguous else column[index]


@dataclass(frozen=True, slots=True)
class _Store:
    """The stored tables, how many rows a join may have, and what was found before.

    Parts of one plan look into the same relations, so dictionaries of these are made once for all of them, and plans
    for what a few facts touch look for the same few values of a column.
    """

    tables: Tables
    most: int | None
    dictionaries: dict[tuple[Plan, tuple[str, ...]], Dictionary]
    ranges: dict[tuple[int, int, int], tuple[Column, Int64]]

    def look_up(self, relation: Plan, by: tuple[str, ...], values: Column | None, others: list[Column]) -> _Found:
        """The numbers that a relation's rows with some columns have (None: 0), for other rows; and that of no row."""
        known = self.dictionaries.get((relation, by))
        if known is None:
            rows = _run(relation, self).whole()
            rows = _Rows({**rows.columns, "": np.zeros(rows.n, np.int8) if values is None else values}, rows.n)
            few = self.near(rows, by, others)
            known = dictionary([few.columns[c] for c in by], few.columns[""], len(others[0]))
            if few is rows:
                if len(self.dictionaries) >= MOST_DICTIONARIES:
                    self.dictionaries.clear()
                self.dictionaries[relation, by] = known
        return known.find(others), known.absent

    def near(self, rows: _Rows, by: Sequence[str], others: list[Column]) -> _Rows:
        """Rows without many that match none of others, if these are few: values are outside of their range."""
        if rows.n < MANY * max(len(others[0]), 1):
            return rows
        if not len(others[0]):
            return rows.take(np.empty(0, np.int64))
        *rest, (name, other) = zip(by, others, strict=True)  # the last column of a table is seldom all the same
        index = self.in_range(rows.columns[name], int(other.min()), int(other.max()))
        for name, other in rest:
            column = rows.columns[name][index]
            index = index[(column >= other.min()) & (column <= other.max())]
        return rows.take(index)

    def in_range(self, column: Column, low: int, high: int) -> Int64:
        """Where a column has values from `low` to `high`."""
        key = (id(column), low, high)
        if key not in self.ranges:
            if len(self.ranges) >= MOST_DICTIONARIES:
                self.ranges.clear()
            inside = column == low if low == high else (column >= low) & (column <= high)
            self.ranges[key] = column, np.flatnonzero(inside)  # the column is kept, so that its id stays its own
        return self.ranges[key][1]


def _run(plan: Plan, store: _Store) -> _Rows:
    match plan:
        case Scan():
            return _scan(plan, store.tables)
        case One():
            return _Rows({}, 1)
        case Join(left, right):
            return _join(_run(left, store).whole(), _run(right, store).whole(), store)
        case AntiJoin(left, right):
            return _antijoin(_run(left, store), right, store)
        case Where(source, left_side, operator, right_side):
            rows = _run(source, store)
            return rows.keep((rows.value(left_side) == rows.value(right_side)) == (operator == "="))
        case Compute():
            return _compute(plan, _run(plan.source, store))
        case Lookup():
            return _lookup(plan, _run(plan.source, store), store)
        case Project(source, kept):
            rows = _run(source, store)
            return _Rows({c: rows.columns[c] for c in kept}, rows.n, rows.mask)
        case Union(sources):
            return _union([_run(s, store).whole() for s in sources], columns_of(plan))
        case Count(source, by):
            return _count(_run(source, store).whole(), by)


def _scan(plan: Scan, tables: Tables) -> _Rows:
    stored: tuple[Column, ...] = tables[plan.table]
    if plan.part is not None:
        stored = tuple(np.ascontiguousarray(column[slice(*plan.part)]) for column in stored)
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
    parts = [c.astype(kind, copy=False) * kind(f) if f != 1 else c.astype(kind, copy=False) for c, f in terms]
    if plan.constant or not parts:
        parts.append(np.broadcast_to(kind(plan.constant), rows.n))
    return rows.with_column(plan.name, sum(parts[1:], start=parts[0]))


def _largest(column: Column) -> int:
    return max(int(column.max(initial=0)), -int(column.min(initial=0)))


# --- operators


def _shared(left: _Rows, right: _Rows) -> list[str]:
    return [c for c in right.columns if c in left.columns]


def _join(left: _Rows, right: _Rows, store: _Store) -> _Rows:
    shared, most = _shared(left, right), store.most
    if not shared:
        _verify(left.n * right.n, most)
        left_index = None if right.n == 1 else np.repeat(np.arange(left.n), right.n)
        return _paired(left, left_index, right, np.tile(np.arange(right.n), left.n))
    left, right = store.near(left, shared, right.values(shared)), store.near(right, shared, left.values(shared))
    sides = [left.values(shared), right.values(shared)]
    packing = packing_of(sides[1])
    stored, _ = packing.keys(sides[1])
    if right.n <= left.n or _rising(stored):
        index = _matches(sides[0], stored, packing, most)
        return _paired(left, index[0], right, index[1])
    packing = packing_of(sides[0])
    index = _matches(sides[1], packing.keys(sides[0])[0], packing, most)
    return _paired(right, index[0], left, index[1])


def _matches(others: list[Column], stored: Column, packing: Packing, most: int | None) -> tuple[Int64 | None, Int64]:
    """Pairs of other rows and rows of equal (stored) keys, as indices into both; None for each of the first once."""
    probe, strange = packing.keys(others)
    order = None if _rising(stored) else np.argsort(stored)
    if packing.dense(len(stored) + len(probe)):
        n_equal = np.bincount(stored, minlength=packing.size)
        start, many = (np.cumsum(n_equal) - n_equal)[probe], n_equal[probe]
    else:
        ordered = stored if order is None else stored[order]
        start = np.searchsorted(ordered, probe, "left")
        many = np.searchsorted(ordered, probe, "right") - start
    if strange is not None:
        many[strange] = 0
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


def _antijoin(left: _Rows, right: Plan, store: _Store) -> _Rows:
    shared = tuple(c for c in columns_of(right) if c in left.columns)
    if not shared:
        return left if _run(right, store).whole().n == 0 else left.take(np.empty(0, np.int64))
    found, absent = store.look_up(right, shared, None, [left.columns[c] for c in shared])
    return left.keep(found == absent)


def _lookup(plan: Lookup, rows: _Rows, store: _Store) -> _Rows:
    value = store.tables[plan.table][-1]
    if not len(value):
        return rows.with_column(plan.name, np.array(rows.value(plan.default)))
    if not plan.key:
        rows = rows.with_column(plan.name, np.full(rows.n, value[0]))
        return rows if plan.dropped is None else rows.keep(rows.columns[plan.name] != plan.dropped)
    key = tuple(f"k{i}" for i in range(len(plan.key)))
    found, absent = store.look_up(Scan(plan.table, (*key, None)), key, value, [rows.value(k) for k in plan.key])
    if plan.dropped is not None and plan.dropped != absent:
        rows = rows.with_column(plan.name, found).keep(found != plan.dropped)
        found = rows.columns[plan.name]
    return rows.with_column(plan.name, np.where(found == absent, rows.value(plan.default), found))


def _union(sources: list[_Rows], columns: tuple[str, ...]) -> _Rows:
    if not columns:
        return _Rows({}, int(any(s.n for s in sources)))
    every = {c: np.concatenate([s.columns[c] for s in sources]) for c in columns}
    packing = packing_of(list(every.values()))
    key, _ = packing.keys(list(every.values()))
    if not packing.exact:
        _, index = np.unique(key, return_index=True)
        return _Rows(every, len(key)).take(index)
    if packing.dense(len(key)):
        present = np.zeros(packing.size, np.bool_)
        present[key] = True
        key = np.flatnonzero(present)
    else:
        key = np.sort(key)  # np.unique, which hashes, is slower on long arrays
        key = key[np.append(True, key[1:] != key[:-1])] if len(key) else key
    return _Rows(dict(zip(columns, packing.columns(key), strict=True)), len(key))


def _count(rows: _Rows, by: tuple[str, ...]) -> _Rows:
    if not by:
        return _Rows({"count": np.array([rows.n], np.int64)}, 1)
    packing = packing_of([rows.columns[c] for c in by])
    key, _ = packing.keys([rows.columns[c] for c in by])
    if not packing.exact:
        _, index, count = np.unique(key, return_index=True, return_counts=True)
        return _Rows({**{c: rows.columns[c][index] for c in by}, "count": count}, len(index))
    if packing.dense(len(key)):
        every = np.bincount(key, minlength=packing.size)
        key = np.flatnonzero(every)
        count = every[key]
    else:
        key, count = np.unique(key, return_counts=True)
    return _Rows({**dict(zip(by, packing.columns(key), strict=True)), "count": count}, len(key))
