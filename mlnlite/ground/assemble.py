"""Pieces of all templates to one network: atoms and blocks get small numbers, equal factors merge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.compile import strides
from mlnlite.ground.network import Clauses, Network, Tables
from mlnlite.ground.residual import ClauseShape, TableShape
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.model.symbols import Predicate

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Piece:
    """Ground formulas of one template that have one shape.

    Attributes:
        atoms: shape (n, k), atom numbers in the order of `shape.atoms`.
        shape: clause or table.
        row: shape (n,), row of the template.
        count: shape (n,), how many groundings.
    """

    atoms: Int64
    shape: ClauseShape | TableShape
    row: Int64
    count: Int64


@dataclass(frozen=True, slots=True)
class Part:
    """What a template gives: its open ground formulas, and for each row the numbers of groundings that are decided."""

    pieces: tuple[Piece, ...]
    decided_true: Int64
    decided_false: Int64

    @property
    def n_groundings(self) -> Int64:
        """Number of groundings of each row."""
        total = self.decided_true + self.decided_false
        for piece in self.pieces:
            total = total + np.bincount(piece.row, piece.count, len(total)).astype(np.int64)
        return total


def network_of(model: Model, evidence: Evidence, parts: Sequence[Part], query: Int64 | None) -> Network:
    """The network of the parts of all templates.

    Args:
        model: with expanded templates.
        evidence: completed.
        parts: one for each template.
        query: numbers of further atoms that are to be in the network unless they are known.
    """
    touched = [p.atoms.ravel() for part in parts for p in part.pieces]
    asked = np.empty(0, np.int64) if query is None else _unknown(np.unique(query), evidence)
    atoms, block = _with_blocks(np.unique(np.concatenate([asked, *touched])), evidence)
    variable, value, cardinality, is_block = _variables(atoms, block, evidence)
    first = np.cumsum([0, *(len(part.decided_true) for part in parts)])
    sizes = np.diff(first)
    network = Network(
        model=model,
        evidence=evidence,
        atoms=atoms,
        variable=variable,
        value=value,
        cardinality=cardinality,
        block=is_block,
        clauses=_clauses(parts, first, atoms),
        tables=_tables(parts, first, atoms),
        weights=np.concatenate([np.empty(0), *(t.weights for t in model.templates)]),
        template=np.repeat(np.arange(len(parts), dtype=np.int32), sizes),
        decided_true=np.concatenate([np.empty(0, np.int64), *(part.decided_true for part in parts)]),
        n_groundings=np.concatenate([np.empty(0, np.int64), *(part.n_groundings for part in parts)]),
    )
    _lock(network)
    return network


def _lock(network: Network) -> None:
    for name in ("atoms", "variable", "value", "cardinality", "block", "weights", "decided_true", "n_groundings"):
        getattr(network, name).setflags(write=False)


# --- atoms and variables


def known_atoms(predicate: Predicate, evidence: Evidence) -> Int64:
    """Numbers of the atoms of a predicate that are facts."""
    return evidence.atom_number(predicate.name, evidence.facts[predicate.name].arguments)


def _unknown(atoms: Int64, evidence: Evidence) -> Int64:
    """Those of some atoms that evidence does not decide."""
    keep = np.ones(len(atoms), bool)
    for predicate in evidence.predicates.values():
        low, high = atom_range(predicate, evidence)
        mine = (atoms >= low) & (atoms < high)
        if predicate.closed:
            keep[mine] = False
        elif mine.any():
            keep[mine] = ~np.isin(atoms[mine], known_atoms(predicate, evidence))
    return atoms[keep]


def atom_range(predicate: Predicate, evidence: Evidence) -> tuple[int, int]:
    """Numbers of the first atom of a predicate, and of the first after it."""
    low = evidence.first_atom()[predicate.name]
    return low, low + int(np.prod(evidence.sizes(predicate.name), dtype=object))


def _with_blocks(atoms: Int64, evidence: Evidence) -> tuple[Int64, Int64]:
    """The atoms and the other open atoms of their blocks, and for each the number of its block's first atom, or -1."""
    blocks = np.full(len(atoms), -1, np.int64)
    for predicate in evidence.predicates.values():
        if predicate.value is None:
            continue
        low, high = atom_range(predicate, evidence)
        mine = (atoms >= low) & (atoms < high)
        stride = strides(evidence, predicate.name)[predicate.value]
        size = evidence.sizes(predicate.name)[predicate.value]
        first = np.unique(_first_of_block(atoms[mine], low, stride, size))
        values = np.flatnonzero(evidence.present[predicate.types[predicate.value]][0])
        members = (first[:, None] + values[None, :] * stride).ravel()
        members = members[~np.isin(members, known_atoms(predicate, evidence))]
        atoms = np.concatenate([atoms[~mine], members])
        blocks = np.concatenate([blocks[~mine], _first_of_block(members, low, stride, size)])
    order = np.argsort(atoms)
    return atoms[order], blocks[order]


