"""Equal factors made one: columns of numbers in, rows in rising order out, each once, with how often it was there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]

Factors = tuple[Int32, Int32, Int64]
"""Rows of shape (n, k), and for each row its weight and its count."""


def merged_clauses(literals: Sequence[Int32], weight: Int32, count: Int64) -> Factors:
    """Clauses with equal literals and weights made one, the literals of each in rising order of their atoms.

    Args:
        literals: for each place in the clause a column of literals, `a + 1` or `-(a + 1)`.
        weight: shape (n,).
        count: shape (n,).
    """
    codes = _sorted_rows([(np.abs(c) << 1) | (c < 0) for c in literals])
    rows, weight, count = merged(codes, weight, count)
    atoms = rows >> 1
    return _locked(np.where(rows & 1, -atoms, atoms), weight, count)


def merged(columns: Sequence[Int32], weight: Int32, count: Int64) -> Factors:
    """Rows with equal numbers (not negative) and equal weights made one."""
    bits = int(max((int(c.max(initial=0)) for c in columns), default=0)).bit_length()
    if bits * len(columns) + int(weight.max(initial=0)).bit_length() > 62:
        return _merged_by_columns(columns, weight, count)
    key = weight.astype(np.int64)
    for column in columns:
        key = (key << bits) | column
    if len(count) and int(count.max()) == 1:
        key.sort()
        starts = np.flatnonzero(np.diff(key, prepend=key[0] - 1))
        count = np.diff(starts, append=len(key))
    else:
        order = np.argsort(key)
        key = key[order]
        starts = np.flatnonzero(np.diff(key, prepend=key[0] - 1 if len(key) else 0))
        count = np.add.reduceat(count[order], starts) if len(starts) else count
    if len(starts) < len(key):
        key = key[starts]
    rows = np.empty((len(key), len(columns)), np.int32)
    for i in reversed(range(len(columns))):
        rows[:, i] = key & ((1 << bits) - 1)
        key >>= bits
    return _locked(rows, key.astype(np.int32), count)


def _merged_by_columns(columns: Sequence[Int32], weight: Int32, count: Int64) -> Factors:
    order = np.lexsort((*reversed(columns), weight))
    rows, weight, count = np.column_stack(columns)[order], weight[order], count[order]
    new = np.ones(len(order), bool)
    new[1:] = (weight[1:] != weight[:-1]) | (rows[1:] != rows[:-1]).any(axis=1)
    starts = np.flatnonzero(new)
    return _locked(rows[starts], weight[starts], np.add.reduceat(count, starts) if len(starts) else count)


def _locked(rows: Int32, weight: Int32, count: Int64) -> Factors:
    result = (np.ascontiguousarray(rows, np.int32), weight, count.astype(np.int64, copy=False))
    for array in result:
        array.setflags(write=False)
    return result


def _sorted_rows(columns: list[Int32]) -> list[Int32]:
    """The columns with the numbers of each row in rising order."""
    if len(columns) > 4:
        return list(np.sort(np.column_stack(columns), axis=1).T)
    for end in range(len(columns) - 1, 0, -1):
        for i in range(end):
            low, high = np.minimum(columns[i], columns[i + 1]), np.maximum(columns[i], columns[i + 1])
            columns[i], columns[i + 1] = low, high
    return columns
