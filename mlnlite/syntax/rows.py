"""Facts while they are read: rows that come one by one or in pieces, and the tables that they become."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from mlnlite.source import Source
from mlnlite.syntax.coded import Coded, Keys, coded, numbered_words
from mlnlite.syntax.facts import FactTable


@dataclass(slots=True)
class Progress:
    """Where reading is: the number of the database, and whether nothing has been read since its `---`."""

    database: int = 0
    separator: bool = False


@dataclass(frozen=True, slots=True)
class Piece:
    """Facts about one predicate with one number of arguments.

    Attributes:
        predicate: its name.
        words: one for each argument, shape (n, k): see `numbered_words`.
        truth: shape (n,).
        database: shape (n,).
        offset: shape (n,), where in the source each starts.
        weight: shape (n,), log-odds of soft evidence, or None.
    """

    predicate: str
    words: tuple[Keys, ...]
    truth: NDArray[np.bool_]
    database: NDArray[np.int32]
    offset: NDArray[np.int64]
    weight: NDArray[np.float64] | None = None


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
    """All facts so far, by table: those that came in pieces, and those that came one by one."""

    pieces: dict[_Key, list[Piece]] = field(default_factory=dict)
    single: dict[_Key, _Single] = field(default_factory=dict)

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
        """Adds many facts."""
        key = source, piece.predicate, len(piece.words), piece.weight is not None
        self.pieces.setdefault(key, []).append(piece)

    def tables(self) -> list[FactTable]:
        """All facts, as tables in the order of their sources and first facts."""
        sources = {id(key[0]): rank for rank, key in reversed(list(enumerate(self.pieces)))}
        tables = [_table(key, pieces, self.single.get(key, _Single())) for key, pieces in self.pieces.items()]
        return sorted(tables, key=lambda table: (sources[id(table.source)], table.offset[0]))


def _table(key: _Key, pieces: Sequence[Piece], single: _Single) -> FactTable:
    source, predicate, arity, soft = key
    pieces = sorted(pieces, key=lambda p: p.words[0].shape[1] if p.words else 0)
    offset = np.concatenate([*(p.offset for p in pieces), np.array(single.offset, np.int64)])
    truth = np.concatenate([*(p.truth for p in pieces), np.array(single.truth, np.bool_)])
    database = np.concatenate([*(p.database for p in pieces), np.array(single.database, np.int32)])
    weight = np.concatenate([*(p.weight for p in pieces if p.weight is not None), np.array(single.weight, np.float64)])
    columns = [_column([p.words[i] for p in pieces], single.words[i::arity]) for i in range(arity)]
    if (offset[1:] < offset[:-1]).any():
        order = np.argsort(offset)
        offset, truth, database, weight = (
            offset[order],
            truth[order],
            database[order],
            weight[order] if soft else weight,
        )
        columns = [coded(column.codes[order], column.names) for column in columns]
    return FactTable(predicate, tuple(columns), truth, database, weight if soft else None, offset, source)


def _column(pieces: Sequence[Keys], single: Sequence[str]) -> Coded:
    """A column of constants; pieces of equal width stand together."""
    parts = [numbered_words(np.concatenate(list(same))) for _, same in groupby(pieces, key=lambda w: w.shape[1])]
    if single:
        index = {name: i for i, name in enumerate(dict.fromkeys(single))}
        parts.append((np.fromiter(map(index.__getitem__, single), np.int32, len(single)), list(index)))
    if len(parts) == 1:
        return Coded(parts[0][1], parts[0][0])
    index = {}
    numbers = [np.array([index.setdefault(n, len(index)) for n in names], np.int32) for _, names in parts]
    return Coded(list(index), np.concatenate([n[codes] for n, (codes, _) in zip(numbers, parts, strict=True)]))
