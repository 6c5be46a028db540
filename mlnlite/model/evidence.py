"""Evidence: what is known, as integer columns, for one database or several."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic
from mlnlite.model.symbols import Predicate, Type

if TYPE_CHECKING:
    from mlnlite.model.model import Model

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of one predicate, each atom once, in order of database and arguments.

    Attributes:
        database: shape (n,), number of the database.
        arguments: shape (n, arity), constant ids.
        truth: shape (n,).
    """

    database: Int32
    arguments: Int32
    truth: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class SoftFacts:
    """Soft evidence about one predicate: `0.7 P(a)` makes worlds with P(a) 0.7/0.3 times as likely as without it.

    This is virtual evidence: a factor, not the probability that comes out. Several about one atom multiply.
    `?P(a)` is the same with 0.5: it says nothing but that the atom is there and open.

    Attributes:
        database: shape (n,), number of the database.
        arguments: shape (n, arity), constant ids.
        weight: shape (n,), log-odds.
    """

    database: Int32
    arguments: Int32
    weight: NDArray[np.float64]


@dataclass(frozen=True)
class Evidence:
    """Facts of one or more databases (worlds that have nothing to do with each other but share a model).

    Attributes:
        types: by name: the constants of the model, then those that the databases add.
        predicates: as in the model, with the closed worlds that were asked for.
        facts: by predicate name; predicates without a fact have an empty table.
        present: by type name, shape (n_databases, n_constants): which constants each database has: those of the model,
            those that its file declares, and those it mentions. A type with a weight for each constant (`+x`) has the
            same constants in all databases.
        n_databases: how many.
        names: where each database is from.
        warnings: what reading found strange.
        soft: by predicate name: soft evidence; predicates without any are left out.
        cuts: for arguments (predicate, index) that were divided into bins, the cut points.
    """

    types: Mapping[str, Type]
    predicates: Mapping[str, Predicate]
    facts: Mapping[str, Facts]
    present: Mapping[str, NDArray[np.bool_]]
    n_databases: int = 1
    names: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = field(default=(), compare=False, repr=False)
    soft: Mapping[str, SoftFacts] = field(default_factory=dict)
    cuts: Mapping[tuple[str, int], tuple[float, ...]] = field(default_factory=dict)

    @staticmethod
    def from_tables(tables: Mapping[str, Any], *, model: Model) -> Evidence:
        """Evidence about one world from tables.

        Args:
            tables: for each predicate a `Table`, or what can be its `source`: a file, a data frame (pandas, Polars,
                Arrow), a mapping from names to columns.
            model: what the facts are about.

        Raises:
            EvidenceMistake: if a table cannot be read or does not fit the model, or facts contradict each other.

        >>> from mlnlite.model.read import model_from_text
        >>> model = model_from_text("Friends(person, person)")
        >>> evidence = Evidence.from_tables({"Friends": {"from": ["Anna"], "to": ["Bob"]}}, model=model)
        >>> evidence.types["person"].constants
        ('Anna', 'Bob')
        """
        from mlnlite.model.read import evidence_of
        from mlnlite.model.table import Table

        given = [(name, t if isinstance(t, Table) else Table(t)) for name, t in tables.items()]
        return evidence_of([], model, together=True, tables=given)

    def sizes(self, predicate: str) -> tuple[int, ...]:
        """Number of constants of each argument of a predicate."""
        return tuple(len(self.types[t].constants) for t in self.predicates[predicate].types)

    def first_atom(self) -> Mapping[str, int]:
        """Number of the first atom of each predicate: atoms are numbered predicate by predicate."""
        return self._first_atom

    @cached_property
    def _first_atom(self) -> dict[str, int]:
        first, at = {}, 0
        for name in self.predicates:
            first[name] = at
            at += prod(self.sizes(name))
        return first

    def atom_number(self, predicate: str, arguments: Int32) -> Int64:
        """Numbers of ground atoms: mixed radix over the arguments, the last one fastest, after `first_atom`.

        Args:
            predicate: its name.
            arguments: shape (n, arity), constant ids.

        Returns:
            Shape (n,).
        """
        number = np.zeros(len(arguments), np.int64)
        for column, size in zip(arguments.T, self.sizes(predicate), strict=True):
            number = number * size + column
        return number + self.first_atom()[predicate]

    def arguments_of(self, predicate: str, numbers: Int64) -> Int32:
        """Constant ids of atoms of a predicate, shape (n, arity), from their numbers: the inverse of `atom_number`."""
        rest, sizes = numbers - self.first_atom()[predicate], self.sizes(predicate)
        arguments = np.empty((len(numbers), len(sizes)), np.int32)
        for i in reversed(range(len(sizes))):
            rest, arguments[:, i] = np.divmod(rest, sizes[i])
        return arguments

    def atom_at(self, number: int) -> tuple[str, tuple[int, ...]]:
        """Predicate and constant ids of atom `number`."""
        first = self.first_atom()
        name = max((n for n, f in first.items() if f <= number and 0 not in self.sizes(n)), key=lambda n: first[n])
        rest, arguments = number - first[name], []
        for size in reversed(self.sizes(name)):
            rest, constant = divmod(rest, size)
            arguments.append(constant)
        return name, tuple(reversed(arguments))

    def is_true(self, numbers: Int64) -> NDArray[np.bool_]:
        """Whether a single database says that atoms are true, for atom numbers of shape (n,)."""
        truth = np.zeros(len(numbers), np.bool_)
        for name, low in self.first_atom().items():
            mine = np.flatnonzero((numbers >= low) & (numbers < low + prod(self.sizes(name))))
            if len(mine):
                facts = self.facts[name]
                true = self.atom_number(name, facts.arguments[facts.truth])
                place = np.searchsorted(true, numbers[mine])
                truth[mine] = np.append(true, -1)[place] == numbers[mine]
        return truth

    def atom_texts(self, numbers: Int64) -> list[str]:
        """Atoms as a user writes them, for rising atom numbers of shape (n,)."""
        texts: list[str] = []
        for name, low in self.first_atom().items():
            sizes = self.sizes(name)
            start, stop = np.searchsorted(numbers, [low, low + prod(sizes)])
            columns: list[list[str]] = []
            for type_name, ids in zip(
                self.predicates[name].types, self.arguments_of(name, numbers[start:stop]).T, strict=True
            ):
                constants = self.types[type_name].constants
                columns.append([constants[i] for i in ids.tolist()])
            if columns:
                texts += [f"{name}({', '.join(row)})" for row in zip(*columns, strict=True)]
            else:
                texts += [name] * int(stop - start)
        return texts

    def atom_text(self, number: int) -> str:
        """Atom `number` as a user writes it: `Friends(Anna, Bob)`."""
        name, arguments = self.atom_at(number)
        types = self.predicates[name].types
        constants = [self.types[t].constants[c] for t, c in zip(types, arguments, strict=True)]
        return f"{name}({', '.join(constants)})" if constants else name
