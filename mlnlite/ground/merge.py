"""Equal factors made one: columns of numbers in, rows in rising order out, each once, with how often it was there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]

CHUNK = 1 << 18
"""Rows that are worked on at once, so that they stay in the cache."""

Piece = tuple[Sequence[Int32], Int32, Int64]
"""Columns of rows, and for each row its weight and its count."""

Factors = tuple[Int32, Int32, Int64]
"""Rows of shape (n, k), and for each row its weight and its count."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """What pieces have together.

    Attributes:
        n: number of rows.
        k: numbers in a row.
        number: all numbers are less than this.
        weight: and so are weights less than this.
    """

    n: int
    k: int
    number: int
    weight: int


def merged_clauses(literals: Sequence[Int32], weight: Int32, count: Int64) -> Factors:
    """Clauses with equal literals and weights made one, the literals of each in rising order of their atoms.

    Args:
        literals: for each place in the clause a column of literals, `a + 1` or `-(a + 1)`.
        weight: shape (n,).
        count: shape (n,).
    """
    codes = [(np.abs(c) << 1) | (c < 0) for c in literals]
    number = max((int(c.max(initial=0)) for c in codes), default=0) + 1
    bounds = Bounds(len(weight), len(codes), number, int(weight.max(initial=0)) + 1)
    return merged_codes([(codes, weight, count)], bounds)


def code_of(index: Int32, positive: bool) -> Int32:
    """The codes of literals of the atoms at some indices: twice the literal's number, and 1 more if it is negative."""
    return np.asarray((index << np.int32(1)) + np.int32(2 if positive else 3))


def merged_codes(pieces: Iterable[Piece], bounds: Bounds) -> Factors:
    """As `merged_clauses`, of clauses in pieces, whose literals are given by their codes; see `code_of`."""
    rows, weight, count = _merged(((_sorted_rows(list(codes)), w, n) for codes, w, n in pieces), bounds)
    for start in range(0, len(rows), CHUNK):
        chunk = rows[start : start + CHUNK]
        negative = -(chunk & np.int32(1))
        chunk >>= np.int32(1)
        chunk ^= negative  # two's complement: where negative is -1 this and the next line change the sign
        chunk -= negative
    return _locked(rows, weight, count)


def merged(pieces: Iterable[Piece], bounds: Bounds) -> Factors:
    """Rows in pieces, with equal numbers (not negative) and equal weights made one."""
    return _locked(*_merged(pieces, bounds))


def _merged(pieces: Iterable[Piece], bounds: Bounds) -> Factors:
    bits = (bounds.number - 1).bit_length()
    if bits * bounds.k + (bounds.weight - 1).bit_length() > 62:
        return _merged_by_columns(list(pieces), bounds)
    key = np.empty(bounds.n, np.int64)
    counts, at = [], 0
    for columns, weight, count in pieces:
        part = key[at : at + len(weight)]
        part[:] = weight
        for column in columns:
            part <<= bits
            part |= column
        counts.append(count)
        at += len(weight)
    plain = all(int(n.max(initial=1)) == 1 for n in counts)
    key, count = _added(key, None if plain else np.concatenate(counts))
    return *_unpacked(key, bounds.k, bits), count


def _unpacked(key: Int64, k: int, bits: int) -> tuple[Int32, Int32]:
    """The rows and the weights that keys stand for. Changes the keys."""
    rows = key.view(np.int32).reshape(-1, 2) if k == 2 else np.empty((len(key), k), np.int32)
    weight = np.empty(len(key), np.int32)
    mask = (1 << bits) - 1
    for start in range(0, len(key), CHUNK):
        chunk = slice(start, start + CHUNK)
        part = key[chunk].copy()  # two numbers take the place of their key
        for i in reversed(range(k)):
            rows[chunk, i] = part & mask
            part >>= bits
        weight[chunk] = part
    return rows, weight


def _added(key: Int64, count: Int64 | None) -> tuple[Int64, Int64]:
    """The keys in rising order, each once, and the sums of their counts (None: 1 each). Changes the keys given."""
    if count is not None:
        order = np.argsort(key)
        key, count = key[order], count[order]
    elif not (key[1:] >= key[:-1]).all():
        key.sort()
    new = np.ones(len(key), np.bool_)
    np.not_equal(key[1:], key[:-1], out=new[1:])
    if new.all():
        return key, np.ones(len(key), np.int64) if count is None else count
    starts = np.flatnonzero(new)
    return key[starts], np.diff(starts, append=len(key)) if count is None else np.add.reduceat(count, starts)


def _merged_by_columns(pieces: list[Piece], bounds: Bounds) -> Factors:
    columns = [np.concatenate([p[0][i] for p in pieces]) for i in range(bounds.k)]
    weight, count = (np.concatenate([p[i] for p in pieces]) for i in (1, 2))
    order = np.lexsort((*reversed(columns), weight))
    rows, weight, count = np.column_stack(columns)[order], weight[order], count[order]
    new = np.ones(len(order), bool)
    new[1:] = (weight[1:] != weight[:-1]) | (rows[1:] != rows[:-1]).any(axis=1)
    starts = np.flatnonzero(new)
    return rows[starts], weight[starts], np.add.reduceat(count, starts) if len(starts) else count


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
