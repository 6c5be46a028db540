"""The reference engine: plans run by NumPy, sort-merge joins, no start-up cost. Best for small inputs."""

from __future__ import annotations

from functools import reduce

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

Int64 = NDArray[np.int64]


class NumpyEngine:
    """Runs plans on NumPy arrays."""

    def load(self, tables: Tables) -> Run:
        """What runs plans over these tables."""
        return lambda plan: _named(plan, _run(plan, tables))


def _named(plan: Plan, rows: dict[str, Int64]) -> Relation:
    return {c: rows[c].astype(np.int64, copy=False) for c in columns_of(plan)}


def _run(plan: Plan, tables: Tables) -> dict[str, Int64]:
    match plan:
        case Scan():
            return _scan(plan, tables)
        case One():
            return {"": np.zeros(1, np.int64)}
        case Join(left, right):
            return _join(_run(left, tables), _run(right, tables))
        case AntiJoin(left, right):
            return _antijoin(_run(left, tables), _run(right, tables))
        case Where(source, left_side, operator, right_side):
            rows = _run(source, tables)
            equal = _value(rows, left_side) == _value(rows, right_side)
            return _take(rows, np.flatnonzero(np.broadcast_to(equal == (operator == "="), _length(rows))))
        case Compute(source, name, terms, constant):
            rows = _run(source, tables)
            total = np.full(_length(rows), constant, np.int64)
            for column, factor in terms:
                total += rows[column] * np.int64(factor)
            return {**rows, name: total}
        case Lookup():
            return _lookup(plan, _run(plan.source, tables), tables)
        case Project(source, kept):
            rows = _run(source, tables)
            return {**{c: rows[c] for c in kept}, "": np.zeros(_length(rows), np.int64)}
        case Union(sources):
            return _union([_run(s, tables) for s in sources], columns_of(plan))
        case Count(source, by):
            return _count(_run(source, tables), by)


def _length(rows: dict[str, Int64]) -> int:
    return len(next(iter(rows.values())))


def _take(rows: dict[str, Int64], index: Int64) -> dict[str, Int64]:
    return {name: column[index] for name, column in rows.items()}


def _value(rows: dict[str, Int64], side: str | int) -> Int64 | int:
    return rows[side] if isinstance(side, str) else side


def _scan(plan: Scan, tables: Tables) -> dict[str, Int64]:
    stored = tables[plan.table]
    keep = np.ones(len(stored[0]) if stored else 1, bool)
    rows: dict[str, Int64] = {}
    for column, wanted in zip(stored, plan.columns, strict=True):
        if isinstance(wanted, int):
            keep &= column == wanted
        elif wanted in rows:
            keep &= column == rows[wanted]
        elif wanted is not None:
            rows[wanted] = column.astype(np.int64, copy=False)
    index = np.flatnonzero(keep)
    return {**_take(rows, index), "": np.zeros(len(index), np.int64)}


def _packed(*sides: list[Int64]) -> list[Int64]:
    """One integer for each row of each side, equal where all columns are equal."""
    packed = [np.zeros(len(side[0]), np.int64) for side in sides]
    size = 1
    for columns in zip(*sides, strict=True):
        low = min((int(c.min()) for c in columns if len(c)), default=0)
        width = max((int(c.max()) for c in columns if len(c)), default=0) - low + 1
        if size * width >= 2**62:
            _, dense = np.unique(np.concatenate(packed), return_inverse=True)
            packed = list(np.split(dense.astype(np.int64), np.cumsum([len(p) for p in packed])[:-1]))
            size = int(dense.max(initial=0)) + 1
        packed = [p * width + (c - low) for p, c in zip(packed, columns, strict=True)]
        size *= width
    return packed


def _shared(left: dict[str, Int64], right: dict[str, Int64]) -> list[str]:
    return [c for c in right if c and c in left]


def _join(left: dict[str, Int64], right: dict[str, Int64]) -> dict[str, Int64]:
    shared = _shared(left, right)
    if shared:
        left_key, right_key = _packed([left[c] for c in shared], [right[c] for c in shared])
    else:
        left_key, right_key = left[""], right[""]
    order = np.argsort(right_key, kind="stable")
    right_key = right_key[order]
    start = np.searchsorted(right_key, left_key, "left")
    many = np.searchsorted(right_key, left_key, "right") - start
    left_index = np.repeat(np.arange(len(left_key)), many)
    ends = np.cumsum(many)
    within = np.arange(len(left_index)) - np.repeat(ends - many, many)
    right_index = order[np.repeat(start, many) + within]
    new = {c: v for c, v in right.items() if c not in left}
    return {**_take(left, left_index), **_take(new, right_index)}


def _antijoin(left: dict[str, Int64], right: dict[str, Int64]) -> dict[str, Int64]:
    shared = _shared(left, right)
    if not shared:
        return left if _length(right) == 0 else _take(left, np.empty(0, np.int64))
    left_key, right_key = _packed([left[c] for c in shared], [right[c] for c in shared])
    return _take(left, np.flatnonzero(~np.isin(left_key, right_key)))


def _lookup(plan: Lookup, rows: dict[str, Int64], tables: Tables) -> dict[str, Int64]:
    *key_columns, value = tables[plan.table]
    length = _length(rows)
    found = np.array(np.broadcast_to(np.asarray(_value(rows, plan.default), np.int64), (length,)))
    if not len(value):
        return {**rows, plan.name: found}
    if not key_columns:
        return {**rows, plan.name: np.full(length, value[0], np.int64)}
    wanted = [np.broadcast_to(np.asarray(_value(rows, k), np.int64), (length,)) for k in plan.key]
    key, stored = _packed(wanted, [c.astype(np.int64, copy=False) for c in key_columns])
    order = np.argsort(stored)
    at = np.minimum(np.searchsorted(stored[order], key), len(stored) - 1)
    hit = stored[order][at] == key
    found[hit] = value[order][at][hit]
    return {**rows, plan.name: found}


def _union(sources: list[dict[str, Int64]], columns: tuple[str, ...]) -> dict[str, Int64]:
    if not columns:
        some = any(_length(s) for s in sources)
        return {"": np.zeros(int(some), np.int64)}
    rows = {c: np.concatenate([s[c] for s in sources]) for c in columns}
    (key,) = _packed([rows[c] for c in columns])
    _, index = np.unique(key, return_index=True)
    return {**_take(rows, index), "": np.zeros(len(index), np.int64)}


def _count(rows: dict[str, Int64], by: tuple[str, ...]) -> dict[str, Int64]:
    if not by:
        return {"count": np.array([_length(rows)], np.int64), "": np.zeros(1, np.int64)}
    (key,) = _packed([rows[c] for c in by])
    _, index, count = np.unique(key, return_index=True, return_counts=True)
    taken = _take({c: rows[c] for c in by}, index)
    return {**taken, "count": count.astype(np.int64), "": np.zeros(len(index), np.int64)}


def joined(plans: list[Plan]) -> Plan:
    """The join of plans from left to right."""
    return reduce(Join, plans) if plans else One()
