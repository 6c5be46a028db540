"""Facts as columns: what comes out of `parse_evidence` and of tables, and goes into `check_evidence`."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mlnlite.source import Source, Span
from mlnlite.syntax.coded import Coded
from mlnlite.syntax.tree import TypeDeclaration


@dataclass(frozen=True, slots=True, eq=False)
class FactTable:
    """All facts about one predicate with one number of arguments, in file order, as columns.

    Attributes:
        predicate: its name.
        columns: one for each argument.
        truth: shape (n,): True for `P(a)`, False for `!P(a)`.
        database: shape (n,): which of the databases, separated by `---`, the fact is in (from 0).
        weight: shape (n,), log-odds if the table is soft evidence (`0.7 P(a)`; 0 for `?P(a)`), else None.
        offset: shape (n,): where in the source each fact starts.
        source: where the facts are from.
    """

    predicate: str
    columns: tuple[Coded, ...]
    truth: NDArray[np.bool_]
    database: NDArray[np.int32]
    weight: NDArray[np.float64] | None = None
    offset: NDArray[np.integer] = field(default_factory=lambda: np.empty(0, np.int64), repr=False)
    source: Source = field(default_factory=lambda: Source("<facts>", ""), repr=False)

    def __eq__(self, other: object) -> bool:
        """Whether the facts are the same, wherever they stand."""
        return (
            isinstance(other, FactTable)
            and (self.predicate, self.columns) == (other.predicate, other.columns)
            and np.array_equal(self.truth, other.truth)
            and np.array_equal(self.database, other.database)
            and (self.weight is None) == (other.weight is None)
            and (self.weight is None or other.weight is None or np.allclose(self.weight, other.weight, rtol=1e-12))
        )

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True, slots=True)
class EvidenceProgram:
    """A whole evidence file: facts, constants that it declares, the number of its databases."""

    facts: tuple[FactTable, ...]
    types: tuple[TypeDeclaration, ...]
    n_databases: int
    span: Span | None = field(default=None, compare=False, repr=False)
