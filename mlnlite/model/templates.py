"""A template is a formula with a table of weights: one row for each combination of constants of its key variables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mlnlite.model.formulas import Formula
from mlnlite.model.numbers import numbers_of
from mlnlite.model.symbols import Type
from mlnlite.source import Span


@dataclass(frozen=True, slots=True)
class Template:
    """A weighted formula, or many that differ only in constants.

    A formula without `+` and without siblings has no keys and one row. `+x` makes x a key. Formulas read from a file
    that differ only in constants and weights share one template whose keys stand for what differs.

    Attributes:
        name: how messages call it, `formula 3`.
        formula: the typed formula, keys being free variables of it.
        keys: indices of the key variables in `formula.variables`.
        rows: constant ids of the keys, shape (n_rows, n_keys); None if every combination of constants has a row, which
            then stands in mixed-radix order of the keys, the last key fastest.
        weights: log weight of each row, shape (n_rows,), `inf` for a hard formula, `nan` where none was given;
            shape (1,), the same for all rows, where `rows` is None and nothing has been learnt.
        fixed: not to be learnt.
        unique: groups of keys (indices into `keys`) whose order does not matter: of the rows that differ only in the
            order of such a group there is one, that with rising ids; equal ones are kept.
        number: which of the keys names the weight of a row: the number that its constant is. Such a template is fixed.
        text: the formula as its user wrote it, keys included.
        span: where (its first row).
        row_spans: where each row stands, if it came from a file row by row.
    """

    name: str
    formula: Formula
    keys: tuple[int, ...]
    rows: NDArray[np.int32] | None
    weights: NDArray[np.float64]
    fixed: bool = False
    unique: tuple[tuple[int, ...], ...] = ()
    number: int | None = None
    text: str = ""
    span: Span | None = field(default=None, compare=False, repr=False)
    row_spans: tuple[Span, ...] = field(default=(), compare=False, repr=False)

    @property
    def hard(self) -> bool:
        """Whether it forbids every world in which some grounding is false."""
        return bool(np.isposinf(self.weights).all())

    def expanded(self, types: Mapping[str, Type]) -> Template:
        """The same template with explicit rows, for the constants of `types`."""
        if self.rows is not None:
            return self
        sizes = [len(types[self.formula.variables[k].type].constants) for k in self.keys]
        rows = np.indices(sizes, np.int32).reshape(len(sizes), -1).T if sizes else np.zeros((1, 0), np.int32)
        keep = np.ones(len(rows), bool)
        for group in self.unique:
            for i, j in pairwise(group):
                keep &= rows[:, i] <= rows[:, j]
        rows = np.ascontiguousarray(rows[keep])
        if self.number is not None:
            numbers = numbers_of(types[self.formula.variables[self.keys[self.number]].type])
            return replace(self, rows=rows, weights=numbers[rows[:, self.number]], number=None)
        return replace(self, rows=rows, weights=np.broadcast_to(self.weights, len(rows)).copy())
