"""Databases to folds: which are tested together, so that what is tested was not seen in training."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from mlnlite.model.evidence import Evidence, Facts

Int64 = NDArray[np.int64]
Row: TypeAlias = tuple[str, ...]
By: TypeAlias = Literal["database", "cluster", "key", "constant"]

MOST_STRATA = 50
"""Kinds of databases up to which folds are made alike."""


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
        by: `database`, each by itself; `cluster`, equal ones together; `key`, those with equal facts about `key`;
            `constant`, those that mention a common constant of the types of `key`.
        key: predicates or types.
    """
    if by == "database":
        return np.arange(evidence.n_databases)
    if by == "constant":
        return _sharing(evidence, key)
    texts = fact_texts(evidence, key if by == "key" else evidence.predicates)
    number: dict[Row, int] = {}
    return np.array([number.setdefault(t, len(number)) for t in texts], np.int64)


def _sharing(evidence: Evidence, types: Sequence[str]) -> Int64:
    """Databases that are linked by constants of some types that facts of both mention."""
    n = evidence.n_databases
    databases, constants, first = [np.empty(0, np.int64)], [np.empty(0, np.int64)], n
    for name in types:
        for predicate, table in evidence.facts.items():
            for column, kind in zip(table.arguments.T, evidence.predicates[predicate].types, strict=True):
                if kind == name:
                    databases.append(table.database.astype(np.int64))
                    constants.append(column.astype(np.int64) + first)
        first += len(evidence.types[name].constants)
    ends = np.concatenate(databases), np.concatenate(constants)
    graph = sparse.csr_array((np.ones(len(ends[0])), ends), shape=(first, first))
    return np.asarray(np.unique(connected_components(graph, directed=False)[1][:n], return_inverse=True)[1], np.int64)


def folds(group: Int64, label: Int64, n_folds: int, random: np.random.Generator) -> Int64:
    """The fold of each database: whole groups, those with uneven labels first, each to where labels stay most even.

    Args:
        group: of each database.
        label: of each database, from 0; the folds get like shares of each.
        n_folds: how many at most.
        random: order of groups that are alike.
    """
    n_groups, n_labels = int(group.max(initial=-1)) + 1, int(label.max(initial=0)) + 1
    counts = np.zeros((n_groups, n_labels))
    np.add.at(counts, (group, label), 1.0)
    order = random.permutation(n_groups)
    order = order[np.argsort(-counts[order].std(axis=1), kind="stable")]
    total, fold = counts.sum(axis=0), np.zeros(n_groups, np.int64)
    filled = np.zeros((min(n_folds, max(1, n_groups)), n_labels))
    grow = np.eye(len(filled))[:, :, None]
    for g in order.tolist():
        uneven = ((filled + grow * counts[g]) / total).std(axis=1).mean(axis=1)
        fold[g] = np.lexsort((filled.sum(axis=1), uneven.round(12)))[0]
        filled[fold[g]] += counts[g]
    return fold[group]


def strata(evidence: Evidence, predicates: Sequence[str]) -> Int64:
    """For each database the number of its facts' kind, so that folds can be alike; all 0 if there are too many kinds.

    The kind is what the facts about the predicates say but for their keys: the values of functional predicates, and
    how many facts there are of the others.
    """
    kinds: dict[tuple[Row, ...], int] = {}
    texts = [_values(evidence, name) for name in predicates]
    found = [kinds.setdefault(t, len(kinds)) for t in zip(*texts, strict=True)]
    return np.array(found if len(kinds) <= MOST_STRATA else [0] * len(found), np.int64)


def _values(evidence: Evidence, name: str) -> list[Row]:
    predicate, table = evidence.predicates[name], evidence.facts[name]
    found: list[list[str]] = [[] for _ in range(evidence.n_databases)]
    true = table.truth
    column = np.zeros(int(true.sum()), np.int32) if predicate.value is None else table.arguments[true, predicate.value]
    for i, value in zip(table.database[true].tolist(), column.tolist(), strict=True):
        found[i].append(str(value))
    return [tuple(sorted(values)) for values in found]
