"""Soft evidence: its columns while they are read, what can be wrong with them, and the templates that it means."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.model.evidence import Evidence, Facts, Int32, SoftFacts
from mlnlite.model.formulas import AtomRef, AtomSchema, Formula, TypedVariable, Var
from mlnlite.model.symbols import Predicate
from mlnlite.model.templates import Template


@dataclass(slots=True)
class SoftColumns:
    """Soft facts about one predicate, in the order of reading; `file` and `offset` say where each stands."""

    database: list[NDArray[np.int32]] = field(default_factory=list)
    arguments: list[NDArray[np.int32]] = field(default_factory=list)
    weight: list[NDArray[np.float64]] = field(default_factory=list)
    file: list[int] = field(default_factory=list)
    offset: list[NDArray[np.integer]] = field(default_factory=list)

    def add(
        self,
        database: NDArray[np.int32],
        arguments: NDArray[np.int32],
        weight: NDArray[np.float64],
        file: int,
        offset: NDArray[np.integer],
    ) -> None:
        """Adds some facts of one source."""
        self.database.append(database)
        self.arguments.append(arguments)
        self.weight.append(weight)
        self.file.append(file)
        self.offset.append(offset)

    def facts(self) -> SoftFacts:
        """All of them."""
        return SoftFacts(np.concatenate(self.database), np.concatenate(self.arguments), np.concatenate(self.weight))


def place(columns: Any, row: int) -> tuple[int, int]:  # noqa: ANN401
    """Number of the source of a fact, and its offset there; `columns` has these in pieces, as `SoftColumns` does."""
    for file, offset in zip(columns.file, columns.offset, strict=True):
        if row < len(offset):
            return file, int(offset[row])
        row -= len(offset)
    raise IndexError(row)


def soft_mistakes(soft: SoftFacts, predicate: Predicate, certain: Facts) -> Iterator[tuple[int, str, str, str]]:
    """What is wrong with soft facts: which one, code, message and hint."""
    if predicate.closed:
        message = f"the world of {predicate.name} is closed, and this fact leaves an atom open"
        yield 0, "E315", message, "remove the star from its declaration, or use --open-world"
        return
    if not len(certain.truth):
        return
    known = {row.tobytes() for row in np.column_stack([certain.database, certain.arguments]).astype(np.int32)}
    for i, row in enumerate(np.column_stack([soft.database, soft.arguments]).astype(np.int32)):
        if row.tobytes() in known:
            message = f"this fact about {predicate.name} is certain elsewhere and uncertain here"
            yield i, "E313", message, "remove one of the two"


def soft_templates(evidence: Evidence) -> Iterator[Template]:
    """A template for each predicate with soft evidence: its atom, with the log-odds as weights of its rows.

    The evidence has one database.
    """
    for name, soft in evidence.soft.items():
        if soft.weight.any():
            yield _template(evidence.predicates[name], soft)


def _template(predicate: Predicate, soft: SoftFacts) -> Template:
    variables = tuple(TypedVariable(f"{t}{i + 1}", t) for i, t in enumerate(predicate.types))
    keys = tuple(range(predicate.arity))
    formula = Formula(variables, (AtomSchema(predicate.name, tuple(map(Var, keys))),), AtomRef(0))
    rows, first, of = np.unique(soft.arguments, axis=0, return_index=True, return_inverse=True)
    weights = np.bincount(of.reshape(-1), soft.weight, len(first)).astype(np.float64)
    text = f"{predicate.name}({', '.join(f'+{v.name}' for v in variables)})" if keys else predicate.name
    return Template("soft evidence", formula, keys, rows.astype(np.int32), weights, fixed=True, text=text)


def of_databases(soft: Mapping[str, SoftFacts], number: Int32) -> dict[str, SoftFacts]:
    """The soft facts of some databases.

    Args:
        soft: of all databases.
        number: shape (n_databases,), the new number of each database, -1 for those that are left out.
    """
    found = {}
    for name, facts in soft.items():
        mine = number[facts.database] >= 0
        if mine.any():
            found[name] = SoftFacts(number[facts.database[mine]], facts.arguments[mine], facts.weight[mine])
    return found
