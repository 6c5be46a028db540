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
from mlnlite.learn.merge import Listed

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
    return float(np.prod(network.cardinality[part].astype(float)))


def list_worlds(network: Network, values: Int64, parts: Sequence[Int64], database: int) -> Worlds:
    """The worlds of some parts of a network, everything else being as in the data.

    Args:
        network: in which everything predicted is unknown.
        values: shape (n_variables,), value of each variable in the data, -1 for unknown.
        parts: the variables of each part.
        database: number of the database.
    """
    touching = incidence(network)
    tables = [_counts(network, values, part, touching) for part in parts]
    rows: tuple[list[sparse.csr_array], list[sparse.csr_array]] = ([], [])
    lengths: tuple[list[int], list[int]] = ([], [])
    for part, (grid, counts) in zip(parts, tables, strict=True):
        known = values[part] >= 0
        agrees = (grid[:, known] == values[part][known]).all(axis=1)
        reference = _reference(network, counts, np.flatnonzero(agrees))
        others = np.arange(len(grid)) != reference
        for i, chosen in enumerate((others, others & agrees)):
            rows[i].append(sparse.csr_array(counts[[reference] * int(chosen.sum())] - counts[np.flatnonzero(chosen)]))
            lengths[i].append(int(chosen.sum()))
    every, known_part = (_listed(r, n, len(network.weights), database) for r, n in zip(rows, lengths, strict=True))
    return Worlds(every, known_part)


def _reference(network: Network, counts: sparse.csr_array, agrees: Int64) -> int:
    """A world that agrees with the data and, if there is one, satisfies the hard formulas."""
    hard = np.flatnonzero(np.isposinf(network.weights))
    return int(agrees[np.asarray(counts[agrees][:, hard].sum(axis=1)).argmax()]) if len(hard) else int(agrees[0])


def _listed(rows: list[sparse.csr_array], lengths: list[int], n_weights: int, database: int) -> Listed:
    matrix = sparse.csr_array(sparse.vstack(rows)) if rows else sparse.csr_array((0, n_weights))
    matrix.eliminate_zeros()
    matrix.sort_indices()
    filled = [n for n in lengths if n]
    choice = np.repeat(np.arange(len(filled)), filled)
    return Listed(matrix, np.ones(len(choice)), choice, np.full(len(filled), database), len(lengths), 0.0)


def _counts(network: Network, values: Int64, part: Int64, touching: sparse.csr_array) -> tuple[Int64, sparse.csr_array]:
    """The worlds of a part, shape (n_worlds, n_variables of it), and their counts, shape (n_worlds, n_weights)."""
    cardinality = network.cardinality[part].tolist()
    grid = np.indices(cardinality).reshape(len(part), -1).T
    place = np.full(network.n_variables, -1)
    place[part] = np.arange(len(part))
    factors = np.unique(touching[part].indices)
    total = sparse.csr_array((len(grid), len(network.weights)), dtype=float)
    first = 0
    groups: tuple[Clauses | Tables | Counts, ...] = (*network.clauses, *network.tables, *network.counts)
    for group in groups:
        n = len(group.weight)
        chosen = factors[(factors >= first) & (factors < first + n)] - first
        first += n
        if len(chosen):
            n_true = _n_true(network, values, group, chosen.astype(np.int64), (grid, place))
            world, which = np.nonzero(n_true)
            data = (group.count[chosen] * n_true)[world, which].astype(float)
            total = total + sparse.csr_array((data, (world, group.weight[chosen][which])), shape=total.shape)
    return grid, sparse.csr_array(total)


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
        return np.asarray(group.true[holds.sum(axis=2)])
    return np.asarray(holds.any(axis=2) != group.negated, np.int64)


def _truth(network: Network, values: Int64, atoms: NDArray[np.int32], worlds: tuple[Int64, Int64]) -> NDArray[np.bool_]:
    """Truth of atoms in each world, shape (n_worlds, *atoms.shape): outside of the part as in the data."""
    grid, place = worlds
    variable = network.variable[atoms]
    outside = np.broadcast_to(values[variable], (len(grid), *atoms.shape))
    value = np.where(place[variable] >= 0, grid[:, np.maximum(place[variable], 0)], outside)
    return np.asarray(value == network.value[atoms])
