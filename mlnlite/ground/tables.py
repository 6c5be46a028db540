"""Evidence as tables for the engines, with all that follows from functional predicates drawn.

Tables have the database in their first column. `P.true` and `P.false` hold what is known of predicate P, `P.known` both
with a last column that is `KNOWN_TRUE` or `KNOWN_FALSE`; `type:T` holds the constants of type T, `worlds` the numbers
of the databases.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Column, Tables
from mlnlite.errors import Contradiction, Diagnostic
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.symbols import Predicate

KNOWN_TRUE = -1
KNOWN_FALSE = -2

Int32 = NDArray[np.int32]


def tables_of(evidence: Evidence) -> Tables:
    """The stored tables of all predicates and types."""
    tables: dict[str, tuple[Column, ...]] = {"worlds": (np.arange(evidence.n_databases, dtype=np.int32),)}
    for name, facts in evidence.facts.items():
        tables |= fact_tables(name, facts)
    for name, present in evidence.present.items():
        database, constant = np.nonzero(present)
        tables[f"type:{name}"] = (database.astype(np.int32), constant.astype(np.int32))
    return tables


def fact_tables(name: str, facts: Facts, state: str = "") -> dict[str, tuple[Column, ...]]:
    """The tables of what is known of one predicate, whose names begin with `name` and end with `state`."""
    columns = (facts.database, *facts.arguments.T)
    every = bool(facts.truth.all())
    known = np.int8(KNOWN_FALSE) + facts.truth.view(np.int8) * np.int8(KNOWN_TRUE - KNOWN_FALSE)
    return {
        f"{name}.true{state}": columns if every else tuple(c[facts.truth] for c in columns),
        f"{name}.false{state}": tuple(c[:0] if every else c[~facts.truth] for c in columns),
        f"{name}.known{state}": (*columns, known),
    }


def completed(evidence: Evidence) -> Evidence:
    """Evidence with what the known values of functional predicates say about the other values.

    Raises:
        Contradiction: if a block that must have a value can have none.
    """
    functional = [p for p in evidence.predicates.values() if p.value is not None and len(evidence.facts[p.name].truth)]
    if not functional:
        return evidence
    facts = {**evidence.facts, **{p.name: _completed(p, evidence) for p in functional}}
    return replace(evidence, facts=facts)


def _completed(predicate: Predicate, evidence: Evidence) -> Facts:
    facts, value = evidence.facts[predicate.name], predicate.value
    assert value is not None
    present = evidence.present[predicate.types[value]]
    rows = np.column_stack([facts.database, facts.arguments])
    column = value + 1
    true = rows[facts.truth]
    if predicate.marker == "!":
        last = _last_values(predicate, rows, facts.truth, evidence)
        true = np.concatenate([true, last])
    others = _other_values(true, column, present)
    every = np.concatenate([true, rows[~facts.truth], others]).astype(np.int32)
    order = np.lexsort(tuple(reversed(every.T)))
    every, truth = every[order], order < len(true)
    new = np.ones(len(every), np.bool_)
    new[1:] = (every[1:] != every[:-1]).any(axis=1)
    both = np.flatnonzero(~new[1:] & (truth[1:] != truth[:-1]))
    _verify_one_value(predicate, every[both], evidence)
    return Facts(every[new, 0], every[new, 1:], truth[new])


def _other_values(true: Int32, column: int, present: NDArray[np.bool_]) -> Int32:
    """For each true row, the rows with every other value."""
    n = present.shape[1]
    rows = np.repeat(true, n, axis=0)
    values = np.tile(np.arange(n, dtype=np.int32), len(true))
    keep = (values != rows[:, column]) & present[rows[:, 0], values]
    rows[:, column] = values
    return np.asarray(rows[keep], np.int32)


def _last_values(predicate: Predicate, rows: Int32, truth: NDArray[np.bool_], evidence: Evidence) -> Int32:
    """Rows that are true because every other value of their block is known to be false."""
    assert predicate.value is not None
    if truth.all():
        return rows[:0]
    column = predicate.value + 1
    present = evidence.present[predicate.types[predicate.value]]
    keys = np.delete(rows, column, axis=1)
    blocks, block = np.unique(keys, axis=0, return_inverse=True)
    block = block.reshape(-1)
    n_values = present.sum(axis=1)[blocks[:, 0]]
    n_false = np.bincount(block, weights=~truth, minlength=len(blocks))
    has_true = np.bincount(block, weights=truth, minlength=len(blocks)) > 0
    _verify_some_value(predicate, blocks[(n_false == n_values) & ~has_true], evidence)
    found = []
    for i in np.flatnonzero((n_false == n_values - 1) & ~has_true):
        left = np.setdiff1d(np.flatnonzero(present[blocks[i, 0]]), rows[block == i, column])
        found.append(np.insert(blocks[i], column, left[0]))
    return np.array(found, np.int32).reshape(-1, rows.shape[1])


def _verify_one_value(predicate: Predicate, wrong: Int32, evidence: Evidence) -> None:
    if len(wrong):
        names = [evidence.types[t].constants[c] for t, c in zip(predicate.types, wrong[0, 1:], strict=True)]
        message = f"the evidence makes {predicate.name}({', '.join(names)}) true and false"
        hint = f"{predicate} has at most one true value"
        raise Contradiction([Diagnostic("E401", message, predicate.span, hint)])


def _verify_some_value(predicate: Predicate, empty: Int32, evidence: Evidence) -> None:
    if len(empty):
        types = [predicate.types[k] for k in predicate.keys]
        names = [evidence.types[t].constants[c] for t, c in zip(types, empty[0, 1:], strict=True)]
        block = f"{predicate.name}({', '.join([*names, '...'])})"
        message = f"the evidence makes every value of {block} false, and {predicate} has exactly one true value"
        raise Contradiction([Diagnostic("E401", message, predicate.span, "remove one of the negative facts")])
