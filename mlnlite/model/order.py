"""Facts in order of database and arguments: rows become single numbers, which sort several times as fast."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from mlnlite.model.evidence import Facts

BLOCK = 1 << 16
"""Rows that are worked on at once, so that they stay in the cache."""


def ordered(facts: Facts, sizes: Sequence[int]) -> tuple[Facts, NDArray[np.bool_], Callable[[], NDArray[np.int64]]]:
    """Facts in order.

    Args:
        facts: in any order.
        sizes: how many constants there are for each argument.

    Returns:
        The facts in order; which of them are about the atom of the one before; what tells, if it is asked, the row
        that each came from.
    """
    bits = [int(size - 1).bit_length() for size in (facts.database.max(initial=0) + 1, *sizes)]
    if sum(bits) > 62:
        order = np.lexsort((*reversed(facts.arguments.T), facts.database))
        found = Facts(facts.database[order], facts.arguments[order], facts.truth[order])
        return found, _repeated(found), lambda: order
    numbers = _numbers(facts, bits)
    again = np.zeros(len(numbers), np.bool_)
    ranked = bool((numbers[1:] >= numbers[:-1]).all())
    rest = numbers if ranked else np.sort(numbers)
    for block in blocks(len(rest) - 1):
        again[1:][block] = (rest[1:][block] ^ rest[:-1][block]) <= 1
    return facts if ranked else _facts(rest, bits), again, lambda: np.argsort(numbers, kind="stable")


def blocks(n: int) -> Iterator[slice]:
    """Stretches of n rows, to be worked on one after the other."""
    return (slice(start, start + BLOCK) for start in range(0, n, BLOCK))


def _repeated(facts: Facts) -> NDArray[np.bool_]:
    again = np.zeros(len(facts.truth), np.bool_)
    same = (facts.arguments[1:] == facts.arguments[:-1]).all(axis=1)
    again[1:] = same & (facts.database[1:] == facts.database[:-1])
    return again


def _numbers(facts: Facts, bits: Sequence[int]) -> NDArray[np.int64]:
    """Database, arguments and truth as digits of one number."""
    numbers = np.empty(len(facts.truth), np.int64)
    for block in blocks(len(numbers)):
        number = facts.database[block].astype(np.int64)
        for column, n in zip(facts.arguments[block].T, bits[1:], strict=True):
            number <<= n
            number |= column
        number <<= 1
        number |= facts.truth[block]
        numbers[block] = number
    return numbers


def _facts(numbers: NDArray[np.int64], bits: Sequence[int]) -> Facts:
    """The facts with these numbers."""
    n = len(numbers)
    database, truth = np.zeros(n, np.int32), np.empty(n, np.bool_)
    arguments = np.empty((n, len(bits) - 1), np.int32)
    for block in blocks(n):
        number = numbers[block].copy()
        truth[block] = number & 1
        number >>= 1
        for i in reversed(range(len(bits) - 1)):
            arguments[block, i] = number & ((1 << bits[i + 1]) - 1)
            number >>= bits[i + 1]
        if bits[0]:
            database[block] = number
    return Facts(database, arguments, truth)
