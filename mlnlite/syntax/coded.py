"""Columns of constants: every constant once, and for each row the number of its constant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Keys = NDArray[np.uint64]
Codes = NDArray[np.int32]

LETTERS = 8
"""Bytes of a word that one key holds, the first one lowest; a short word is filled up with zeros."""
_SPREAD, _HIGH = np.uint64(0x9E3779B97F4A7C15), np.uint64(29)


@dataclass(frozen=True, slots=True, eq=False)
class Coded:
    """A column: its distinct constants in the order in which they are met, and for each row which one (-1 for NULL)."""

    names: Sequence[str]
    codes: Codes

    def __eq__(self, other: object) -> bool:
        """Whether the rows are the same."""
        if not isinstance(other, Coded):
            return False
        return list(self.names) == list(other.names) and np.array_equal(self.codes, other.codes)

    __hash__ = None  # type: ignore[assignment]

    def texts(self) -> list[str]:
        """The constant of each row."""
        return [self.names[code] for code in self.codes.tolist()]


def coded(codes: Codes, names: Sequence[str]) -> Coded:
    """A column whose codes are numbers of `names`, of which it may not use all.

    >>> column = coded(np.array([2, 0, 2], np.int32), ["a", "b", "c"])
    >>> column.names, column.codes.tolist()
    (['c', 'a'], [0, 1, 0])
    """
    first = np.full(len(names), -1, np.int32)
    first[codes[::-1]] = np.arange(len(codes), dtype=np.int32)[::-1]
    used = np.flatnonzero(first >= 0)
    used = used[np.argsort(first[used])]
    first[used] = np.arange(len(used), dtype=np.int32)
    return Coded([names[i] for i in used.tolist()], first[codes])


def numbered_words(words: Keys) -> tuple[Codes, list[str]]:
    """Numbers for words, and the distinct words.

    Args:
        words: shape (n, k), each word as k keys; ASCII.
    """
    keys = words[:, 0]
    for more in words.T[1:]:
        keys = (keys ^ (keys >> _HIGH)) * _SPREAD + more
    codes, rows = numbered(keys)
    distinct = words[rows]
    if words.shape[1] > 1 and not (distinct[codes] == words).all():  # two words with one key: 2**-64 for each pair
        distinct, of = np.unique(words, axis=0, return_inverse=True)
        codes = of.reshape(-1).astype(np.int32)
    texts = np.ascontiguousarray(distinct, "<u8").view(f"S{LETTERS * words.shape[1]}")
    return codes, texts[:, 0].astype(f"U{LETTERS * words.shape[1]}").tolist()


def numbered(keys: Keys) -> tuple[Codes, NDArray[np.int64]]:
    """Numbers for equal keys in the order in which they are met, and for each number its first row.

    An open hash table in rounds: all rows write their keys, and those that then find another key try the next slot.

    >>> codes, rows = numbered(np.array([7, 9, 7], np.uint64))
    >>> codes.tolist(), rows.tolist()
    ([0, 1, 0], [0, 1])
    """
    starts = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
    if 2 * len(starts) < len(keys):  # runs of equal keys, as in a sorted column
        codes, rows = numbered(keys[starts])
        return np.repeat(codes, np.diff(starts, append=len(keys))), starts[rows]
    keys = keys if keys.all() else np.where(keys == 0, ~np.uint64(0), keys)
    ranked = np.sort(keys)
    bits = max(4, int(4 * np.count_nonzero(ranked[1:] != ranked[:-1]) + 3).bit_length())
    slot = ((keys * _SPREAD) >> np.uint64(64 - bits)).astype(np.int32)
    table = np.zeros(1 << bits, np.uint64)
    table[slot] = keys
    rest = np.flatnonzero(table[slot] != keys)
    while len(rest):
        at = (slot[rest] + 1) & (len(table) - 1)
        free = table[at] == 0
        table[at[free]] = keys[rest[free]]
        slot[rest] = at
        rest = rest[table[at] != keys[rest]]
    first = np.full(len(table), -1, np.int32)
    first[slot[::-1]] = np.arange(len(keys), dtype=np.int32)[::-1]
    used = np.flatnonzero(first >= 0)
    used = used[np.argsort(first[used])]
    rows = first[used].astype(np.int64)
    first[used] = np.arange(len(used), dtype=np.int32)
    return first[slot], rows
