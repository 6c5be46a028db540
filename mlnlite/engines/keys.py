"""Several columns of small integers as one key, and dictionaries by such keys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Column = NDArray[Any]
Bool = NDArray[np.bool_]
Int64 = NDArray[np.int64]

DENSEST = 1 << 26
"""Places that an array for look-ups may have."""


@dataclass(frozen=True, slots=True)
class Digit:
    """One column of a key.

    Attributes:
        low: lowest value.
        width: number of values from there on.
        ranks: the distinct keys of the columns before it, which their places stand for from here on; None for the keys
            themselves, as long as these fit into 62 bits.
    """

    low: int
    width: int
    ranks: Column | None


@dataclass(frozen=True, slots=True)
class Packing:
    """How the rows of a relation become keys: `(c1 - low1) * width2 + (c2 - low2)` and so on.

    Attributes:
        digits: one for each column.
        size: a bound of the keys.
    """

    digits: tuple[Digit, ...]
    size: int

    @property
    def exact(self) -> bool:
        """Whether keys can be taken apart again."""
        return all(d.ranks is None for d in self.digits)

    def dense(self, n: int) -> bool:
        """Whether an array with a place for each key pays for `n` rows."""
        return self.size <= min(DENSEST, 8 * n + 4096)

    def keys(self, columns: Sequence[Column]) -> tuple[Column, Bool | None]:
        """The keys of some rows, and which rows have values that no row of the relation has; None if there are none."""
        key: Column | None = None
        strange: Bool | None = None
        size = 1
        for digit, column in zip(self.digits, columns, strict=True):
            if key is not None and digit.ranks is not None:
                key, unknown = _place_in(digit.ranks, key)
                strange, size = _either(strange, unknown), len(digit.ranks)
            column, outside = _within(column, digit)
            strange = _either(strange, outside)
            size *= digit.width
            if digit.width > 1:
                kind: Any = np.int32 if size < 2**31 else np.int64
                key = column if key is None else key.astype(kind) * kind(digit.width) + column
        return np.zeros(len(columns[0]), np.int32) if key is None else key, strange

    def columns(self, key: Column) -> list[Column]:
        """The columns that some keys stand for."""
        found = []
        for digit in reversed(self.digits):
            key, value = np.divmod(key, digit.width)
            found.append(value + digit.low)
        return found[::-1]


def packing_of(columns: Sequence[Column]) -> Packing:
    """The packing of a relation with these columns."""
    digits: list[Digit] = []
    size = 1
    for column in columns:
        low = int(column.min()) if len(column) else 0
        width = int(column.max()) - low + 1 if len(column) else 1
        ranks = None
        if size * width >= 2**62:
            before, _ = Packing(tuple(digits), size).keys(columns[: len(digits)])
            ranks = np.unique(before)
            size = len(ranks)
        digits.append(Digit(low, width, ranks))
        size *= width
    return Packing(tuple(digits), size)


def _within(column: Column, digit: Digit) -> tuple[Column, Bool | None]:
    """A column from its lowest value on, and which values are outside of the digit (they become 0); None if none is."""
    low, end = digit.low, digit.low + digit.width
    every = column[:1] if column.strides == (0,) else column  # of a constant one is enough
    if not len(column) or (int(every.min()) >= low and int(every.max()) < end):
        return column - low if low else column, None
    outside = (column < low) | (column >= end)
    return np.where(outside, 0, column - low), outside


def _place_in(ordered: Column, values: Column) -> tuple[Int64, Bool]:
    """Where values stand in a rising array that is not empty, and which do not stand there."""
    place = np.minimum(np.searchsorted(ordered, values), len(ordered) - 1)
    return place, ordered[place] != values


def _either(first: Bool | None, second: Bool | None) -> Bool | None:
    return second if first is None else first if second is None else first | second


@dataclass(frozen=True, slots=True)
class Dictionary:
    """A number for each key of a relation.

    Attributes:
        packing: how rows become keys.
        dense: shape (size,), the number of each key; None if keys are too sparse for that.
        keys: then, the keys in rising order.
        values: and the number of each.
        absent: stands for the number of a key that is not there.
    """

    packing: Packing
    dense: Column | None
    keys: Column
    values: Column
    absent: int

    def find(self, columns: Sequence[Column]) -> Column:
        """The numbers of the keys of some rows."""
        key, strange = self.packing.keys(columns)
        if self.dense is not None:
            found = self.dense.take(key, mode="clip")  # no key is outside; the other modes are slower
        elif not len(self.keys):
            return np.full(len(key), self.absent, self.values.dtype)
        else:
            place, unknown = _place_in(self.keys, key)
            found = np.where(unknown, self.values.dtype.type(self.absent), self.values[place])
        if strange is not None:
            found[strange] = self.absent
        return found


def dictionary(columns: Sequence[Column], values: Column, n_others: int) -> Dictionary:
    """The dictionary of a relation.

    Args:
        columns: its columns.
        values: the number of each row, the same for rows with the same key.
        n_others: about how many other rows will be looked up at once.
    """
    packing = packing_of(columns)
    key, _ = packing.keys(columns)
    absent = int(values.max(initial=0)) + 1
    kind = np.result_type(values.dtype, np.min_scalar_type(-absent))
    if packing.dense(len(key) + n_others):
        dense = np.full(packing.size, absent, kind)
        dense[key] = values
        return Dictionary(packing, dense, key, values, absent)
    order = np.argsort(key)
    return Dictionary(packing, None, key[order], values[order].astype(kind), absent)
