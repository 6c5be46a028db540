"""Entries to choices: every atom or block is a choice among values, compared with the one it has in the data.

The pseudo-log-likelihood is `- sum_u many_u log(1 + sum_{r of u} times_r exp(-x_r w))`, where row `x_r` holds, for
each weight, how many more of its groundings are true with the value in the data than with alternative `r`. Equal rows
and equal choices are kept once: what is left is often a handful.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.errors import Diagnostic, EvidenceMistake
from mlnlite.ground.compile import strides
from mlnlite.learn.counts import Entries
from mlnlite.model.evidence import Evidence
from mlnlite.model.symbols import Predicate

Int64 = NDArray[np.int64]
UInt64 = NDArray[np.uint64]


@dataclass(frozen=True, slots=True)
class Choices:
    """All choices, those with the same rows once.

    Attributes:
        rows: shape (n_rows, n_weights), sparse; row `r` is an alternative of choice `choice[r]`.
        log_times: shape (n_rows,), logarithm of how many alternatives of the choice have this row.
        choice: shape (n_rows,), rising.
        many: shape (n_choices,), how many choices of the data look like this.
        n_choices: number of all choices in the data, those included that no formula touches.
        constant: what the untouched choices add to the pseudo-log-likelihood.
    """

    rows: sparse.csr_array
    log_times: NDArray[np.float64]
    choice: Int64
    many: NDArray[np.float64]
    n_choices: int
    constant: float


def choices(entries: Mapping[str, Entries], evidence: Evidence, n_weights: int) -> Choices:
    """The choices of the target predicates.

    Args:
        entries: of each target predicate.
        evidence: the complete data.
        n_weights: number of weights.

    Raises:
        EvidenceMistake: if a block that must have a value has none.
    """
    rows, times, choice, constant, n_all, n_listed = [], [], [], 0.0, 0, 0
    for name, found in sorted(entries.items()):
        predicate = evidence.predicates[name]
        if predicate.value is None:
            part, part_times, part_choice, n_values = _binary(predicate, found, evidence, n_weights)
        else:
            part, part_times, part_choice, n_values = _blocks(predicate, found, evidence, n_weights)
        touched = int(part_choice.max(initial=-1)) + 1
        n_of_each = _n_choices(predicate, evidence)
        rows.append(part)
        times.append(part_times)
        choice.append(part_choice + n_listed)
        n_listed += touched
        n_all += int(n_of_each.sum())
        logs = np.log(np.maximum(n_values, 1))
        constant -= float((n_of_each * logs).sum() - logs[_world_of(found, predicate, evidence)].sum())
    matrix = sparse.csr_array(sparse.vstack(rows)) if rows else sparse.csr_array((0, n_weights))
    matrix.sort_indices()
    return _merged(matrix, np.concatenate(times), np.concatenate(choice), n_all, constant)


def _n_choices(predicate: Predicate, evidence: Evidence) -> NDArray[np.float64]:
    """Number of atoms, or of blocks, of a predicate in each database."""
    sizes = [evidence.present[predicate.types[k]].sum(axis=1).astype(float) for k in predicate.keys]
    return np.asarray(np.prod([np.ones(evidence.n_databases), *sizes], axis=0))


def _block_of(predicate: Predicate, atom: Int64, evidence: Evidence) -> tuple[Int64, Int64]:
    """Number of the first atom of each atom's block, and each atom's value in it."""
    assert predicate.value is not None
    stride = strides(evidence, predicate.name)[predicate.value]
    size = evidence.sizes(predicate.name)[predicate.value]
    value = (atom - evidence.first_atom()[predicate.name]) // stride % size
    return atom - value * stride, value


def _world_of(found: Entries, predicate: Predicate, evidence: Evidence) -> Int64:
    """Database of each touched choice."""
    unit = found.atom if predicate.value is None else _block_of(predicate, found.atom, evidence)[0]
    return np.unique(np.column_stack([found.database, unit]), axis=0)[:, 0]


def _facts_true(predicate: Predicate, evidence: Evidence) -> tuple[Int64, Int64]:
    facts = evidence.facts[predicate.name]
    atoms = evidence.atom_number(predicate.name, facts.arguments[facts.truth])
    return facts.database[facts.truth].astype(np.int64), atoms


def _numbered(columns: NDArray[np.int64]) -> tuple[NDArray[np.int64], Int64]:
    names, number = np.unique(columns, axis=0, return_inverse=True)
    return names, number.reshape(-1).astype(np.int64)


def _binary(
    predicate: Predicate, found: Entries, evidence: Evidence, n_weights: int
) -> tuple[sparse.csr_array, NDArray[np.float64], Int64, NDArray[np.float64]]:
    """One alternative for each touched atom: the other truth value."""
    units, unit = _numbered(np.column_stack([found.database, found.atom]))
    true = np.column_stack(_facts_true(predicate, evidence))
    _, number = _numbered(np.concatenate([units, true]))
    is_true = np.isin(number[: len(units)], number[len(units) :])
    sign = np.where(is_true, 1.0, -1.0)
    matrix = sparse.csr_array((found.change * sign[unit], (unit, found.weight)), shape=(len(units), n_weights))
    return matrix, np.ones(len(units)), np.arange(len(units)), np.full(evidence.n_databases, 2.0)


def _blocks(
    predicate: Predicate, found: Entries, evidence: Evidence, n_weights: int
) -> tuple[sparse.csr_array, NDArray[np.float64], Int64, NDArray[np.float64]]:
    """For each touched block: its listed values other than the true one, and one row for all values without entries."""
    assert predicate.value is not None
    n_values = evidence.present[predicate.types[predicate.value]].sum(axis=1) + (predicate.marker == "?")
    block, value = _block_of(predicate, found.atom, evidence)
    blocks, number = _numbered(np.column_stack([found.database, block]))
    true = _true_values(predicate, blocks, evidence)
    options, option = _numbered(np.column_stack([number, value]))
    change = sparse.csr_array((found.change.astype(float), (option, found.weight)), shape=(len(options), n_weights))
    own = np.full(len(blocks), len(options))
    of_true = options[:, 1] == true[options[:, 0]]
    own[options[of_true, 0]] = np.flatnonzero(of_true)
    change = sparse.csr_array(sparse.vstack([change, sparse.csr_array((1, n_weights))]))
    others = np.flatnonzero(~of_true)
    listed = change[own[options[others, 0]]] - change[others]
    n_listed = np.bincount(options[others, 0], minlength=len(blocks))
    n_silent = n_values[blocks[:, 0]] - 1 - n_listed
    silent = np.flatnonzero(n_silent > 0)
    matrix = sparse.csr_array(sparse.vstack([listed, change[own[silent]]]))
    choice = np.concatenate([options[others, 0], silent])
    times = np.concatenate([np.ones(len(others)), n_silent[silent].astype(float)])
    order = np.argsort(choice, kind="stable")
    return sparse.csr_array(matrix[order]), times[order], choice[order], n_values.astype(float)


def _true_values(predicate: Predicate, blocks: NDArray[np.int64], evidence: Evidence) -> Int64:
    """Value of each block (database, first atom); -1 for none."""
    database, atom = _facts_true(predicate, evidence)
    first, value = _block_of(predicate, atom, evidence)
    have = np.column_stack([database, first])
    _, number = _numbered(np.concatenate([blocks, have]))
    of_number = np.full(int(number.max(initial=-1)) + 1, -1, np.int64)
    of_number[number[len(blocks) :]] = value
    true = of_number[number[: len(blocks)]]
    if predicate.marker == "!" and (true < 0).any():
        world, atom_number = blocks[np.flatnonzero(true < 0)[0]]
        name, arguments = evidence.atom_at(int(atom_number))
        constants = [evidence.types[predicate.types[k]].constants[arguments[k]] for k in predicate.keys]
        message = f"{name}({', '.join([*constants, '...'])}) has no value in {evidence.names[world]}"
        hint = f"{predicate} has exactly one true value for each block, and learning needs to know which"
        raise EvidenceMistake([Diagnostic("E320", message, predicate.span, hint)])
    return true


# --- equal rows and equal choices once


def _merged(
    rows: sparse.csr_array, times: NDArray[np.float64], choice: Int64, n_choices: int, constant: float
) -> Choices:
    key = _row_keys(rows)
    order = np.lexsort((key[1], key[0], choice))
    rows, times, choice, key = sparse.csr_array(rows[order]), times[order], choice[order], key[:, order]
    new = np.ones(len(choice), bool)
    new[1:] = (choice[1:] != choice[:-1]) | (key[:, 1:] != key[:, :-1]).any(axis=0)
    start = np.flatnonzero(new)
    times = np.add.reduceat(times, start) if len(start) else times
    choice, key, rows = choice[start], key[:, start], sparse.csr_array(rows[start])
    firsts = np.flatnonzero(np.diff(choice, prepend=-1))
    with np.errstate(over="ignore"):
        mixed = _mixed(key + times.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15))
        of_choice = np.add.reduceat(mixed, firsts, axis=1) if len(firsts) else mixed
    _, kept, many = np.unique(of_choice, axis=1, return_index=True, return_counts=True)
    kept_order = np.argsort(kept)
    kept, many = kept[kept_order], many[kept_order]
    renumbered = np.full(len(firsts), -1, np.int64)
    renumbered[kept] = np.arange(len(kept))
    number = np.repeat(renumbered, np.diff(np.append(firsts, len(choice))))
    keep = np.flatnonzero(number >= 0)
    log_times = np.log(times[keep])
    return Choices(sparse.csr_array(rows[keep]), log_times, number[keep], many.astype(float), n_choices, constant)


def _row_keys(rows: sparse.csr_array) -> UInt64:
    """Two 64-bit sums for each row that are equal for equal rows, and else with chance 2^-128. Shape (2, n_rows)."""
    random = np.random.default_rng(20060101).integers(0, 2**64, (2, rows.shape[1]), dtype=np.uint64)
    values = rows.data.astype(np.int64).astype(np.uint64)
    keys = np.zeros((2, rows.shape[0]), np.uint64)
    filled = np.flatnonzero(np.diff(rows.indptr))
    with np.errstate(over="ignore"):
        for i in range(2):
            products = values * random[i, rows.indices]
            if len(filled):
                keys[i, filled] = np.add.reduceat(products, rows.indptr[filled])
    return keys


def _mixed(keys: UInt64) -> UInt64:
    """Keys stirred (splitmix64), so that sums of them tell sets apart."""
    keys = (keys ^ (keys >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    keys = (keys ^ (keys >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(keys ^ (keys >> np.uint64(31)), np.uint64)
