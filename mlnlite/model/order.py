"""Facts in order of database and arguments: rows become single numbers, which sort several times as fast."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mlnlite.model.constants import blocks
from mlnlite.model.evidence import Facts, Int32, Int64


@dataclass(frozen=True, slots=True)
class Part:
    """Facts of one predicate in any order.

    Attributes:
        database: shape (n,).
        words: for each argument the word of each fact, shape (n,).
        ids: for each argument the constant of each word.
        truth: shape (n,).
    """

    database: Int32
    words: tuple[Int32, ...]
    ids: tuple[Int32, ...]
    truth: NDArray[np.bool_]

    def arguments(self) -> Int32:
        """Constant ids, shape (n, arity)."""
        found = np.empty((len(self.truth), len(self.words)), np.int32)
        for i, (words, ids) in enumerate(zip(self.words, self.ids, strict=True)):
            found[:, i] = ids[words]
        return found


def ordered(parts: Sequence[Part], sizes: Sequence[int]) -> tuple[Facts, NDArray[np.bool_], Callable[[], Int64]]:
    """Facts in order.

    Args:
        parts: the facts.
        sizes: how many constants there are for each argument.

    Returns:
        The facts in order; which of them are about the atom of the one before; what tells, if it is asked, the row
        that each came from.
    """
    n_databases = 1 + max(int(part.database.max(initial=0)) for part in parts)
    bits = [int(size - 1).bit_length() for size in (n_databases, *sizes)]
    if sum(bits) > 62:
        return _by_columns(parts)
    numbers = _numbers(parts, bits)
    if (numbers[1:] < numbers[:-1]).any():
        numbers.sort()
    again = np.zeros(len(numbers), np.bool_)
    for block in blocks(len(numbers) - 1):
        again[1:][block] = (numbers[1:][block] ^ numbers[:-1][block]) <= 1
    return _facts(numbers, bits), again, lambda: np.argsort(_numbers(parts, bits), kind="stable")


def _by_columns(parts: Sequence[Part]) -> tuple[Facts, NDArray[np.bool_], Callable[[], Int64]]:
    """The same for facts that do not fit into 64 bits."""
    database, truth = (np.concatenate([getattr(part, name) for part in parts]) for name in ("database", "truth"))
    arguments = np.concatenate([part.arguments() for part in parts])
    order = np.lexsort((*reversed(arguments.T), database))
    facts, again = Facts(database[order], arguments[order], truth[order]), np.zeros(len(order), np.bool_)
    same = (facts.arguments[1:] == facts.arguments[:-1]).all(axis=1)
    again[1:] = same & (facts.database[1:] == facts.database[:-1])
    return facts, again, lambda: order


def _numbers(parts: Sequence[Part], bits: Sequence[int]) -> Int64:
    """Database, arguments and truth as digits of one number."""
    numbers, at = np.empty(sum(len(part.truth) for part in parts), np.int64), 0
    for part in parts:
        for block in blocks(len(part.truth)):
            number = part.database[block].astype(np.int64)
            for words, ids, n in zip(part.words, part.ids, bits[1:], strict=True):
                number <<= n
                number |= ids[words[block]]
            number <<= 1
            number |= part.truth[block]
            numbers[at : at + len(number)] = number
            at += len(number)
    return numbers


def _facts(numbers: Int64, bits: Sequence[int]) -> Facts:
    """The facts with these numbers, whose memory they take if they fit."""
    n, arity = len(numbers), len(bits) - 1
    database, truth = np.zeros(n, np.int32), np.empty(n, np.bool_)
    arguments = numbers.view(np.int32)[: n * arity] if arity <= 2 else np.empty(n * arity, np.int32)
    arguments = arguments.reshape(n, arity)
    for block in blocks(n):
        number = numbers[block].copy()
        truth[block] = number & 1
        number >>= 1
        for i in reversed(range(arity)):
            arguments[block, i] = number & ((1 << bits[i + 1]) - 1)
            number >>= bits[i + 1]
        if bits[0]:
            database[block] = number
    return Facts(database, arguments, truth)
