"""Databases to folds: which are tested together, so that what is tested was not seen in training."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mlnlite.model.evidence import Evidence, Facts

Int64 = NDArray[np.int64]
Row: TypeAlias = tuple[str, ...]
By: TypeAlias = Literal["database", "cluster", "key"]


def select(evidence: Evidence, chosen: Int64) -> Evidence:
    """Some of the databases, in rising order of their numbers."""
    number = np.full(evidence.n_databases, -1, np.int32)
    number[chosen] = np.arange(len(chosen), dtype=np.int32)
    facts = {}
    for name, table in evidence.facts.items():
        keep = number[table.database] >= 0
        facts[name] = Facts(number[table.database[keep]], table.arguments[keep], table.truth[keep])
    present = {name: p[chosen] for name, p in evidence.present.items()}
    names = tuple(evidence.names[i] for i in chosen.tolist())
    return replace(evidence, facts=facts, present=present, n_databases=len(chosen), names=names)


def without_facts(evidence: Evidence, predicates: Iterable[str]) -> Evidence:
    """The databases without the facts about some predicates."""
    facts = dict(evidence.facts)
    for name in predicates:
        arity = evidence.predicates[name].arity
        facts[name] = Facts(np.empty(0, np.int32), np.empty((0, arity), np.int32), np.empty(0, np.bool_))
    return replace(evidence, facts=facts)


def fact_texts(evidence: Evidence, predicates: Iterable[str]) -> list[Row]:
    """The facts of each database about some predicates, in order."""
    found: list[list[str]] = [[] for _ in range(evidence.n_databases)]
    for name in predicates:
        table, columns = evidence.facts[name], []
        for column, type_name in zip(table.arguments.T, evidence.predicates[name].types, strict=True):
            constants = evidence.types[type_name].constants
            columns.append([constants[c] for c in column.tolist()])
        rows = zip(*columns, strict=True) if columns else [()] * len(table.truth)
        for i, truth, row in zip(table.database.tolist(), table.truth.tolist(), rows, strict=True):
            found[i].append(f"{'' if truth else '!'}{name}({', '.join(row)})")
    return [tuple(sorted(texts)) for texts in found]


def groups(evidence: Evidence, by: By, key: Sequence[str] = ()) -> Int64:
    """The group of each database; databases of one group are in one fold.

    Args:
        evidence: the databases.
        by: `database`, each by itself; `cluster`, equal ones together; `key`, those with equal facts about `key`.
        key: predicates.
    """
    if by == "database":
        return np.arange(evidence.n_databases)
    texts = fact_texts(evidence, key if by == "key" else evidence.predicates)
    number: dict[Row, int] = {}
    return np.array([number.setdefault(t, len(number)) for t in texts], np.int64)


def folds(group: Int64, n_folds: int, random: np.random.Generator) -> Int64:
    """The fold of each database: groups in random order, each to the fold that is smallest so far."""
    n_groups = int(group.max(initial=-1)) + 1
    size, fold = np.bincount(group, minlength=n_groups), np.zeros(n_groups, np.int64)
    filled = np.zeros(min(n_folds, max(1, n_groups)), np.int64)
    for g in random.permutation(n_groups).tolist():
        fold[g] = int(filled.argmin())
        filled[fold[g]] += size[g]
    return fold[group]
