"""Facts of large texts: text in, columns of numbered words out, by compiled code. Other lines go to the parser."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mlnlite.syntax import bulk_kernel as kernel
from mlnlite.syntax.letters import Letters
from mlnlite.syntax.pieces import N_COLUMNS, WIDEST, Piece, pieces_of
from mlnlite.syntax.rows import Progress

FACTS = 1 << 13
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
        letters = self.words.letters[: self.words.begins[self.n]]
        return letters.tobytes().decode().split("\n")[:-1]

    def text(self, number: int) -> str:
        """One of them."""
        begin, end = self.words.begins[number : number + 2]
        return self.words.letters[begin : end - 1].tobytes().decode()


def read_bulk(
    chunks: Iterable[Letters], start: int, progress: Progress, vocabulary: Vocabulary
) -> Iterator[Piece | tuple[int, int]]:
    """The facts of a text that stand on lines of their own, piece by piece.

    Args:
        chunks: the text, some lines at a time, each as in `letters_of`.
        start: where it stands in its source, in characters.
        progress: changes as the text is read.
        vocabulary: gains the words.

    Yields:
        Facts; or start and end of lines that are left, when `progress` is theirs.
    """
    found, state = _room(), np.zeros(kernel.N_STATE, np.int64)
    for text in map(_text, chunks):
        state[[kernel.POSITION, kernel.SKIPPED, kernel.FIRST_LEFT]], reason = (0, 0, -1), kernel.FULL
        while reason != kernel.END:
            state[[kernel.DATABASE, kernel.SEPARATOR]] = progress.database, progress.separator
            reason = kernel.read_lines(text, found, state)
            progress.database, progress.separator = int(state[kernel.DATABASE]), bool(state[kernel.SEPARATOR])
            yield from _pieces(text, found, start, state, vocabulary)
            behind = start + int(state[kernel.POSITION] - state[kernel.SKIPPED])
            if reason == kernel.LEFT:
                left, state[kernel.FIRST_LEFT] = int(state[kernel.FIRST_LEFT]), -1
                yield start + left, behind
        start = behind


def _text(letters: Letters) -> kernel.Text:
    letters.flags.writeable = False
    return kernel.Text(letters, np.ndarray((len(letters) - 7,), "<u8", letters, strides=(1,)))


def _room() -> kernel.Found:
    n = WIDEST + 4 * FACTS
    rows = np.empty((FACTS, N_COLUMNS), np.int64)
    return kernel.Found(rows, np.empty(n, np.uint64), np.empty(n, np.int64), np.empty(n, np.int32))


def _pieces(
    text: kernel.Text, found: kernel.Found, start: int, state: NDArray[np.int64], vocabulary: Vocabulary
) -> Iterator[Piece]:
    """The facts found so far, one piece for each predicate, number of arguments, and kind of number in front."""
    if not state[kernel.N_FACTS]:
        return
    numbers = _numbers(text, found, int(state[kernel.N_WORDS]), vocabulary)
    rows = found.rows[: state[kernel.N_FACTS]]
    yield from pieces_of(rows, numbers, lambda i: vocabulary.text(numbers[i]), start)
    state[[kernel.N_FACTS, kernel.N_WORDS]] = 0


def _numbers(text: kernel.Text, found: kernel.Found, n: int, vocabulary: Vocabulary) -> NDArray[np.int32]:
    """The numbers of the first words found."""
    numbers, done = np.empty(n, np.int32), 0
    while done < n:
        done, vocabulary.n = kernel.number_words(text, found, done, numbers, vocabulary.words, vocabulary.n)
        if done < n:
            vocabulary.words = _with_room(vocabulary.words)
    return numbers


def _with_room(words: kernel.Words) -> kernel.Words:
    """The same words, and room for as many again."""
    letters, begins = (np.concatenate([a, np.zeros_like(a)]) for a in (words.letters, words.begins))
    table = np.zeros((2 * len(words.table), 2), np.int64)
    kernel.enter(words.table, table)
    return kernel.Words(letters, begins, table)
