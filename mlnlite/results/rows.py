"""What all answers share: rows with a text each, looked up by it, shown as a table, HTML, JSON or a data frame."""

from __future__ import annotations

import json
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import QueryMistake, did_you_mean
from mlnlite.results.table import SHOWN, data_frame, html_table, text_table

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]
Int64 = NDArray[np.int64]
Value = TypeVar("Value", covariant=True)


class UnknownRowError(QueryMistake, KeyError):
    """A result was asked for an atom or formula that it does not hold."""

    __str__ = Exception.__str__


@dataclass(frozen=True, slots=True)
class Statistics:
    """What an answer took.

    Attributes:
        n_atoms: unknown atoms of the network.
        n_factors: ground formulas that evidence left open, equal ones once.
        n_components: parts of the network that have nothing to do with each other.
        largest_table: number of entries of the largest table.
        seconds: [s] wall time of each stage, in order.
    """

    n_atoms: int = 0
    n_factors: int = 0
    n_components: int = 0
    largest_table: int = 0
    seconds: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        """One line."""
        sizes = f"{self.n_atoms:,} unknown atoms, {self.n_factors:,} factors, {self.n_components:,} components"
        table = f", largest table {self.largest_table:,}" if self.largest_table else ""
        times = "".join(f"; {stage} {seconds:.3f} s" for stage, seconds in self.seconds.items())
        return sizes + table + times

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        names = ("n_atoms", "n_factors", "n_components", "largest_table")
        return {**{n: int(getattr(self, n)) for n in names}, "seconds": dict(self.seconds)}


@dataclass(frozen=True, slots=True, eq=False)
class Rows(Mapping[str, Value]):
    """Answers about atoms and formulas; a mapping from their text to the answer, spaces do not matter.

    Attributes:
        names: text of each atom or formula.
    """

    names: tuple[str, ...]
    _index: dict[str, int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Leaves room for look-up, which the first one prepares."""
        object.__setattr__(self, "_index", {})

    def __iter__(self) -> Iterator[str]:
        """The texts."""
        return iter(self.names)

    def __len__(self) -> int:
        """How many."""
        return len(self.names)

    def row(self, name: str) -> int:
        """Number of the row of a text.

        Raises:
            UnknownRowError: the answer does not hold it.
        """
        if not self._index:  # a text itself goes before what another one is without spaces
            self._index.update({"".join(text.split()): i for i, text in enumerate(self.names)})
            self._index.update({text: i for i, text in enumerate(self.names)})
        row = self._index.get(name, self._index.get("".join(name.split())))
        if row is None:
            raise UnknownRowError(f"the result holds no {name}", hint=did_you_mean(name, self.names))
        return row

    def __str__(self) -> str:
        """A table, of the first rows if there are many."""
        return self.to_text(SHOWN)

    @abstractmethod
    def to_text(self, limit: int | None = None) -> str:
        """A table, predicate by predicate and block by block, of at most `limit` rows."""

    @abstractmethod
    def to_dict(self) -> dict[str, object]:
        """Plain data."""

    @abstractmethod
    def columns(self) -> dict[str, list[Any]]:
        """All that is known of each row, by name of the column."""

    @abstractmethod
    def head(self) -> tuple[str, ...]:
        """Names of the columns of the table."""

    @abstractmethod
    def order(self) -> list[int]:
        """Which rows the table shows, in its order."""

    @abstractmethod
    def cells(self, rows: Sequence[int]) -> list[tuple[str, ...]]:
        """Some rows of the table."""

    def table(self, limit: int | None, foot: Sequence[str]) -> str:
        """The table, of at most `limit` rows, and lines under it."""
        order = self.order()
        shown = order[:limit]
        return text_table(self.head(), self.cells(shown), len(order) - len(shown), foot)

    @abstractmethod
    def caption(self) -> str:
        """The whole in a line."""

    def _repr_html_(self) -> str:
        """A table for notebooks."""
        order = self.order()
        return html_table(self.head(), self.cells(order[:SHOWN]), max(0, len(order) - SHOWN), self.caption())

    def to_json(self, indent: int | None = 2) -> str:
        """JSON text."""
        return json.dumps(self.to_dict(), indent=indent)

    def to_frame(self) -> pd.DataFrame:
        """A pandas data frame, one row for each text.

        Raises:
            MissingPart: pandas is not installed.
        """
        return data_frame(self.columns())
