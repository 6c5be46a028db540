"""Equal factors made one: columns of numbers in, rows in rising order out, each once, with how often it was there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.room import long_array

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]

CHUNK = 1 << 16
"""Rows that are worked on at once, so that they stay in the cache."""

Piece = tuple[Sequence[Int32], NDArray[Any], Int64]
"""Columns of rows, and for each row its weight, less the first one of its group, and its count."""

Factors = tuple[Int32, Int32, Int64]
"""Rows of shape (n, k), and for each row its weight and its count."""


@dataclass(frozen=True, slots=True)
class Group:
    """Rows with weights that no other group has.

    Attributes:
        pieces: the rows.
        n: how many.
        first: the first weight; those of a group are higher than those of the groups before it.
        n_weights: number of weights from there on.
    """

    pieces: Iterable[Piece]
    n: int
    first: int
    n_weights: int


def merged_clauses(literals: Sequence[Int32], weight: Int32, count: Int64) -> Factors:
    """Clauses with equal literals and weights made one, the literals of each in rising order of their atoms.

    Args:
        literals: for each place in the clause a column of literals, `a + 1` or `-(a + 1)`.
        weight: shape (n,).
        count: shape (n,).
    """
    codes = [(np.abs(c) << 1) | (c < 0) for c in literals]
    number = max((int(c.max(initial=0)) for c in codes), default=0) + 1
    group = Group([(codes, weight, count)], len(weight), 0, int(weight.max(initial=0)) + 1)
    return merged_codes([group], len(codes), number)


def code_of(index: Int32, positive: bool) -> Int32:
    """The codes of literals of the atoms at some indices: twice the literal's number, and 1 more if it is negative."""
    return np.asarray((index << np.int32(1)) + np.int32(2 if positive else 3))


def merged_codes(groups: Sequence[Group], k: int, number: int) -> Factors:
    """As `merged_clauses`, of clauses of `k` literals, given by their codes, all less than `number`; see `code_of`."""
    return _merged([replace(g, pieces=_with_sorted_rows(g.pieces)) for g in groups], k, number, signed=True)


def merged(groups: Sequence[Group], k: int, number: int) -> Factors:
    """Rows of `k` numbers each, all less than `number`, with equal numbers and equal weights made one."""
    return _merged(groups, k, number, signed=False)


def _merged(groups: Sequence[Group], k: int, number: int, *, signed: bool) -> Factors:
    bits = (number - 1).bit_length()
    if any(bits * k + (g.n_weights - 1).bit_length() > 62 for g in groups):
        rows, weight, count = _merged_by_columns(groups, k)
        return _locked(_literals(rows) if signed else rows, weight, count)
    n = sum(g.n for g in groups)
    key, weight, count = long_array(n, np.int64), long_array(n, np.int32), long_array(n, np.int64)
    rows = (key.view(np.int32) if k == 2 else long_array(n * k, np.int32)).reshape(n, k)  # two take the place of a key
    end = 0
    for group in groups:
        mine = key[end : end + group.n]
        start, end = end, end + _summed(mine, _packed(group, mine, bits), count[end : end + group.n])
        part = slice(start, end)
        _unpack(key[part], rows[part], weight[part], bits, signed)
        if group.first:
            weight[part] += np.int32(group.first)
    rows, weight, count = rows[:end], weight[:end], count[:end]
    return _locked(rows, weight, count) if 4 * end > 3 * n else _locked(rows.copy(), weight.copy(), count.copy())


def _packed(group: Group, key: Int64, bits: int) -> Int64 | None:
    """Writes the keys of a group's rows; returns their counts, or None if all are 1."""
    counts, at = [], 0
    for (first, *columns), weight, count in group.pieces:
        part = key[at : at + len(weight)]
        if group.n_weights == 1:
            part[:] = first
        else:
            np.left_shift(weight, bits, out=part, dtype=np.int64)
            part |= first
        for column in columns:
            part <<= bits
            part |= column
        counts.append(count)
        at += len(weight)
    return None if all(_all_one(c) for c in counts) else np.concatenate(counts)


