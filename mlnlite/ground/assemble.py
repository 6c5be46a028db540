"""Pieces of all templates to one network: atoms and blocks get small numbers, equal factors merge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.blocks import Piece, blocks_of
from mlnlite.ground.compile import strides
from mlnlite.ground.index import DENSEST
from mlnlite.ground.network import Network
from mlnlite.ground.numbers import atoms_numbered, known_numbers, numbers_of
from mlnlite.model.change import find, places_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.model.symbols import Predicate

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Part:
    """What a template gives.

    Attributes:
        pieces: its open ground formulas.
        decided_true: for each row the number of groundings that evidence makes true.
        decided_false: false.
        n_open: leaves open.
    """

    pieces: tuple[Piece, ...]
    decided_true: Int64
    decided_false: Int64
    n_open: Int64

    @property
    def n_groundings(self) -> Int64:
        """Number of groundings of each row."""
        return self.decided_true + self.decided_false + self.n_open


def sums_by(row: NDArray[Any], count: Int64, n_rows: int) -> Int64:
    """Sums of counts for each row."""
    if n_rows == 1:
        return np.array([count.sum()], np.int64)
    return np.bincount(row, count, n_rows).astype(np.int64)


def network_of(model: Model, evidence: Evidence, parts: Sequence[Part], query: Int64 | None) -> Network:
    """The network of the parts of all templates.

    Args:
        model: with expanded templates.
        evidence: completed.
        parts: one for each template.
        query: numbers of further atoms that are to be in the network unless they are known.
    """
    variables = variables_of(_open_atoms(evidence, parts, query), evidence)
    first = np.cumsum([0, *(len(part.decided_true) for part in parts)])
    pieces = [(p, offset) for part, offset in zip(parts, first.tolist(), strict=False) for p in part.pieces]
    blocks = blocks_of(pieces, variables.atoms, evidence)
    network = Network(
        model=model,
        evidence=evidence,
        atoms=variables.atoms,
        variable=variables.variable,
        value=variables.value,
        cardinality=variables.cardinality,
        block=variables.block,
        clauses=blocks.clauses,
        tables=blocks.tables,
        weights=np.concatenate([np.empty(0), *(t.weights for t in model.templates)]),
        template=np.repeat(np.arange(len(parts), dtype=np.int32), np.diff(first)),
        decided_true=np.concatenate([np.empty(0, np.int64), *(part.decided_true for part in parts)]),
        n_groundings=np.concatenate([np.empty(0, np.int64), *(part.n_groundings for part in parts)]),
        counts=blocks.counts,
    )
    for array in (network.weights, network.decided_true, network.n_groundings):
        array.setflags(write=False)
    return network


# --- atoms and variables


def _open_atoms(evidence: Evidence, parts: Sequence[Part], query: Int64 | None) -> Int64:
    """Numbers of the unknown atoms that some piece has, or that are asked for, rising."""
    asked = np.empty(0, np.int64) if query is None else unknown(distinct([query]), evidence)
    listed = [a for part in parts for p in part.pieces for a in p.atoms]
    n_listed = sum(map(len, listed))
    known = [
        known_numbers(name, evidence)
        for name, predicate in evidence.predicates.items()
        if not predicate.closed and len(evidence.facts[name].truth) < n_listed
    ]
    return atoms_numbered(distinct([numbers_of(asked, evidence), *listed], known), evidence)


def distinct(numbers: Sequence[Int64], others: Sequence[Int64] = ()) -> Int64:
    """All numbers of some arrays, each once, rising.

    Args:
        numbers: arrays.
        others: numbers that are in none of them: an array between whose bounds all others have been seen is left out.
    """
    flat = [(n, int(n.min()), int(n.max())) for n in numbers if n.size]
    if not flat:
        return np.empty(0, np.int64)
    low, high = min(first for _, first, _ in flat), max(last for _, _, last in flat)
    if high - low >= min(DENSEST, 16 * sum(len(n) for n, _, _ in flat) + 4096):
        every = np.sort(np.concatenate([n for n, _, _ in flat]))  # `np.unique`, which hashes, is slower
        return np.asarray(every[np.append(True, every[1:] != every[:-1])])
    seen = np.zeros(high - low + 1, np.bool_)
    never = [n[(n >= low) & (n <= high)] - low for n in others]
    for n in never:
        seen[n] = True
    for n, first, last in sorted(flat, key=lambda item: len(item[0])):
        if not seen[first - low : last - low + 1].all():
            seen[n - low if low else n] = True
    for n in never:
        seen[n] = False
    return np.flatnonzero(seen) + low


def known_atoms(predicate: Predicate, evidence: Evidence) -> Int64:
    """Numbers of the atoms of a predicate that are facts, rising."""
    return evidence.atom_number(predicate.name, evidence.facts[predicate.name].arguments)


def unknown(atoms: Int64, evidence: Evidence) -> Int64:
    """Those of some atoms that evidence does not decide."""
    keep = np.ones(len(atoms), bool)
    for predicate in evidence.predicates.values():
        low, high = atom_range(predicate, evidence)
        mine = (atoms >= low) & (atoms < high)
        if predicate.closed:
            keep[mine] = False
        elif mine.any():
            keep[mine] = ~places_of(evidence, predicate.name, atoms[mine])[1]
    return atoms[keep]


def atom_range(predicate: Predicate, evidence: Evidence) -> tuple[int, int]:
    """Numbers of the first atom of a predicate, and of the first after it."""
    low = evidence.first_atom()[predicate.name]
    return low, low + prod(evidence.sizes(predicate.name))


def _with_blocks(atoms: Int64, evidence: Evidence) -> tuple[Int64, Int64]:
    """The atoms and the other open atoms of their blocks, and for each the number of its block's first atom, or -1."""
    blocks = np.full(len(atoms), -1, np.int64)
    if all(p.value is None for p in evidence.predicates.values()):
        return atoms, blocks
    for predicate in evidence.predicates.values():
        if predicate.value is None:
            continue
        low, high = atom_range(predicate, evidence)
        mine = (atoms >= low) & (atoms < high)
        stride = strides(evidence, predicate.name)[predicate.value]
        first = distinct([first_of_block(atoms[mine], predicate, evidence)])
        values = np.flatnonzero(evidence.present[predicate.types[predicate.value]][0])
        members = (first[:, None] + values[None, :] * stride).ravel()
        members = members[~find(known_atoms(predicate, evidence), members)[1]]
        atoms = np.concatenate([atoms[~mine], members])
        blocks = np.concatenate([blocks[~mine], first_of_block(members, predicate, evidence)])
    order = np.argsort(atoms)
    return atoms[order], blocks[order]


