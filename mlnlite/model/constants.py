"""Constants while evidence is read: each gets the next number of its type when it is first met."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count, filterfalse, islice

import numpy as np
from numpy.typing import NDArray

from mlnlite.syntax.coded import Coded, Codes

BLOCK = 1 << 16
"""Rows that are worked on at once, so that they stay in the cache."""


def blocks(n: int) -> Iterator[slice]:
    """Stretches of n rows, to be worked on one after the other."""
    return (slice(start, min(start + BLOCK, n)) for start in range(0, n, BLOCK))


@dataclass(slots=True)
class Numbering:
    """The constants of a type.

    Attributes:
        names: by id.
        index: ids of the first of them; those behind are all from `words`, so none of these is looked up twice.
        words: the distinct words from which the last constants came.
        met: for lists of words: the list, and the id of each word, or -1.
    """

    names: list[str]
    index: dict[str, int] = field(default_factory=dict)
    words: Sequence[str] | None = None
    met: dict[int, tuple[Sequence[str], Codes]] = field(default_factory=dict)

    def ids(self, names: Sequence[str], words: Sequence[str] | None = None) -> Sequence[int]:
        """Ids of constants, new ones for those not seen before; `words`: where they are from, each asked for once."""
        if words is None or words is not self.words:
            known = len(self.index)
            self.index.update(zip(islice(self.names, known, None), count(known), strict=False))
            self.words = words
        n, index = len(self.names), self.index
        if words is not None and not index:
            self.names += names
            return range(n, len(self.names))
        new = dict(zip(filterfalse(index.__contains__, dict.fromkeys(names)), count(n), strict=False))
        self.names += new
        return [index[name] if name in index else new[name] for name in names]

    def ids_of(self, column: Coded) -> Codes:
        """The ids of its words, shape (n_words,); those of the words in its rows are there afterwards."""
        words = column.names
        _, ids = self.met.setdefault(id(words), (words, np.full(len(words), -1, np.int32)))
        new = _first_met(column.codes, ids)
        ids[new] = self.ids([words[i] for i in new.tolist()], words)
        return ids


def _first_met(codes: Codes, ids: Codes) -> NDArray[np.int64]:
    """The words in these rows that have no id, in order of their first rows."""
    first = np.full(len(ids), len(codes), np.int64)
    for block in reversed(list(blocks(len(codes)))):
        first[codes[block][::-1]] = np.arange(block.start, block.stop)[::-1]  # of equal places, the last one stays
    new = np.flatnonzero((first < len(codes)) & (ids < 0))
    return new[np.argsort(first[new])]
