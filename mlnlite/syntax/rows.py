"""Facts while they are read: rows that come one by one or in pieces, and the tables that they become."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mlnlite.source import Source
from mlnlite.syntax.coded import Coded
from mlnlite.syntax.facts import FactTable
from mlnlite.syntax.pieces import Piece

Number = TypeVar("Number", bound=np.generic)

LARGE = 1 << 20
"""So many facts about a predicate make a table of their own."""


@dataclass(slots=True)
class Progress:
    """Where reading is: the number of the database, and whether nothing has been read since its `---`."""

    database: int = 0
    separator: bool = False


@dataclass(slots=True)
class _Single:
    """Rows that come one by one; `words` of all rows, one after the other."""

    words: list[str] = field(default_factory=list)
    truth: list[bool] = field(default_factory=list)
    database: list[int] = field(default_factory=list)
    offset: list[int] = field(default_factory=list)
    weight: list[float] = field(default_factory=list)


# What tells tables apart: the source, the predicate, the number of arguments, whether it is soft evidence.
_Key = tuple[Source, str, int, bool]


@dataclass(slots=True)
class Rows:
    """All facts so far, by table.

    Attributes:
        words: the words that those not read in bulk consist of, and their numbers.
        pieces: facts that came in pieces.
        bulk: those that came in bulk.
        single: facts that came one by one.
        large: pieces that became one, so that their memory serves others.
        n: how many facts there are in `bulk`.
    """

    words: dict[str, int] = field(default_factory=dict)
    pieces: dict[_Key, list[Piece]] = field(default_factory=dict)
    bulk: dict[_Key, list[Piece]] = field(default_factory=dict)
    single: dict[_Key, _Single] = field(default_factory=dict)
    large: list[tuple[_Key, Piece]] = field(default_factory=list)
    n: dict[_Key, int] = field(default_factory=dict)

    def add(self, source: Source, fact: tuple[str, Sequence[str]], truth: bool | float, place: tuple[int, int]) -> None:
        """Adds one fact.

        Args:
            source: where it is from.
            fact: predicate and arguments.
            truth: whether it is true, or its log-odds if it is soft evidence.
            place: number of its database, and where in the source it starts.
        """
        predicate, arguments = fact
        soft = not isinstance(truth, bool)
        key = source, predicate, len(arguments), soft
        rows = self.single.get(key)
        if rows is None:
            rows = self.single[key] = _Single()
            self.pieces.setdefault(key, [])
        rows.words += arguments
        rows.truth.append(soft or bool(truth))
        rows.weight.append(truth)
        rows.database.append(place[0])
        rows.offset.append(place[1])

    def add_piece(self, source: Source, piece: Piece) -> None:
        """Adds some facts, whose words have numbers in `words`."""
        key = source, piece.predicate, len(piece.words), piece.weight is not None
        self.pieces.setdefault(key, []).append(piece)

    def add_bulk(self, source: Source, piece: Piece) -> None:
        """Adds many facts, whose words have numbers of their own."""
        key = source, piece.predicate, len(piece.words), piece.weight is not None
        self.pieces.setdefault(key, [])
        pieces = self.bulk.setdefault(key, [])
        pieces.append(piece)
        self.n[key] = self.n.get(key, 0) + len(piece.truth)
        if self.n[key] >= LARGE:
            self.large.append((key, _whole(pieces)))
            self.n[key] = 0

    def tables(self, words: Sequence[str] = ()) -> list[FactTable]:
        """All facts, as tables in the order of their sources and first facts; `words`: those of the facts in bulk."""
        sources = {id(key[0]): rank for rank, key in reversed(list(enumerate(self.pieces)))}
        for key, single in self.single.items():
            self.pieces[key].append(_piece(key, single, self.words))
        names = words or list(self.words)
        if self.words and words:
            numbers = dict(zip(words, range(len(words)), strict=True))
            number = np.array([numbers.setdefault(word, len(numbers)) for word in self.words], np.int32)
            names = list(numbers)
            for pieces in self.pieces.values():
                pieces[:] = [replace(p, words=tuple(number[w] for w in p.words)) for p in pieces]
        rest = [(key, _whole(parts)) for key, p in self.pieces.items() if (parts := self.bulk.get(key, []) + p)]
        self.bulk.clear()
        tables = [_table(key, piece, names) for key, piece in [*self.large, *rest]]
        return sorted(tables, key=lambda table: (sources[id(table.source)], table.offset[0]))


def _piece(key: _Key, rows: _Single, numbers: dict[str, int]) -> Piece:
    """Rows that came one by one; `numbers` gains their words."""
    _, predicate, arity, soft = key
    words = np.array([numbers.setdefault(word, len(numbers)) for word in rows.words], np.int32)
    return Piece(
        predicate,
        tuple(words[i::arity] for i in range(arity)),
        np.array(rows.truth, np.bool_),
        np.array(rows.database, np.int32),
        np.array(rows.offset, np.int64),
        np.array(rows.weight, np.float64) if soft else None,
    )


def _table(key: _Key, piece: Piece, names: Sequence[str]) -> FactTable:
    columns = tuple(Coded(names, words) for words in piece.words)
    return FactTable(key[1], columns, piece.truth, piece.database, piece.weight, piece.offset, key[0])


def _whole(pieces: list[Piece]) -> Piece:
    """Pieces as one, facts in their order; the pieces go when they are part of it."""
    words = [[piece.words[i] for piece in pieces] for i in range(len(pieces[0].words))]
    truth, database = [piece.truth for piece in pieces], [piece.database for piece in pieces]
    offset, weight = [piece.offset for piece in pieces], [piece.weight for piece in pieces if piece.weight is not None]
    predicate = pieces[0].predicate
    pieces.clear()
    offsets = _joined(offset)
    order = np.argsort(offsets) if (offsets[1:] < offsets[:-1]).any() else slice(None)
    columns = tuple(_joined(column)[order] for column in words)
    weights = _joined(weight)[order] if weight else None
    databases = _joined(database)[order]
    if databases[0] == databases[-1] and (databases == databases[0]).all():
        databases = np.broadcast_to(databases[0], len(databases))  # takes no memory
    return Piece(predicate, columns, _joined(truth)[order], databases, offsets[order], weights)


def _joined(parts: list[NDArray[Number]]) -> NDArray[Number]:
    whole: NDArray[Number] = np.concatenate(parts)
    parts.clear()
    return whole
