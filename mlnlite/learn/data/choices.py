"""Entries to choices: every atom or block is a choice among values, compared with the one it has in the data.

The pseudo-log-likelihood is `- sum_u many_u log(1 + sum_{r of u} times_r exp(-x_r w))`, where row `x_r` holds, for
each weight, how many more of its groundings are true with the value in the data than with alternative `r`. Equal rows
and equal choices are kept once: what is left is often a handful.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.errors import Diagnostic, EvidenceMistake
from mlnlite.ground.compile import strides
from mlnlite.learn.data.counts import Entries
from mlnlite.learn.data.merge import Choices, Listed, merged
from mlnlite.model.evidence import Evidence
from mlnlite.model.symbols import Predicate

Int64 = NDArray[np.int64]


def choices(entries: Mapping[str, Entries], evidence: Evidence, n_weights: int) -> Choices:
    """The choices of the target predicates.

    Args:
        entries: of each target predicate.
        evidence: the complete data.
        n_weights: number of weights.

    Raises:
        EvidenceMistake: if a block that must have a value has none.
    """
    return merged(listed(entries, evidence, n_weights), n_weights)


def listed(entries: Mapping[str, Entries], evidence: Evidence, n_weights: int) -> list[Listed]:
    """The choices of each target predicate, one by one, as `choices` gathers them."""
    found = []
    for name, of_name in sorted(entries.items()):
        predicate = evidence.predicates[name]
        kind = _binary if predicate.value is None else _blocks
        found.append(kind(predicate, of_name, evidence, n_weights))
    return found


def _untouched(
    predicate: Predicate, database: Int64, n_values: Int64, evidence: Evidence
) -> tuple[int, NDArray[np.float64]]:
    """Number of choices of a predicate, and in each database the log-likelihood of those that no formula touches.

    Args:
        predicate: which.
        database: of each touched choice.
        n_values: number of values of each choice in each database.
        evidence: the data.
    """
    sizes = [evidence.present[predicate.types[k]].sum(axis=1).astype(float) for k in predicate.keys]
    n_of_each = np.asarray(np.prod([np.ones(evidence.n_databases), *sizes], axis=0))
    left = n_of_each - np.bincount(database, minlength=evidence.n_databases)
    return int(n_of_each.sum()), np.asarray(-left * np.log(np.maximum(n_values, 1)), float)


def _n_atoms(predicate: Predicate, evidence: Evidence) -> int:
    return int(np.prod(evidence.sizes(predicate.name), dtype=object))


def _keys(predicate: Predicate, database: Int64, atom: Int64, evidence: Evidence) -> Int64:
    """One number for each atom of each database, in their order."""
    within = atom - evidence.first_atom()[predicate.name]
    return database.astype(np.int64) * np.int64(_n_atoms(predicate, evidence)) + within


def _starts(key: Int64) -> Int64:
    """Where each run of equal keys starts."""
    return np.flatnonzero(np.diff(key, prepend=-1))


def _runs(starts: Int64, n: int) -> Int64:
    """Number of the run that each of n places is in."""
    return np.repeat(np.arange(len(starts)), np.diff(np.append(starts, n)))


def _facts_true(predicate: Predicate, evidence: Evidence) -> Int64:
    """Keys of the atoms that are true."""
    facts = evidence.facts[predicate.name]
    atoms = evidence.atom_number(predicate.name, facts.arguments[facts.truth])
    return _keys(predicate, facts.database[facts.truth].astype(np.int64), atoms, evidence)


def _binary(predicate: Predicate, found: Entries, evidence: Evidence, n_weights: int) -> Listed:
    """One alternative for each touched atom: the other truth value."""
    key = _keys(predicate, found.database, found.atom, evidence)
    starts = _starts(key)
    sign = np.where(np.isin(key[starts], _facts_true(predicate, evidence)), 1.0, -1.0)
    data = found.change * np.repeat(sign, np.diff(np.append(starts, len(key))))
    matrix = sparse.csr_array((data, found.weight, np.append(starts, len(key))), shape=(len(starts), n_weights))
    world = found.database[starts]
    n, constant = _untouched(predicate, world, np.full(evidence.n_databases, 2), evidence)
    return Listed(matrix, np.ones(len(starts)), np.arange(len(starts)), world, found.atom[starts], n, constant)


def _blocks(predicate: Predicate, found: Entries, evidence: Evidence, n_weights: int) -> Listed:
    """For each touched block: its listed values other than the true one, and one row for all values without entries."""
    assert predicate.value is not None
    n_values = evidence.present[predicate.types[predicate.value]].sum(axis=1) + (predicate.marker == "?")
    key = _keys(predicate, found.database, found.atom, evidence)
    option_key = key[_starts(key)]
    change = sparse.csr_array(
        (found.change.astype(float), found.weight, np.append(_starts(key), len(key))),
        shape=(len(option_key), n_weights),
    )
    first, value = _split(predicate, option_key, evidence)
    blocks, at, block = np.unique(first, return_index=True, return_inverse=True)
    world = blocks // _n_atoms(predicate, evidence)
    of_true = value == _true_values(predicate, blocks, evidence)[block]
    own = np.full(len(blocks), len(option_key))
    own[block[of_true]] = np.flatnonzero(of_true)
    change = sparse.csr_array(sparse.vstack([change, sparse.csr_array((1, n_weights))]))
    others = np.flatnonzero(~of_true)
    n_silent = n_values[world] - 1 - np.bincount(block[others], minlength=len(blocks))
    silent = np.flatnonzero(n_silent > 0)
    matrix = sparse.csr_array(sparse.vstack([change[own[block[others]]] - change[others], change[own[silent]]]))
    choice = np.concatenate([block[others], silent])
    times = np.concatenate([np.ones(len(others)), n_silent[silent].astype(float)])
    order = np.argsort(choice, kind="stable")
    n, constant = _untouched(predicate, world, n_values, evidence)
    unit = option_key[at] % _n_atoms(predicate, evidence) + evidence.first_atom()[predicate.name]
    return Listed(sparse.csr_array(matrix[order]), times[order], choice[order], world, unit, n, constant)


def _split(predicate: Predicate, key: Int64, evidence: Evidence) -> tuple[Int64, Int64]:
    """Key of the first atom of each atom's block, and each atom's value in it."""
    assert predicate.value is not None
    stride = strides(evidence, predicate.name)[predicate.value]
    value = key % _n_atoms(predicate, evidence) // stride % evidence.sizes(predicate.name)[predicate.value]
    return key - value * stride, value


def _true_values(predicate: Predicate, blocks: Int64, evidence: Evidence) -> Int64:
    """Value of each block, given by the key of its first atom; -1 for none."""
    first, value = _split(predicate, np.sort(_facts_true(predicate, evidence)), evidence)
    order = np.argsort(first, kind="stable")
    first, value = np.append(first[order], -1), np.append(value[order], -1)
    at = np.minimum(np.searchsorted(first[:-1], blocks), len(first) - 1)
    true = np.where(first[at] == blocks, value[at], -1)
    if predicate.marker == "!" and (true < 0).any():
        raise _no_value(predicate, int(blocks[np.flatnonzero(true < 0)[0]]), evidence)
    return true


def _no_value(predicate: Predicate, block: int, evidence: Evidence) -> EvidenceMistake:
    world, within = divmod(block, _n_atoms(predicate, evidence))
    name, arguments = evidence.atom_at(within + evidence.first_atom()[predicate.name])
    constants = [evidence.types[predicate.types[k]].constants[arguments[k]] for k in predicate.keys]
    message = f"{name}({', '.join([*constants, '...'])}) has no value in {evidence.names[world]}"
    hint = (
        f"{replace(predicate, closed=False)} has exactly one true value for each block; say which, or mark it unknown"
    )
    return EvidenceMistake([Diagnostic("E320", message, predicate.span, hint)])
