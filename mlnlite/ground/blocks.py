"""Ground formulas in pieces to the factors of a network, in blocks of one shape each, equal ones merged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.index import Index, index_in
from mlnlite.ground.merge import Group, code_of, merged, merged_codes
from mlnlite.ground.network import Clauses, Counts, Tables
from mlnlite.ground.numbers import numbers_of
from mlnlite.ground.residual import ClauseShape, CountShape, TableShape
from mlnlite.ground.states import counts_of
from mlnlite.model.evidence import Evidence

S = TypeVar("S")
K = TypeVar("K")

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Piece:
    """Ground formulas of one template that have one shape.

    Attributes:
        atoms: for each of `shape.atoms` a column of numbers of atoms (see `ground.numbers`), shape (n,).
        shape: clause, table, or function of counts.
        row: shape (n,), row of the template.
        count: shape (n,), how many groundings.
    """

    atoms: tuple[Int64, ...]
    shape: ClauseShape | TableShape | CountShape
    row: NDArray[Any]
    count: Int64


Weighted: TypeAlias = Sequence[tuple[Piece, int]]
"""Pieces, and the index of the weight of each one's row 0."""


@dataclass(frozen=True, slots=True)
class Blocks:
    """The factors of a network."""

    clauses: tuple[Clauses, ...]
    tables: tuple[Tables, ...]
    counts: tuple[Counts, ...]


def blocks_of(pieces: Weighted, atoms: Int64, evidence: Evidence) -> Blocks:
    """The factors that pieces are.

    Args:
        pieces: of all templates, one template after the other.
        atoms: of the network, as `Evidence.atom_number` has them, rising.
        evidence: what they are of.
    """
    n_atoms = len(atoms)
    index = index_in(numbers_of(atoms, evidence), sum(len(p.row) for p, _ in pieces))
    clauses, tables, counts = [], [], []
    for (k, negated), mine in sorted(_of_kind(pieces, ClauseShape, lambda s: (len(s.atoms), s.negated)).items()):
        codes = _groups(mine, lambda p: _codes(p, index))
        clauses.append(Clauses(*merged_codes(codes, k, 2 * n_atoms + 2), negated))
    for (k, truth), mine in sorted(_of_kind(pieces, TableShape, lambda s: (s.truth.ndim, s.truth.tobytes())).items()):
        rows, weight, count = merged(_groups(mine, lambda p: _indices(p, index)), k, n_atoms)
        tables.append(Tables(rows, np.frombuffer(truth, np.bool_).reshape((2,) * k), weight, count))
    for shape, mine in _of_kind(pieces, CountShape, lambda s: s).items():
        groups = _groups(mine, lambda p: _indices(p, index))
        counts.append(counts_of(shape, *merged(groups, len(shape.steps), n_atoms)))
    return Blocks(tuple(clauses), tuple(tables), tuple(counts))


def _of_kind(pieces: Weighted, kind: type[S], key: Callable[[S], K]) -> dict[K, list[tuple[Piece, int]]]:
    """The pieces with a kind of shape, by a key of their shapes."""
    found: dict[K, list[tuple[Piece, int]]] = {}
    for piece, first in pieces:
        if isinstance(piece.shape, kind):
            found.setdefault(key(piece.shape), []).append((piece, first))
    return found


def _groups(pieces: Weighted, columns: Callable[[Piece], list[Int32]]) -> list[Group]:
    """The rows of each template, those of a piece made when it is its turn."""
    groups = []
    for first, same in groupby(pieces, lambda p: p[1]):
        mine = [piece for piece, _ in same]
        n_weights = max(int(p.row.max(initial=0)) for p in mine) + 1
        rows = ((columns(p), p.row, p.count) for p in mine)
        groups.append(Group(rows, sum(len(p.row) for p in mine), first, n_weights))
    return groups


def _codes(piece: Piece, index: Index) -> list[Int32]:
    assert isinstance(piece.shape, ClauseShape)
    return [code_of(index(a), sign) for a, sign in zip(piece.atoms, piece.shape.signs, strict=True)]


def _indices(piece: Piece, index: Index) -> list[Int32]:
    return [index(a) for a in piece.atoms]
