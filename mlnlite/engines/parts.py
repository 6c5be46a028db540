"""A plan as several, each over a part of the table that it starts from: rows come in chunks that fit into the cache."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import prod

from mlnlite.engines.forecast import estimate
from mlnlite.engines.plan import AntiJoin, Compute, Count, Join, Lookup, One, Plan, Project, Scan, Tables, Union, Where

CHUNK = 1 << 17
"""Rows of a part, about."""


def in_parts(plan: Plan, tables: Tables, chunk: int = CHUNK) -> list[Plan]:
    """Plans whose rows together are those of the given one; one plan only, if it is small or gives sums.

    Args:
        plan: any.
        tables: what it draws on.
        chunk: rows that each part should have, about.
    """
    start = _start(plan)
    if start is None or most_rows(plan, tables) <= 2 * chunk:
        return [plan]
    _, *others = _scans(plan)
    n_rows = _length(start, tables)
    widest = estimate(plan, tables).widest if others else n_rows
    n = min(n_rows, int(widest / chunk) + 1)
    if n < 2 or n * sum(_length(s, tables) for s in others) > 2 * widest:
        return [plan]
    ends = [n_rows * i // n for i in range(n + 1)]
    return [_starting_from(plan, replace(start, part=part)) for part in pairwise(ends)]


def most_rows(plan: Plan, tables: Tables) -> int:
    """A number of rows that no join of a plan can exceed."""
    return prod(max(_length(s, tables), 1) for s in _scans(plan))


def _length(scan: Scan, tables: Tables) -> int:
    stored = tables[scan.table]
    return len(stored[0]) if stored else 1


def _scans(plan: Plan) -> Iterator[Scan]:
    """The scans whose rows are joined, the one that the plan starts from first."""
    match plan:
        case Scan():
            yield plan
        case Join(left, right):
            yield from _scans(left)
            yield from _scans(right)
        case AntiJoin(left):
            yield from _scans(left)
        case Union(sources):
            for source in sources:
                yield from _scans(source)
        case Where(source) | Compute(source) | Project(source) | Count(source) | Lookup(source):
            yield from _scans(source)
        case One():
            return


def _start(plan: Plan) -> Scan | None:
    """The scan whose parts give the parts of the plan, if there is one."""
    match plan:
        case Scan():
            return plan
        case Join(source) | AntiJoin(source) | Where(source) | Compute(source) | Project(source) | Lookup(source):
            return _start(source)
        case _:
            return None


def _starting_from(plan: Plan, scan: Scan) -> Plan:
    match plan:
        case Join(source) | AntiJoin(source):
            return replace(plan, left=_starting_from(source, scan))
        case Where(source) | Compute(source) | Project(source) | Lookup(source):
            return replace(plan, source=_starting_from(source, scan))
        case _:
            return scan
