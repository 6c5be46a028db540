"""How many rows a plan will give, before it is run: cardinalities from sizes and distinct counts of stored columns.

The usual estimates of query optimisers (Selinger et al., Access path selection, SIGMOD 1979): values are uniform and
columns independent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from math import prod
from typing import assert_never

import numpy as np

from mlnlite.engines.plan import (
    AntiJoin,
    Compute,
    Count,
    Join,
    Lookup,
    One,
    Plan,
    Project,
    Scan,
    Tables,
    Union,
    Where,
)

SAMPLE = 1_000_000
"""Rows of a column whose values are counted."""

DENSEST = 1 << 24
"""Values that are told apart in counting them."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A relation that is not there yet.

    Attributes:
        rows: about how many.
        distinct: about how many different values each column has.
        widest: rows of the largest relation on the way to it.
    """

    rows: float
    distinct: Mapping[str, float]
    widest: float

    def resized(self, rows: float) -> Estimate:
        """The same columns with other rows: no column has more values than there are rows."""
        distinct = {c: min(d, max(rows, 1.0)) for c, d in self.distinct.items()}
        return Estimate(rows, distinct, max(self.widest, rows))

    def with_column(self, name: str) -> Estimate:
        """One more column, with a value of its own in each row."""
        return Estimate(self.rows, {**self.distinct, name: self.rows}, self.widest)


def estimate(plan: Plan, tables: Tables) -> Estimate:
    """The estimate for a plan."""

    @cache
    def n_distinct(table: str, column: int) -> float:
        values = tables[table][column]
        values = values[:: max(1, len(values) // SAMPLE)]
        low = int(values.min(initial=0))
        width = int(values.max(initial=0)) - low + 1
        seen = np.zeros(min(width, DENSEST), np.bool_)
        seen[values - low if width <= DENSEST else (values - low) % DENSEST] = True
        return float(np.count_nonzero(seen))

    return _estimate(plan, tables, n_distinct)


def _estimate(plan: Plan, tables: Tables, n_distinct: Callable[[str, int], float]) -> Estimate:
    def inside(source: Plan) -> Estimate:
        return _estimate(source, tables, n_distinct)

    match plan:
        case Scan():
            return _scan(plan, tables, n_distinct)
        case One():
            return Estimate(1.0, {}, 1.0)
        case Join(left, right):
            return _join(inside(left), inside(right))
        case AntiJoin(left, right):
            others = inside(right)
            return _antijoin(inside(left), others.rows, others.distinct)
        case Where(source, left_side, operator, right_side):
            below = inside(source)
            sides = [below.distinct.get(s, 1.0) for s in (left_side, right_side) if isinstance(s, str)]
            equal = 1.0 / max([1.0, *sides])
            return below.resized(below.rows * (equal if operator == "=" else 1.0 - equal))
        case Compute(source, name):
            return inside(source).with_column(name)
        case Lookup(source, table, key, name, _, dropped):
            n_dropped = 0 if dropped is None else int(np.count_nonzero(tables[table][-1] == dropped))
            below = inside(source)
            return _antijoin(below, n_dropped, [k for k in key if isinstance(k, str)]).with_column(name)
        case Project(source, columns):
            below = inside(source)
            return Estimate(below.rows, {c: below.distinct[c] for c in columns}, below.widest)
        case Union(sources):
            parts = [inside(s) for s in sources]
            rows = sum(p.rows for p in parts)
            return Estimate(rows, parts[0].distinct, max(rows, *(p.widest for p in parts))).resized(rows)
        case Count(source, by):
            below = inside(source)
            groups = min(below.rows, prod([below.distinct[c] for c in by]))
            return Estimate(groups, {**{c: below.distinct[c] for c in by}, "count": groups}, below.widest)
        case _:
            assert_never(plan)


def _scan(plan: Scan, tables: Tables, n_distinct: Callable[[str, int], float]) -> Estimate:
    stored = tables[plan.table]
    rows = float(len(stored[0])) if stored else 1.0
    rows = rows if plan.part is None else float(plan.part[1] - plan.part[0])
    distinct: dict[str, float] = {}
    for i, column in enumerate(plan.columns):
        if isinstance(column, int) or column in distinct:
            rows /= max(1.0, n_distinct(plan.table, i))
        elif column is not None:
            distinct[column] = n_distinct(plan.table, i)
    return Estimate(rows, distinct, rows).resized(rows)


def _join(left: Estimate, right: Estimate) -> Estimate:
    rows = left.rows * right.rows
    distinct = {**left.distinct, **right.distinct}
    for column in left.distinct.keys() & right.distinct.keys():
        a, b = left.distinct[column], right.distinct[column]
        rows /= max(a, b, 1.0)
        distinct[column] = min(a, b)
    return Estimate(rows, distinct, max(left.widest, right.widest)).resized(rows)


def _antijoin(left: Estimate, n_others: float, by: Iterable[str]) -> Estimate:
    possible = prod([left.distinct.get(c, 1.0) for c in by])
    hit = min(0.9, n_others / max(possible, 1.0))
    return left.resized(left.rows * (1.0 - hit))
