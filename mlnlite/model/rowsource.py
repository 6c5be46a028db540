"""A table as a source of messages."""

from __future__ import annotations

from dataclasses import dataclass, field

from mlnlite.source import Source
from mlnlite.syntax.coded import Coded


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
