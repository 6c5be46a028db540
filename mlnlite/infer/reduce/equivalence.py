"""Makes atoms one that hard formulas tie together: comes in potentials, go out potentials and the way back.

`Same(x, y) <=> Same(y, x)` forbids two of the four worlds of a pair, so that one atom determines the other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from mlnlite.ground.network import Bool, Int64
from mlnlite.infer.reduce.conjunctions import Cells, Conjunctions, cells_of
from mlnlite.infer.reduce.potentials import Potentials
from mlnlite.infer.reduce.propagate import propagate


@dataclass(frozen=True, slots=True)
class Ties:
    """For each variable the one that stands for it, and whether it has the opposite value.

    Attributes:
        leader: shape (n_variables,).
        opposite: shape (n_variables,).
    """

    leader: Int64
    opposite: Bool


def contracted(potentials: Potentials) -> tuple[Potentials, Ties]:
    """Potentials in which tied variables have one value and no cells but their leaders have them all."""
    n = len(potentials.cardinality)
    nobody = Ties(np.arange(n), np.zeros(n, np.bool_))
    pairs = _tied(potentials)
    if not len(pairs[0]):
        return potentials, nobody
    a, b, opposite = pairs
    start = np.concatenate([a, a + n])
    end = np.concatenate([np.where(opposite, b + n, b), np.where(opposite, b, b + n)])
    graph = coo_matrix((np.ones(len(start), np.int8), (start, end)), shape=(2 * n, 2 * n))
    _, label = connected_components(graph, directed=False)
    if (label[:n] == label[n:]).any():
        return replace(potentials, constant=-np.inf), nobody
    first = np.full(int(label.max()) + 1, 2 * n)
    np.minimum.at(first, label, np.arange(2 * n))
    leader = first[label[:n]]
    ties = Ties(leader % n, leader >= n)
    return _renamed(potentials, ties), ties


def put_back_ties(ties: Ties, values: Int64) -> None:
    """Gives each variable the value that its leader's determines."""
    own = values[ties.leader]
    values[:] = np.where(ties.opposite, 1 - own, own)


def _tied(potentials: Potentials) -> tuple[Int64, Int64, Bool]:
    """Pairs of atoms of which two opposite cells are forbidden, and whether they have opposite values.

    Atoms of counting factors stay what they are.
    """
    n = len(potentials.cardinality)
    pairs = next((c for c in potentials.cells if c.scope.shape[1] == 2), None)
    if pairs is None:
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.bool_)
    free = potentials.cardinality == 2
    for chains in potentials.chains:
        free[chains.variable] = False
    hard = np.isneginf(pairs.amount) & free[pairs.scope].all(axis=1)
    scope, value = pairs.scope[hard].astype(np.int64), pairs.value[hard]
    key = (scope[:, 0] * n + scope[:, 1]) * 2 + (value[:, 0] == value[:, 1])
    cells = np.unique(key * 2 + value[:, 0])
    both = (cells[1:] == cells[:-1] + 1) & (cells[:-1] % 2 == 0)
    found = cells[:-1][both] // 2
    return found // 2 // n, found // 2 % n, found % 2 == 1


def _renamed(potentials: Potentials, ties: Ties) -> Potentials:
    """The cells of leaders in place of those of the variables that they stand for."""
    own = ties.leader == np.arange(len(ties.leader))
    cardinality = np.where(own, potentials.cardinality, 1).astype(np.int32)
    cells: list[Cells] = []
    constant = potentials.constant
    for c in potentials.cells:
        variable = ties.leader[c.scope].astype(np.int32)
        value = np.where(ties.opposite[c.scope], 1 - c.value, c.value).astype(np.int32)
        found, gain = cells_of(Conjunctions(variable, value, np.ones(value.shape, np.bool_), c.amount), cardinality)
        cells, constant = [*cells, *found], constant + gain
    return Potentials(cardinality, *propagate(cells, cardinality, constant), potentials.chains)