def _first_of_block(atoms: Int64, low: int, stride: int, size: int) -> Int64:
    value = (atoms - low) // stride % size
    return np.asarray(atoms - value * stride, np.int64)


def _variables(atoms: Int64, block: Int64, evidence: Evidence) -> tuple[Int32, Int32, Int32, NDArray[np.bool_]]:
    """Variable and value of each atom; cardinality of each variable and whether it is a block."""
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


# --- factors


def _clauses(parts: Sequence[Part], first: Int64, atoms: Int64) -> tuple[Clauses, ...]:
    gathered: dict[tuple[int, bool], list[tuple[Int32, Int32, Int64]]] = {}
    for part, offset in zip(parts, first, strict=False):
        for piece in part.pieces:
            if isinstance(piece.shape, ClauseShape):
                literals = (np.searchsorted(atoms, piece.atoms) + 1).astype(np.int32)
                literals *= np.where(piece.shape.signs, 1, -1).astype(np.int32)
                order = np.argsort(np.abs(literals), axis=1)
                item = (np.take_along_axis(literals, order, 1), (piece.row + offset).astype(np.int32), piece.count)
                gathered.setdefault((literals.shape[1], piece.shape.negated), []).append(item)
    blocks = []
    for (_, negated), items in sorted(gathered.items()):
        literals, weight, count = (np.concatenate(c) for c in zip(*items, strict=True))
        blocks.append(Clauses(*_merged(literals, weight, count), negated))
    return tuple(blocks)


def _tables(parts: Sequence[Part], first: Int64, atoms: Int64) -> tuple[Tables, ...]:
    gathered: dict[tuple[int, bytes], list[tuple[Int32, Int32, Int64]]] = {}
    for part, offset in zip(parts, first, strict=False):
        for piece in part.pieces:
            if isinstance(piece.shape, TableShape):
                index = np.searchsorted(atoms, piece.atoms).astype(np.int32)
                key = (piece.shape.truth.ndim, piece.shape.truth.tobytes())
                gathered.setdefault(key, []).append((index, (piece.row + offset).astype(np.int32), piece.count))
    blocks = []
    for (n_atoms, truth), items in sorted(gathered.items()):
        index, weight, count = (np.concatenate(c) for c in zip(*items, strict=True))
        index, weight, count = _merged(index, weight, count)
        blocks.append(Tables(index, np.frombuffer(truth, np.bool_).reshape((2,) * n_atoms), weight, count))
    return tuple(blocks)


def _merged(columns: Int32, weight: Int32, count: Int64) -> tuple[Int32, Int32, Int64]:
    """Equal rows with equal weights made one, counts added, in rising order."""
    order = np.lexsort((*reversed(columns.T), weight))
    columns, weight, count = columns[order], weight[order], count[order]
    new = np.ones(len(order), bool)
    new[1:] = (weight[1:] != weight[:-1]) | (columns[1:] != columns[:-1]).any(axis=1)
    starts = np.flatnonzero(new)
    merged = np.add.reduceat(count, starts) if len(starts) else count
    result = (np.ascontiguousarray(columns[starts]), weight[starts], merged.astype(np.int64))
    for array in result:
        array.setflags(write=False)
    return result