def _all_one(count: Int64) -> bool:
    """Whether all counts are 1; of one that stands for all one is looked at."""
    return int((count[:1] if count.strides == (0,) else count).max(initial=1)) == 1


def _unpack(key: Int64, rows: Int32, weight: Int32, bits: int, signed: bool) -> None:
    """Writes the rows and the weights that keys stand for. The rows may take the place of the keys."""
    mask = (1 << bits) - 1
    for start in range(0, len(key), CHUNK):
        chunk = slice(start, start + CHUNK)
        part = key[chunk].copy()
        for i in reversed(range(rows.shape[1])):
            number = (part & mask).astype(np.int32)
            rows[chunk, i] = _literals(number) if signed else number
            part >>= bits
        weight[chunk] = part


def _literals(code: Int32) -> Int32:
    """The literals of codes, which it changes."""
    negative = code & np.int32(1)
    np.negative(negative, out=negative)
    code >>= np.int32(1)
    code ^= negative  # two's complement: where negative is -1 this and the next line change the sign
    code -= negative
    return code


def _summed(key: Int64, count: Int64 | None, total: Int64) -> int:
    """Brings keys in rising order, each once, and writes the sums of their counts (None: 1 each); returns how many."""
    if count is not None:
        order = np.argsort(key)
        key[:], count = key[order], count[order]
    elif not _all_adjacent(np.greater_equal, key):
        key.sort()
    if _all_adjacent(np.not_equal, key):
        total[:] = 1 if count is None else count
        return len(key)
    starts = np.flatnonzero(np.append(True, key[1:] != key[:-1]))
    total[: len(starts)] = np.diff(starts, append=len(key)) if count is None else np.add.reduceat(count, starts)
    key[: len(starts)] = key[starts]
    return len(starts)


def _all_adjacent(relation: np.ufunc, key: Int64) -> bool:
    """Whether a relation holds between each key and the one before it."""
    pairs = ((key[i + 1 : i + 1 + CHUNK], key[i : i + CHUNK]) for i in range(0, len(key), CHUNK))
    return all(relation(after, before[: len(after)]).all() for after, before in pairs)


def _merged_by_columns(groups: Sequence[Group], k: int) -> Factors:
    pieces = [(columns, weight + group.first, count) for group in groups for columns, weight, count in group.pieces]
    columns = [np.concatenate([p[0][i] for p in pieces]) for i in range(k)]
    weight, count = (np.concatenate([p[i] for p in pieces]) for i in (1, 2))
    order = np.lexsort((*reversed(columns), weight))
    rows, weight, count = np.column_stack(columns)[order], weight[order], count[order]
    new = np.ones(len(order), bool)
    new[1:] = (weight[1:] != weight[:-1]) | (rows[1:] != rows[:-1]).any(axis=1)
    starts = np.flatnonzero(new)
    return rows[starts], weight[starts].astype(np.int32), np.add.reduceat(count, starts) if len(starts) else count


def _locked(rows: Int32, weight: Int32, count: Int64) -> Factors:
    result = (np.ascontiguousarray(rows, np.int32), weight, count.astype(np.int64, copy=False))
    for array in result:
        array.setflags(write=False)
    return result


def _with_sorted_rows(pieces: Iterable[Piece]) -> Iterator[Piece]:
    return ((_sorted_rows(list(columns)), weight, count) for columns, weight, count in pieces)


def _sorted_rows(columns: list[Int32]) -> list[Int32]:
    """The columns with the numbers of each row in rising order."""
    if len(columns) > 4:
        return list(np.sort(np.column_stack(columns), axis=1).T)
    for end in range(len(columns) - 1, 0, -1):
        for i in range(end):
            low, high = np.minimum(columns[i], columns[i + 1]), np.maximum(columns[i], columns[i + 1])
            columns[i], columns[i + 1] = low, high
    return columns
