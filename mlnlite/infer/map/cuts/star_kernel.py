"""Sets of literals of which at most one can hold unless some excuse does, grown greedily; compiled."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled


@compiled
def grow(begin, other, excuse, clause, value, least, most):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """From each literal: adds the literal that gains most, its value less the excuses, as long as there is a gain.

    Args:
        begin: shape (n + 1,), where the edges of each literal start.
        other: shape (m,), the literal at the other end.
        excuse: shape (m,), value of what allows both to hold.
        clause: shape (m,), number of the clause that says so.
        value: shape (n,), of each literal.
        least: smallest gain.
        most: largest number of literals of a set.

    Returns:
        Shapes (n, most) and (n, most (most - 1) / 2), -1 beyond the end: literals and clauses of each set; shape (n,):
        by how much its value, excuses taken off, is above 1.
    """
    n = len(value)
    members, clauses = np.full((n, most), -1, np.int64), np.full((n, most * (most - 1) // 2), -1, np.int64)
    above, gain, linked = np.full(n, -1.0), np.zeros(n), np.zeros(n, np.int64)
    for s in range(n):
        total, size, n_clauses, new = value[s], 1, 0, s
        members[s, 0] = s
        for i in range(begin[s], begin[s + 1]):
            linked[other[i]], gain[other[i]] = 0, value[other[i]]
        while True:
            best = -1
            for i in range(begin[new], begin[new + 1]):
                c = other[i]
                if linked[c] == size - 1:
                    linked[c], gain[c] = size, gain[c] - excuse[i]
                    if gain[c] > least and (best < 0 or gain[c] > gain[best]):
                        best = c
            if best < 0 or size == most:
                break
            for i in range(begin[best], begin[best + 1]):
                if linked[other[i]] < 0 or other[i] == s:
                    clauses[s, n_clauses] = clause[i]
                    n_clauses += 1
            total, members[s, size], linked[best] = total + gain[best], best, -1
            size, new = size + 1, best
        above[s] = total - 1
        for i in range(begin[s], begin[s + 1]):
            linked[other[i]] = 0
        linked[s] = 0
    return members, clauses, above


@compiled
def pick(order, begin, column, n_columns, most):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Which rows to take, in some order, if each column is to be in no more than `most` of them; shape (n,).

    Args:
        order: shape (n,), rows, the first ones first.
        begin: shape (n + 1,), where the columns of each row start.
        column: shape (m,).
        n_columns: how many there are.
        most: how often.
    """
    used, taken = np.zeros(n_columns, np.int64), np.zeros(len(order), np.bool_)
    for row in order:
        free = True
        for i in range(begin[row], begin[row + 1]):
            free = free and used[column[i]] < most
        if free:
            taken[row] = True
            for i in range(begin[row], begin[row + 1]):
                used[column[i]] += 1
    return taken
