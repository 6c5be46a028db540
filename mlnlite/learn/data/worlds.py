"""Network and data to choices among whole worlds: each part of the network against the world it has in the data.

The log-likelihood of a part is `-log(1 + sum_{worlds r} exp(-x_r w))`, with row `x_r` the counts of the world in the
data less those of world r: the same form as for a single atom, so that all that is known of choices holds for exact
and composite likelihoods too. Where the data leave variables unknown, the worlds that agree with what is known are
listed as well: the likelihood of what is known is the ratio of the two sums.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from mlnlite.ground.network import Clauses, Counts, Network, Tables
from mlnlite.learn.data.merge import Listed

Int64 = NDArray[np.int64]
Float = NDArray[np.float64]

MOST_WORLDS = 4096
"""Largest number of worlds of a part that is listed."""


@dataclass(frozen=True, slots=True)
class Worlds:
    """The worlds of parts, each row relative to a world of its part that agrees with the data.

    Attributes:
        every: all worlds but the reference.
        known: those of them that agree with what is known (only of parts with unknown variables).
    """

    every: Listed
    known: Listed


def incidence(network: Network) -> sparse.csr_array:
    """Which variable occurs in which ground formula, shape (n_variables, n_factors)."""
    variable, factor, first = [np.empty(0, np.int64)], [np.empty(0, np.int64)], 0
    for atoms in factor_atoms(network):
        variable.append(network.variable[atoms].reshape(-1).astype(np.int64))
        factor.append(first + np.repeat(np.arange(len(atoms)), atoms.shape[1]))
        first += len(atoms)
    ones = np.ones(sum(map(len, variable)), np.int8)
    shape = (network.n_variables, first)
    matrix = sparse.csr_array((ones, (np.concatenate(variable), np.concatenate(factor))), shape=shape)
    matrix.sum_duplicates()
    return matrix


def factor_atoms(network: Network) -> Iterator[NDArray[np.int32]]:
    """Atoms of the ground formulas of each group, clauses first."""
    for clauses in network.clauses:
        yield np.abs(clauses.literals) - 1
    for tables in network.tables:
        yield tables.atoms
    for counts in network.counts:
        yield np.abs(counts.literals) - 1


def components(network: Network) -> list[Int64]:
    """The variables of each connected component."""
    matrix = incidence(network).astype(np.int32)
    n, label = connected_components(matrix @ matrix.T, directed=False)
    order = np.argsort(label, kind="stable")
    return np.split(order.astype(np.int64), np.cumsum(np.bincount(label, minlength=n))[:-1]) if n else []


def pairs(network: Network) -> list[Int64]:
    """Each pair of variables that occur in one ground formula, and each variable that has no such partner."""
    matrix = incidence(network).astype(np.int32)
    together = sparse.coo_array(sparse.triu(matrix @ matrix.T, 1))
    found = list(np.column_stack([together.row, together.col]).astype(np.int64))
    alone = np.setdiff1d(np.arange(network.n_variables), np.concatenate([np.empty(0, np.int64), *found]))
    return [*found, *(np.array([v]) for v in alone)]


def n_worlds(network: Network, part: Int64) -> float:
    """Number of worlds of a part."""
    with np.errstate(over="ignore"):  # infinitely many are too many to list, too
        return float(np.prod(network.cardinality[part].astype(float)))


def list_worlds(network: Network, values: Int64, parts: Sequence[Int64], excluded: Int64) -> Worlds:
    """The worlds of some parts of a network, everything else being as in the data.

    Args:
        network: in which everything predicted is unknown.
        values: shape (n_variables,), value of each variable in the data, -1 for unknown.
        parts: the variables of each part.
        excluded: shape (n, 2), variables that are not known, and values that they do not have.
    """
    touching = incidence(network)
    hard = np.isposinf(network.weights)
    every, known = _Rows([], []), _Rows([], [])
    for part in parts:
        table = _table(network, values, part, touching)
        given = values[part] >= 0
        agrees = (table.grid[:, given] == values[part][given]).all(axis=1)
        for v, value in excluded[np.isin(excluded[:, 0], part)].tolist():
            agrees &= table.grid[:, part.tolist().index(v)] != value
        fits = np.flatnonzero(agrees)
        reference = int(fits[table.counts[fits][:, hard[table.weights]].sum(axis=1).argmax()])
        others = np.arange(len(agrees)) != reference
        change = table.counts[reference] - table.counts
        for rows, chosen in ((every, others), (known, others & agrees)):
            rows.columns.append(table.weights)
            rows.change.append(change[chosen])
    return Worlds(*(_listed(rows, len(network.weights)) for rows in (every, known)))


@dataclass(frozen=True, slots=True)
class _Rows:
    """Rows of each part: which weights, and their changes, shape (n_rows, n_weights of the part)."""

    columns: list[Int64]
    change: list[Float]


def _listed(rows: _Rows, n_weights: int) -> Listed:
    lengths = np.array([len(c) for c in rows.change], np.int64)
    widths = np.array([len(c) for c in rows.columns], np.int64)
    data = np.concatenate([np.empty(0), *(c.ravel() for c in rows.change)])
    columns = np.concatenate(
        [np.empty(0, np.int64), *(np.tile(c, n) for c, n in zip(rows.columns, lengths.tolist(), strict=True))]
    )
    pointer = np.concatenate([[0], np.cumsum(np.repeat(widths, lengths))])
    matrix = sparse.csr_array((data, columns, pointer), shape=(int(lengths.sum()), n_weights))
    matrix.eliminate_zeros()
    filled = np.flatnonzero(lengths)
    choice = np.repeat(np.arange(len(filled)), lengths[filled])
    world = np.zeros(len(filled), np.int64)
    return Listed(matrix, np.ones(len(choice)), choice, world, filled.astype(np.int64), len(lengths), np.zeros(1))


def world_counts(network: Network, part: Int64, touching: sparse.csr_array) -> WorldTable:
    """The worlds of a component; `touching` is the network's `incidence`."""
    return _table(network, np.zeros(network.n_variables, np.int64), part, touching)


