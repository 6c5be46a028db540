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
    return merged_codes([(np.abs(c) << 1) | (c < 0) for c in literals], weight, count)


def code_of(index: Int32, positive: bool) -> Int32:
    """The codes of literals of the atoms at some indices: twice the literal's number, and 1 more if it is negative."""
    return np.asarray((index << np.int32(1)) + np.int32(2 if positive else 3))


def merged_codes(codes: Sequence[Int32], weight: Int32, count: Int64) -> Factors:
    """As `merged_clauses`, of the codes of literals; see `code_of`."""
    rows, weight, count = merged(_sorted_rows(list(codes)), weight, count)
    sign = np.int32(1) - ((rows & np.int32(1)) << np.int32(1))
    return _locked((rows >> np.int32(1)) * sign, weight, count)


def merged(columns: Sequence[Int32], weight: Int32, count: Int64) -> Factors:
    """Rows with equal numbers (not negative) and equal weights made one."""
    bits = int(max((int(c.max(initial=0)) for c in columns), default=0)).bit_length()
    if bits * len(columns) + int(weight.max(initial=0)).bit_length() > 62:
        return _merged_by_columns(columns, weight, count)
    key = weight.astype(np.int64)
    for column in columns:
        key <<= bits
        key |= column
    key, count = _added(key, count)
    rows = np.empty((len(key), len(columns)), np.int32)
    for i in reversed(range(len(columns))):
        rows[:, i] = key & ((1 << bits) - 1)
        key >>= bits
    return _locked(rows, key.astype(np.int32), count)


def _added(key: Int64, count: Int64) -> tuple[Int64, Int64]:
    """The keys in rising order, each once, and the sums of their counts. The keys given may be changed."""
    if len(key) == 0:
        return key, count
    plain = int(count.max()) == 1
    if not plain:
        order = np.argsort(key)
        key, count = key[order], count[order]
    elif not (key[1:] >= key[:-1]).all():
        key.sort()
    new = np.ones(len(key), np.bool_)
    np.not_equal(key[1:], key[:-1], out=new[1:])
    if new.all():
        return key, np.array(count)
    starts = np.flatnonzero(new)
    return key[starts], np.diff(starts, append=len(key)) if plain else np.add.reduceat(count, starts)


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