def first_of_block(atoms: Int64, predicate: Predicate, evidence: Evidence) -> Int64:
    """Numbers of the first atoms (known or not) of the blocks of some atoms of a functional predicate."""
    assert predicate.value is not None
    low, _ = atom_range(predicate, evidence)
    stride, size = strides(evidence, predicate.name)[predicate.value], evidence.sizes(predicate.name)[predicate.value]
    value = (atoms - low) // stride % size
    return np.asarray(atoms - value * stride, np.int64)


@dataclass(frozen=True, slots=True)
class Variables:
    """The atoms of a network and its variables; see `Network`."""

    atoms: Int64
    variable: Int32
    value: Int32
    cardinality: Int32
    block: NDArray[np.bool_]


def variables_of(atoms: Int64, evidence: Evidence) -> Variables:
    """The variables of unknown atoms (rising numbers), to which the other open atoms of their blocks come."""
    atoms, block = _with_blocks(atoms, evidence)
    found = Variables(atoms, *_variables(atoms, block, evidence))
    for array in (found.atoms, found.variable, found.value, found.cardinality, found.block):
        array.setflags(write=False)
    return found


def _variables(atoms: Int64, block: Int64, evidence: Evidence) -> tuple[Int32, Int32, Int32, NDArray[np.bool_]]:
    """Variable and value of each atom; cardinality of each variable and whether it is a block."""
    if (block < 0).all():
        single = np.arange(len(atoms), dtype=np.int32)
        return single, np.ones_like(single), np.full_like(single, 2), np.zeros(len(atoms), np.bool_)
    owner = np.where(block >= 0, block, atoms)
    # a block's first atom may be a known one, and then is not among the atoms: owners are numbers of their own kind
    names, number = np.unique(owner * 2 + (block >= 0), return_inverse=True)
    variable: Int32 = number.reshape(-1).astype(np.int32)
    is_block = names % 2 == 1
    order = np.lexsort((atoms, variable))
    start = np.searchsorted(variable[order], np.arange(len(names)))
    within = np.empty(len(atoms), np.int64)
    within[order] = np.arange(len(atoms)) - start[variable[order]]
    none = _may_be_none(names // 2, is_block, evidence)
    value = np.where(is_block[variable], within + none[variable], 1)
    members = np.bincount(variable, minlength=len(names))
    cardinality = np.where(is_block, members + none, 2)
    return variable, value.astype(np.int32), cardinality.astype(np.int32), is_block


def _may_be_none(first: Int64, is_block: NDArray[np.bool_], evidence: Evidence) -> NDArray[np.int64]:
    """1 for blocks `?`, which may have no value; 0 for others."""
    none = np.zeros(len(first), np.int64)
    for predicate in evidence.predicates.values():
        if predicate.marker == "?":
            low, high = atom_range(predicate, evidence)
            none[is_block & (first >= low) & (first < high)] = 1
    return none
