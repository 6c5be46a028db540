"""Relational plans: what to compute over tables of integers, without saying how. An engine runs them.

Rows are bindings of named columns. Two columns of one name in a join are equal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

Column: TypeAlias = NDArray[np.int64] | NDArray[np.int32] | NDArray[np.int8]
Relation: TypeAlias = Mapping[str, NDArray[Any]]
"""Columns of integers of equal length, by name."""

Tables: TypeAlias = Mapping[str, tuple[Column, ...]]
"""Stored tables: columns by position."""


@dataclass(frozen=True, slots=True)
class Scan:
    """Rows of a stored table.

    Each entry of `columns` names a column (twice the same name: equal), is a number that the column must have, or None
    for a column that does not matter. `part` chooses a range of the table's rows, in the table's own order.
    """

    table: str
    columns: tuple[str | int | None, ...]
    part: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class One:
    """The relation with one row and no column."""


@dataclass(frozen=True, slots=True)
class Join:
    """Pairs of rows that agree on the columns both have."""

    left: Plan
    right: Plan


@dataclass(frozen=True, slots=True)
class AntiJoin:
    """Rows of `left` that agree with no row of `right` on the columns of `right`."""

    left: Plan
    right: Plan


@dataclass(frozen=True, slots=True)
class Where:
    """Rows in which two columns, or a column and a number, are equal or differ."""

    source: Plan
    left: str | int
    operator: Literal["=", "!="]
    right: str | int


@dataclass(frozen=True, slots=True)
class Compute:
    """Adds the column `name = constant + sum(factor * column)`."""

    source: Plan
    name: str
    terms: tuple[tuple[str, int], ...]
    constant: int = 0


@dataclass(frozen=True, slots=True)
class Lookup:
    """Adds a column `name` from a stored table.

    It is the last column of the table's row whose first columns are those of `key` (column names or numbers), or
    `default` (a number, or another column) where there is no such row. The key is unique in the table. Rows whose
    value in the table is `dropped` go.
    """

    source: Plan
    table: str
    key: tuple[str | int, ...]
    name: str
    default: int | str
    dropped: int | None = None


@dataclass(frozen=True, slots=True)
class Project:
    """Keeps some columns, and every row."""

    source: Plan
    columns: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Union:
    """Rows of any of the sources, each once. All have the same columns."""

    sources: tuple[Plan, ...]


@dataclass(frozen=True, slots=True)
class Count:
    """For each binding of the columns `by`, their number of rows as column `count`."""

    source: Plan
    by: tuple[str, ...]


Plan: TypeAlias = Scan | One | Join | AntiJoin | Where | Compute | Lookup | Project | Union | Count


def columns_of(plan: Plan) -> tuple[str, ...]:
    """Names of the columns that a plan gives, in order.

    >>> columns_of(Join(Scan("r", ("x", "y")), Scan("s", ("y", 3, "z"))))
    ('x', 'y', 'z')
    """
    match plan:
        case Scan(columns=scanned):
            return tuple(dict.fromkeys(c for c in scanned if isinstance(c, str)))
        case One():
            return ()
        case Join(left, right):
            return tuple(dict.fromkeys(columns_of(left) + columns_of(right)))
        case AntiJoin(left, _):
            return columns_of(left)
        case Where(source):
            return columns_of(source)
        case Compute(source, name) | Lookup(source, name=name):
            return (*columns_of(source), name)
        case Project(_, columns):
            return columns
        case Union(sources):
            return columns_of(sources[0])
        case Count(_, by):
            return (*by, "count")


Run: TypeAlias = Callable[[Plan], Relation]
"""Gives all rows of a plan as columns of signed integers, in any order."""


class Engine(Protocol):
    """Runs plans."""

    def load(self, tables: Tables) -> Run:
        """What runs plans over these tables."""
        ...
