"""The rows that were added to a program, and the columns for what soft clauses cost; rows that are slack can go."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.map.cuts.separation import GroundClauses, Stars
from mlnlite.infer.map.ilp import Program

_SLACK = 1e-3


@dataclass(slots=True)
class Rows:
    """Rows `sum value * x[column] <= limit`; columns from `first` on say how far a soft clause is violated.

    Attributes:
        first: number of the first of these columns.
        start: shape (n + 1,), where each row starts.
        column: shape (m,).
        value: shape (m,).
        limit: shape (n,).
        cost: shape (n_soft,), of those columns.
        paid: the column of each soft clause that has one.
        clauses: those of which a row was made, or that a star needs.
    """

    first: int
    start: Int64 = field(default_factory=lambda: np.zeros(1, np.int64))
    column: Int64 = field(default_factory=lambda: np.zeros(0, np.int64))
    value: Float = field(default_factory=lambda: np.zeros(0))
    limit: Float = field(default_factory=lambda: np.zeros(0))
    cost: list[float] = field(default_factory=list)
    paid: dict[bytes, int] = field(default_factory=dict)
    clauses: set[bytes] = field(default_factory=set)
    n_groundings: int = 0

    def __len__(self) -> int:
        """How many."""
        return len(self.limit)


def names_of(clauses: GroundClauses) -> list[bytes]:
    """What tells clauses apart."""
    whole = np.column_stack([clauses.weight, clauses.column * 3 + clauses.sign.astype(np.int64)])
    return [row.tobytes() for row in whole]


def columns_paid(rows: Rows, clauses: GroundClauses, weights: Float) -> Int64:
    """The column that says how far each clause is violated, a new one if need be; -1 for hard clauses."""
    found = np.full(len(clauses), -1, np.int64)
    for i, name in enumerate(names_of(clauses)):
        if name not in rows.clauses:
            rows.clauses.add(name)
            rows.n_groundings += int(clauses.count[i])
        weight = float(weights[clauses.weight[i]])
        if np.isfinite(weight):
            if name not in rows.paid:
                rows.paid[name] = rows.first + len(rows.cost)
                rows.cost.append(weight * int(clauses.count[i]))
            found[i] = rows.paid[name]
    return found


def paid_so_far(rows: Rows, clauses: GroundClauses, weights: Float, x: Float) -> Float:
    """How far each clause is violated, and paid for, in a solution; shape (n,)."""
    if np.isinf(weights[clauses.weight]).all():
        return np.zeros(len(clauses))
    at = np.array([rows.paid.get(name, -1) for name in names_of(clauses)], np.int64)
    return np.where(at >= 0, np.append(x, 0.0)[at], 0.0)


def add_clauses(rows: Rows, clauses: GroundClauses, weights: Float) -> None:
    """A row for each clause: its false literals are fewer than all, unless it is paid for."""
    paid = columns_paid(rows, clauses, weights)[:, None]
    column = np.hstack([clauses.column, np.maximum(paid, 0)])
    value = np.hstack([-clauses.sign, np.where(paid >= 0, -1.0, 0.0)])
    append(rows, column, value, (clauses.sign < 0).sum(axis=1) - 1.0)


def add_stars(rows: Rows, found: Stars, clauses: GroundClauses, weights: Float) -> Int64:
    """A row for each star: its literals less the excuses, and what is paid for not having one, are at most 1.

    Returns:
        Shape (n_clauses,), the column that says how far a clause of these stars is violated, else -1.
    """
    used = np.unique(found.clause[found.clause >= 0])
    paid = np.full(len(clauses), -1, np.int64)
    paid[used] = columns_paid(rows, clauses.pick(used), weights)
    there, c = found.clause >= 0, np.maximum(found.clause, 0)
    at = (c, found.excuse[c])
    excuse_sign = np.where(there, clauses.sign[at], 0.0)
    pays = there & (paid[c] >= 0)
    column = np.hstack([found.column, clauses.column[at], np.where(pays, paid[c], 0)])
    value = np.hstack([found.sign, -excuse_sign, np.where(pays, -1.0, 0.0)])
    append(rows, column, value, 1.0 - (found.sign < 0).sum(axis=1) + (excuse_sign < 0).sum(axis=1))
    return paid


def append(rows: Rows, column: Int64, value: Float, limit: Float) -> None:
    """Adds rows of equal width; entries of value 0 are left out."""
    there = value != 0
    append_rows(rows, there.sum(axis=1), column[there], value[there], limit)


def append_rows(rows: Rows, size: Int64, column: Int64, value: Float, limit: Float) -> None:
    """Adds rows of some sizes, one after the other."""
    rows.column = np.concatenate([rows.column, column])
    rows.value = np.concatenate([rows.value, value])
    rows.limit = np.concatenate([rows.limit, limit])
    rows.start = np.concatenate([rows.start, rows.start[-1] + np.cumsum(size)])


def drop_slack(rows: Rows, x: Float, multipliers: Float) -> None:
    """Drops the rows that a solution neither touches nor needs."""
    n = np.diff(rows.start)
    activity = np.bincount(np.repeat(np.arange(len(rows)), n), rows.value * x[rows.column], len(rows))
    retain(rows, (activity > rows.limit - _SLACK) | (multipliers < -_SLACK))


def retain(rows: Rows, keep: Bool) -> None:
    """Drops all rows but these."""
    n = np.diff(rows.start)
    inside = np.repeat(keep, n)
    rows.column, rows.value, rows.limit = rows.column[inside], rows.value[inside], rows.limit[keep]
    rows.start = np.concatenate([[0], np.cumsum(n[keep])])


def with_rows(program: Program, rows: Rows) -> Program:
    """A copy of a program with the rows at its end."""
    whole = np.repeat(np.arange(len(rows)), np.diff(rows.start)) + program.n_rows
    return replace(
        program,
        cost=[*program.cost, np.array(rows.cost)],
        upper=[*program.upper, np.ones(len(rows.cost))],
        n_columns=program.n_columns + len(rows.cost),
        n_rows=program.n_rows + len(rows),
        row=[*program.row, whole],
        column=[*program.column, rows.column],
        value=[*program.value, rows.value],
        limit=[*program.limit, rows.limit],
    )


def least_used(order: Int64, start: Int64, column: Int64, n_columns: int, most: int) -> Bool:
    """Which rows to take, in an order, so that no column is in more than `most` of them; shape (n,)."""
    from mlnlite.infer.map.cuts.star_kernel import pick

    return np.asarray(pick(order, start, column, n_columns, most))
