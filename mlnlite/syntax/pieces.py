"""From lines that are told apart to facts as columns: what all ways to read them share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mlnlite.syntax.coded import Codes

Int64 = NDArray[np.int64]

BEGIN, FIRST, ARITY, TRUTH, CHANCE, IN_DATABASE, N_COLUMNS = range(7)
"""Columns of a fact: where it begins, in characters; its first word, the predicate, which arguments follow; how many
these are; whether it is true; whether a number in front is the word behind the arguments, there is none, or `?`."""
NUMBER, CERTAIN, UNKNOWN, N_CHANCES = range(4)
WIDEST = 64
"""Words of the longest fact that is read so by compiled code."""


@dataclass(frozen=True, slots=True)
class Piece:
    """Facts about one predicate with one number of arguments.

    Attributes:
        predicate: its name.
        words: one for each argument, shape (n,), numbers of words.
        truth: shape (n,).
        database: shape (n,).
        offset: shape (n,), where in the source each starts.
        weight: shape (n,), log-odds of soft evidence, or None.
    """

    predicate: str
    words: tuple[Codes, ...]
    truth: NDArray[np.bool_]
    database: NDArray[np.int32]
    offset: NDArray[np.integer]
    weight: NDArray[np.float64] | None = None


def pieces_of(facts: Int64, numbers: Codes, word: Callable[[int], str], start: int) -> Iterator[Piece]:
    """Facts, one piece for each predicate, number of arguments, and kind of number in front.

    Args:
        facts: shape (n, N_COLUMNS), one at least.
        numbers: of their words.
        word: the word that stands at a place of these.
        start: where in the source they are counted from.
    """
    first, arity, chance = facts[:, FIRST], facts[:, ARITY], facts[:, CHANCE]
    most = int(arity.max()) + 1
    offset = np.int32 if start + int(facts[-1, BEGIN]) < 1 << 31 else np.int64
    for mine in _alike((numbers[first].astype(np.int64) * most + arity) * N_CHANCES + chance):
        some = facts[mine]
        words, n, kind = some[:, FIRST], int(some[0, ARITY]), int(some[0, CHANCE])
        yield Piece(
            word(words[0]),
            tuple(numbers[words + 1 + i] for i in range(n)),
            some[:, TRUTH].astype(np.bool_),
            some[:, IN_DATABASE].astype(np.int32),
            (start + some[:, BEGIN]).astype(offset),
            _weights(numbers, words + 1 + n, word)
            if kind == NUMBER
            else np.zeros(len(some))
            if kind == UNKNOWN
            else None,
        )


def _alike(keys: Int64) -> list[Int64] | list[slice]:
    """The rows of each key."""
    if (keys == keys[0]).all():
        return [slice(None)]
    order = np.argsort(keys, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(keys[order])) + 1)


def _weights(numbers: Codes, places: Int64, word: Callable[[int], str]) -> NDArray[np.float64]:
    """Log-odds of the numbers in front of facts."""
    _, first, which = np.unique(numbers[places], return_index=True, return_inverse=True)
    return np.array([log_odds(float(word(i))) for i in places[first].tolist()])[which]


def log_odds(probability: float) -> float:
    """The weight of soft evidence.

    >>> log_odds(0.5)
    0.0
    """
    return float(np.log(probability) - np.log1p(-probability))
