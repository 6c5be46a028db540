"""Soft evidence: its columns while they are read, what can be wrong with them, and the templates that it means."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mlnlite.errors import Diagnostic
from mlnlite.model.evidence import Evidence, Facts, SoftFacts
from mlnlite.model.formulas import AtomRef, AtomSchema, Formula, TypedVariable, Var
from mlnlite.model.symbols import Predicate
from mlnlite.model.templates import Template
from mlnlite.source import Span


@dataclass(slots=True)
class SoftColumns:
    """Soft facts about one predicate, in the order of reading; `places` are number of the source and offset in it."""

    database: list[NDArray[np.int32]] = field(default_factory=list)
    arguments: list[NDArray[np.int32]] = field(default_factory=list)
    weight: list[NDArray[np.float64]] = field(default_factory=list)
    places: list[tuple[int, int]] = field(default_factory=list)

    def add(
        self, database: ArrayLike, arguments: ArrayLike, weight: ArrayLike, places: Sequence[tuple[int, int]]
    ) -> None:
        """Adds some facts, one for each place."""
        self.database.append(np.asarray(database, np.int32))
        self.arguments.append(np.asarray(arguments, np.int32).reshape(len(places), -1))
        self.weight.append(np.asarray(weight, np.float64))
        self.places += places

    def facts(self) -> SoftFacts:
        """All of them."""
        return SoftFacts(np.concatenate(self.database), np.concatenate(self.arguments), np.concatenate(self.weight))


def soft_facts(
    columns: SoftColumns, predicate: Predicate, certain: Facts, spans: Sequence[Span], mistakes: list[Diagnostic]
) -> SoftFacts:
    """The soft facts about a predicate; adds a mistake if it is closed, or if an atom is certain."""
    soft = columns.facts()
    if predicate.closed:
        message = f"the world of {predicate.name} is closed, and this fact leaves an atom open"
        hint = "remove the star from its declaration, or use --open-world"
        mistakes.append(Diagnostic("E315", message, spans[0], hint))
        return soft
    known = {row.tobytes() for row in np.column_stack([certain.database, certain.arguments]).astype(np.int32)}
    for i, row in enumerate(np.column_stack([soft.database, soft.arguments]).astype(np.int32) if known else ()):
        if row.tobytes() in known:
            message = f"this fact about {predicate.name} is certain elsewhere and uncertain here"
            mistakes.append(Diagnostic("E313", message, spans[i], "remove one of the two"))
    return soft


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


def of_database(soft: Mapping[str, SoftFacts], index: int) -> dict[str, SoftFacts]:
    """The soft facts of one database, as evidence of its own."""
    found = {}
    for name, facts in soft.items():
        mine = facts.database == index
        if mine.any():
            n = int(mine.sum())
            found[name] = SoftFacts(np.zeros(n, np.int32), facts.arguments[mine], facts.weight[mine])
    return found
