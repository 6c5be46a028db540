"""The factors of a network one by one, for formats that list them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.network import Network


@dataclass(frozen=True, slots=True)
class ClauseFactor:
    """A world in which some literal is true gains `gain`; `inf`: every world must; `-inf`: none may.

    Attributes:
        literals: `a + 1` or `-(a + 1)`.
        gain: weight times count, negative for a conjunction seen as a negated clause.
        weight: index of its weight.
        constant: what every world gains besides: a conjunction gains its weight unless its negated clause is true.
    """

    literals: tuple[int, ...]
    gain: float
    weight: int
    constant: float = 0.0


@dataclass(frozen=True, slots=True)
class TableFactor:
    """A world gains `gain` where `truth` of its atoms is true."""

    atoms: tuple[int, ...]
    truth: NDArray[np.bool_]
    gain: float
    weight: int


def clause_factors(network: Network) -> Iterator[ClauseFactor]:
    """All clauses and conjunctions."""
    for block in network.clauses:
        gain = network.weights[block.weight] * block.count * (-1 if block.negated else 1)
        rows = zip(block.literals.tolist(), gain.tolist(), block.weight.tolist(), strict=True)
        for literals, value, weight in rows:
            if value != 0:
                constant = -value if block.negated and np.isfinite(value) else 0.0
                yield ClauseFactor(tuple(literals), value, weight, constant)


def table_factors(network: Network) -> Iterator[TableFactor]:
    """All tables."""
    for block in network.tables:
        gain = network.weights[block.weight] * block.count
        for atoms, value, weight in zip(block.atoms.tolist(), gain.tolist(), block.weight.tolist(), strict=True):
            if value != 0:
                yield TableFactor(tuple(atoms), block.truth, value, weight)


def penalties(network: Network) -> Iterator[ClauseFactor]:
    """The network as clauses that cost their gain if no literal is true: all gains positive, `inf` for hard.

    A clause with a negative gain becomes a unit clause over a new atom that any of its literals makes true; new atoms
    are numbered after those of the network. What every world gains is left out.
    """
    next_atom = network.n_atoms + 1
    for factor in clause_factors(network):
        if factor.gain > 0:
            yield factor
        elif np.isinf(factor.gain) or len(factor.literals) == 1:
            for literal in factor.literals:
                yield ClauseFactor((-literal,), -factor.gain, factor.weight)
        else:
            for literal in factor.literals:
                yield ClauseFactor((-literal, next_atom), np.inf, factor.weight)
            yield ClauseFactor((-next_atom,), -factor.gain, factor.weight)
            next_atom += 1
    for table in table_factors(network):
        for values in product((False, True), repeat=len(table.atoms)):
            if table.truth[tuple(map(int, values))] != (table.gain > 0):
                literals = tuple(-(a + 1) if v else a + 1 for a, v in zip(table.atoms, values, strict=True))
                yield ClauseFactor(literals, abs(table.gain), table.weight)
    for literals in block_clauses(network):
        yield ClauseFactor(literals, np.inf, -1)


def block_clauses(network: Network) -> Iterator[tuple[int, ...]]:
    """What blocks demand, as clauses: no two values, and some value where there must be one."""
    order = np.argsort(network.variable, kind="stable")
    start = np.searchsorted(network.variable[order], np.arange(network.n_variables + 1))
    for v in np.flatnonzero(network.block).tolist():
        atoms = (order[start[v] : start[v + 1]] + 1).tolist()
        if len(atoms) == network.cardinality[v]:
            yield tuple(atoms)
        for i, a in enumerate(atoms):
            for b in atoms[:i]:
                yield (-a, -b)