@dataclass(frozen=True, slots=True)
class WorldTable:
    """The worlds of a part.

    Attributes:
        grid: shape (n_worlds, n_variables of the part), values of its variables.
        weights: shape (k,), the weights that some formula of the part has, rising.
        counts: shape (n_worlds, k), number of their groundings that are true and touch the part.
    """

    grid: Int64
    weights: Int64
    counts: Float


def _table(network: Network, values: Int64, part: Int64, touching: sparse.csr_array) -> WorldTable:
    grid = np.indices(network.cardinality[part].tolist()).reshape(len(part), -1).T
    place = np.full(network.n_variables, -1)
    place[part] = np.arange(len(part))
    slices = [touching.indices[touching.indptr[v] : touching.indptr[v + 1]] for v in part.tolist()]
    factors = np.unique(np.concatenate(slices)).astype(np.int64) if slices else np.empty(0, np.int64)
    weight, counts, first = [np.empty(0, np.int64)], [np.empty((len(grid), 0))], 0
    groups: tuple[Clauses | Tables | Counts, ...] = (*network.clauses, *network.tables, *network.counts)
    for group in groups:
        n = len(group.weight)
        begin, end = np.searchsorted(factors, [first, first + n]).tolist()
        chosen = factors[begin:end] - first
        first += n
        if len(chosen):
            counts.append(group.count[chosen] * _n_true(network, values, group, chosen, (grid, place)).astype(float))
            weight.append(group.weight[chosen].astype(np.int64))
    weights, which = np.unique(np.concatenate(weight), return_inverse=True)
    return WorldTable(grid, weights, np.concatenate(counts, axis=1) @ np.eye(len(weights))[which.reshape(-1)])


def _n_true(
    network: Network, values: Int64, group: Clauses | Tables | Counts, chosen: Int64, worlds: tuple[Int64, Int64]
) -> Int64:
    """How many groundings of the chosen factors of a group hold in each world, shape (n_worlds, n_chosen)."""
    if isinstance(group, Tables):
        truth = _truth(network, values, group.atoms[chosen], worlds)
        return np.asarray(group.truth[tuple(np.moveaxis(truth, 2, 0).astype(np.int64))], np.int64)
    literals = group.literals[chosen]
    holds = _truth(network, values, np.abs(literals) - 1, worlds) == (literals > 0)
    if isinstance(group, Counts):
        return np.asarray(group.true[holds @ group.steps])
    return np.asarray(holds.any(axis=2) != group.negated, np.int64)


def _truth(network: Network, values: Int64, atoms: NDArray[np.int32], worlds: tuple[Int64, Int64]) -> NDArray[np.bool_]:
    """Truth of atoms in each world, shape (n_worlds, *atoms.shape): outside of the part as in the data."""
    grid, place = worlds
    variable = network.variable[atoms]
    outside = np.broadcast_to(values[variable], (len(grid), *atoms.shape))
    value = np.where(place[variable] >= 0, grid[:, np.maximum(place[variable], 0)], outside)
    return np.asarray(value == network.value[atoms])
