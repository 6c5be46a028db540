"""The meaning of plans, row by row: rows are dictionaries, joins are nested loops. For tests only."""

from __future__ import annotations

from collections import Counter

import numpy as np

from mlnlite.engines.plan import (
    AntiJoin,
    Compute,
    Count,
    Join,
    Lookup,
    One,
    Project,
    Scan,
    Union,
    Where,
    columns_of,
)


class ReferenceEngine:
    """Runs plans without any thought of speed."""

    def load(self, tables):
        stored = {name: [tuple(map(int, row)) for row in _rows(columns)] for name, columns in tables.items()}

        def run(plan):
            rows = run_plan(plan, stored)
            return {c: np.array([row[c] for row in rows], np.int64) for c in columns_of(plan)}

        return run


def _rows(columns):
    return zip(*(c.tolist() for c in columns), strict=True) if columns else [()]


def run_plan(plan, stored):
    """The rows of a plan."""
    match plan:
        case Scan(table, columns, part):
            rows = stored[table][slice(*part)] if part else stored[table]
            return [bound for row in rows if (bound := _bound(columns, row)) is not None]
        case One():
            return [{}]
        case Join(left, right):
            others = run_plan(right, stored)
            return [{**a, **b} for a in run_plan(left, stored) for b in others if _agree(a, b)]
        case AntiJoin(left, right):
            others = run_plan(right, stored)
            return [a for a in run_plan(left, stored) if not any(_agree(a, b) for b in others)]
        case Where(source, left, operator, right):
            rows = run_plan(source, stored)
            return [r for r in rows if (_value(r, left) == _value(r, right)) == (operator == "=")]
        case Compute(source, name, terms, constant):
            rows = run_plan(source, stored)
            return [{**r, name: constant + sum(factor * r[c] for c, factor in terms)} for r in rows]
        case Lookup(source, table, key, name, default, dropped):
            known = {row[:-1]: row[-1] for row in stored[table]}
            found = [(r, known.get(tuple(_value(r, k) for k in key))) for r in run_plan(source, stored)]
            return [
                {**r, name: _value(r, default) if value is None else value}
                for r, value in found
                if value is None or value != dropped
            ]
        case Project(source, columns):
            return [{c: r[c] for c in columns} for r in run_plan(source, stored)]
        case Union(sources):
            every = {tuple(sorted(r.items())) for s in sources for r in run_plan(s, stored)}
            return [dict(r) for r in sorted(every)]
        case Count(source, by):
            counts = Counter(tuple(r[c] for c in by) for r in run_plan(source, stored))
            counts = counts if by else {(): counts[()]}
            return [{**dict(zip(by, key, strict=True)), "count": n} for key, n in sorted(counts.items())]


def _bound(columns, row):
    """What a row binds, or None if it does not fit."""
    found = {}
    for wanted, value in zip(columns, row, strict=True):
        if isinstance(wanted, int) and wanted != value:
            return None
        if isinstance(wanted, str) and found.setdefault(wanted, value) != value:
            return None
    return found


def _agree(a, b):
    return all(a[c] == b[c] for c in a.keys() & b.keys())


def _value(row, side):
    return row[side] if isinstance(side, str) else side
