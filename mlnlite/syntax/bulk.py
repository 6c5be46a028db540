"""Facts of large texts: text in, columns of numbered words out, by compiled code. Other lines go to the parser."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mlnlite.syntax import bulk_kernel as kernel
from mlnlite.syntax.rows import Piece, Progress, log_odds

CHUNK = 1 << 22
"""Characters that are read at once."""
FACTS = 1 << 15
"""Facts that are gathered before they become columns."""
WORDS = 1 << 12
"""Words for which there is room at first."""


def _no_words() -> kernel.Words:
    table = np.zeros((2 * WORDS, 2), np.int64)
    return kernel.Words(np.zeros(16 * WORDS, np.uint8), np.zeros(WORDS, np.int64), table)


@dataclass(slots=True)
class Vocabulary:
    """The words that facts consist of, by number.

    Attributes:
        words: their letters.
        n: how many they are.
    """

    words: kernel.Words = field(default_factory=_no_words)
    n: int = 0

    def texts(self) -> list[str]:
        """All of them."""
        begins = self.words.begins[: self.n + 1].tolist()
        letters = self.words.letters[: begins[-1]].tobytes().decode()
        return [letters[i:j] for i, j in pairwise(begins)]

    def text(self, number: int) -> str:
        """One of them."""
        begin, end = self.words.begins[number : number + 2]
        return self.words.letters[begin:end].tobytes().decode()


def read_bulk(
    text: str, start: int, end: int, progress: Progress, vocabulary: Vocabulary
) -> Iterator[Piece | tuple[int, int]]:
    """The facts of a stretch of text that stand on lines of their own, piece by piece.

    Args:
        text: facts, without comments.
        start: begin of the stretch.
        end: its end.
        progress: changes as the text is read.
        vocabulary: gains the words.

    Yields:
        Facts; or start and end of lines that are left, when `progress` is theirs.
    """
    found = _room()
    state, size = np.zeros(kernel.N_STATE, np.int64), CHUNK
    while start < end:
        stop, larger = min(text.find("\n", start + size) + 1 or len(text), end), CHUNK
        chunk = _bytes(text[start:stop])
        state[[kernel.POSITION, kernel.SKIPPED, kernel.FIRST_LEFT]] = 0, 0, -1
        while (reason := _read(chunk, found, progress, state)) != kernel.END:
            left, behind = int(state[kernel.FIRST_LEFT]), int(state[kernel.POSITION] - state[kernel.SKIPPED])
            if reason == kernel.FULL:
                yield from _pieces(chunk, found, start, state, vocabulary)
            elif reason == kernel.LEFT_LAST and stop < end:  # they may go on in the next chunk
                stop, larger = start + left, CHUNK if left else 2 * size
                break
            else:
                state[kernel.FIRST_LEFT] = -1
                yield start + left, min(start + behind, end)
        yield from _pieces(chunk, found, start, state, vocabulary)
        start, size = stop, larger


def _room() -> kernel.Found:
    n = kernel.WIDEST + 4 * FACTS
    rows = np.empty((FACTS, kernel.N_COLUMNS), np.int32)
    return kernel.Found(rows, np.empty(n, np.uint64), np.empty(n, np.int32), np.empty(n, np.int32))


def _bytes(text: str) -> kernel.Text:
    letters = np.frombuffer(text.encode() + b"\n" + bytes(kernel.PADDING), np.uint8)
    return kernel.Text(letters, np.ndarray((len(letters) - 7,), "<u8", letters, strides=(1,)))


def _read(chunk: kernel.Text, found: kernel.Found, progress: Progress, state: NDArray[np.int64]) -> int:
    state[[kernel.DATABASE, kernel.SEPARATOR]] = progress.database, progress.separator
    reason: int = kernel.read_lines(chunk, found, state)
    progress.database, progress.separator = int(state[kernel.DATABASE]), bool(state[kernel.SEPARATOR])
    return reason


def _pieces(
    chunk: kernel.Text, found: kernel.Found, start: int, state: NDArray[np.int64], vocabulary: Vocabulary
) -> Iterator[Piece]:
    """The facts found so far, one piece for each predicate, number of arguments, and kind of number in front."""
    numbers = _numbers(chunk, found, int(state[kernel.N_WORDS]), vocabulary)
    rows = found.rows[: state[kernel.N_FACTS]]
    first, arity, chance = rows[:, kernel.FIRST], rows[:, kernel.ARITY], rows[:, kernel.CHANCE]
    for mine in _alike((numbers[first].astype(np.int64) * kernel.WIDEST + arity) * kernel.N_CHANCES + chance):
        words, n, kind = first[mine], int(arity[mine[0]]), int(chance[mine[0]])
        yield Piece(
            vocabulary.text(numbers[words[0]]),
            tuple(numbers[words + 1 + i] for i in range(n)),
            rows[mine, kernel.TRUTH].astype(np.bool_),
            rows[mine, kernel.IN_DATABASE],
            start + rows[mine, kernel.BEGIN].astype(np.int64),
            _weights(numbers[words + 1 + n], vocabulary) if kind == kernel.NUMBER else _weight(kind, len(mine)),
        )
    state[[kernel.N_FACTS, kernel.N_WORDS]] = 0


def _alike(keys: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """The rows of each key."""
    if (keys == keys[:1]).all():
        return [np.arange(len(keys))] if len(keys) else []
    order = np.argsort(keys, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(keys[order])) + 1)


def _numbers(chunk: kernel.Text, found: kernel.Found, n: int, vocabulary: Vocabulary) -> NDArray[np.int32]:
    """The numbers of the first words found."""
    numbers, done = np.empty(n, np.int32), 0
    while done < n:
        done, vocabulary.n = kernel.number_words(chunk, found, done, numbers, vocabulary.words, vocabulary.n)
        if done < n:
            vocabulary.words = _with_room(vocabulary.words)
    return numbers


def _with_room(words: kernel.Words) -> kernel.Words:
    """The same words, and room for as many again."""
    letters, begins = (np.concatenate([a, np.zeros_like(a)]) for a in (words.letters, words.begins))
    table = np.zeros((2 * len(words.table), 2), np.int64)
    kernel.enter(words.table, table)
    return kernel.Words(letters, begins, table)


def _weight(kind: int, n: int) -> NDArray[np.float64] | None:
    return np.zeros(n) if kind == kernel.UNKNOWN else None


def _weights(numbers: NDArray[np.int32], vocabulary: Vocabulary) -> NDArray[np.float64]:
    """Log-odds of the numbers in front of facts."""
    distinct, which = np.unique(numbers, return_inverse=True)
    return np.array([log_odds(float(vocabulary.text(n))) for n in distinct.tolist()])[which]
