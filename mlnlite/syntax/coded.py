"""Columns of constants: every constant once, and for each row the number of its constant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int32]


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
    if len(codes) < len(names) // 8:
        few, dense = np.unique(codes, return_inverse=True)
        return coded(dense.astype(np.int32), [names[i] for i in few.tolist()])
    first = np.full(len(names), -1, np.int32)
    first[codes[::-1]] = np.arange(len(codes), dtype=np.int32)[::-1]
    used = np.flatnonzero(first >= 0)
    used = used[np.argsort(first[used])]
    first[used] = np.arange(len(used), dtype=np.int32)
    return Coded([names[i] for i in used.tolist()], first[codes])
