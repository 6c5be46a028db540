"""Facts by columns, as tables give them: every constant once, and for each row the number of its constant."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mlnlite.source import Source

Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Coded:
    """A column: its distinct constants, and for each row which one, -1 for none (NULL)."""

    names: list[str]
    codes: Int64


@dataclass(frozen=True, slots=True)
class CodedTable:
    """Facts about one predicate, by columns.

    Attributes:
        predicate: its name.
        columns: one for each argument.
        truth: shape (n,).
        database: shape (n,), all 0.
        offset: shape (n,), number of each row, from 0.
        soft: shape (n,), log-odds of rows that are soft evidence, or None.
        cuts: for each argument its cut points, if it was divided into bins.
    """

    predicate: str
    columns: tuple[Coded, ...]
    truth: NDArray[np.bool_]
    database: NDArray[np.int32]
    offset: Int64
    soft: NDArray[np.float64] | None
    cuts: dict[int, tuple[float, ...]]


@dataclass(frozen=True)
class RowSource(Source):
    """A table as a source of messages: its lines are its rows, the first one after the header being 2."""

    columns: tuple[Coded, ...] = field(default=(), repr=False)
    predicate: str = ""

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of row `offset`."""
        return offset + 2, 1

    def line(self, number: int) -> str:
        """Row `number` as a fact."""
        words = (c.names[c.codes[number - 2]] for c in self.columns)
        return f"{self.predicate}({', '.join(words)})"
