"""Elimination where groups of atoms almost exclude each other: comes in a network, go out probabilities and a bound.

Worlds in which no group has two true atoms are summed exactly. All other worlds are summed too, but as if each group
with two or more were one further value, whose every log-weight is at least that of the best such set of atoms. That
sum is too large, and the truth lies between: what was left out is at most a share `slack` of all worlds, so where it
is p without them, a probability is between p (1 - slack) and p (1 - slack) + slack.

A pair of groups shares a table of log-weights A[i, j] of their atoms. With a[i] = sum_j max(A[i, j], 0) / 2, and b[j]
likewise, sets S and T of atoms gain at most sum_S a + sum_T b together; so a group with several true atoms S is given
a[i] for each of them, and loses a[i] again towards a group with one, where what S gains can be said exactly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mlnlite.errors import Contradiction
from mlnlite.ground.network import Bool, Float, Int64, Network
from mlnlite.infer.approach import BOUNDED
from mlnlite.infer.exact.marginal import AtomProbabilities, distributions_of, marginals_of
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.exclusion import Exclusion, exclusion
from mlnlite.infer.reduce.fold import fold
from mlnlite.infer.reduce.peel import put_back_labels, with_parents
from mlnlite.infer.reduce.potentials import Potentials, potentials_of
from mlnlite.infer.reduce.propagate import joined


def bounded_marginals(
    network: Network, asked: Int64 | None, atoms: Bool, most: float, limits: tuple[int, int | None]
) -> tuple[Network, AtomProbabilities] | None:
    """Probabilities of atoms, some up to a bound.

    Args:
        network: with counting factors (see `patterns.with_counts`).
        asked: indices into `network.atoms`; None for all.
        atoms: shape (n_atoms,), those of components that are too wide as they are.
        most: largest slack; components with more of it are left.
        limits: largest number of entries of a table, and of all tables of a component.

    Returns:
        The network without worlds in which groups have two true atoms, and what is known of it; None if no atoms
        exclude each other, or hard formulas ask for two.
    """
    merged = exclusion(network, atoms)
    if merged is None:
        return None
    try:
        found = marginals_of(merged.network, asked, width_limit=limits[0], in_all=limits[1], too_wide="leave")
    except Contradiction:
        return None
    slack = np.where(atoms, np.maximum(found.slack, _slack(merged, found, limits)), found.slack)
    left = ~np.isnan(found.slack) & ~(slack <= most)
    method = tuple(BOUNDED if s > 0 else m for m, s in zip(found.method, slack.tolist(), strict=True))
    return merged.network, replace(
        found,
        probability=np.where(left, np.nan, found.probability),
        slack=np.where(left, np.nan, slack),
        method=method,
        log_z=np.nan if (slack > 0).any() else found.log_z,
        wide=tuple({*found.wide, *found.component[left].tolist()}),
    )


def _slack(merged: Exclusion, found: AtomProbabilities, limits: tuple[int, int | None]) -> Float:
    """Share of the worlds of the component of each atom that may have been left out."""
    if not any(np.isfinite(w).all() for w in merged.worth):
        return np.zeros(len(found.slack))
    variable = merged.network.variable
    flat, folded = fold(potentials_of(merged.network, chained=True))
    larger = with_several(flat, merged)
    needed, nothing = np.zeros((2, len(larger.cardinality)), np.bool_)
    needed[variable[~np.isnan(found.slack)]] = True
    sums = distributions_of(larger, nothing, with_parents(folded, needed), limits[0], in_all=limits[1])
    more = sums.log_z[put_back_labels(folded, sums.label)[variable]] - found.part_log_z
    return np.asarray(-np.expm1(-np.maximum(more, 0.0)))


def with_several(potentials: Potentials, merged: Exclusion) -> Potentials:
    """Potentials in which groups that may have several true atoms have a value for that, at no less than its weight.

    Args:
        potentials: of the merged network, without chains.
        merged: the groups.
    """
    cardinality, own = potentials.cardinality.copy(), _single(potentials)
    several = np.zeros(len(cardinality), np.bool_)
    soft = [(v, w) for v, w in zip(merged.variable.tolist(), merged.worth, strict=True) if np.isfinite(w).all()]
    several[[v for v, _ in soft]] = True
    gain, found = np.zeros(len(cardinality)), list(potentials.cells)
    for c in potentials.cells:
        if c.scope.shape[1] > 2:
            for column in c.scope.T:
                np.add.at(gain, column, np.maximum(c.amount, 0.0))
    for (a, b), table in _pairs(potentials):
        for v, other, gains in ((a, b, table), (b, a, table.T)):
            if not several[v]:
                continue
            least = np.maximum(gains[1:, 1:], 0.0).sum(axis=1) / 2 if several[other] else np.zeros(len(gains) - 1)
            own[v][1:] += least
            found.append(_cells((v, int(cardinality[v])), other, _best_two(gains[1:] - least[:, None])))
    for v, worth in soft:
        amount = np.array([gain[v] + _log_sum_of_several(own[v][1:], worth)])
        found.append(Cells(np.array([[v]], np.int32), np.array([[cardinality[v]]], np.int32), amount))
    return replace(potentials, cardinality=(cardinality + several).astype(np.int32), cells=joined(found))


def _single(potentials: Potentials) -> list[Float]:
    """What each value of each variable gains by itself."""
    cardinality = potentials.cardinality
    start = np.cumsum(cardinality, dtype=np.int64) - cardinality
    amount = np.zeros(int(cardinality.sum()))
    for c in potentials.cells:
        if c.scope.shape[1] == 1:
            np.add.at(amount, start[c.scope[:, 0]] + c.value[:, 0], c.amount)
    return np.split(amount, start[1:])


def _pairs(potentials: Potentials) -> Iterator[tuple[tuple[int, int], Float]]:
    """The pairs of variables that share cells, and the tables of these."""
    for c in potentials.cells:
        if c.scope.shape[1] == 2:
            names, which = np.unique(c.scope, axis=0, return_inverse=True)
            order = np.argsort(which.ravel(), kind="stable")
            starts = np.searchsorted(which.ravel()[order], np.arange(len(names) + 1))
            for i, (a, b) in enumerate(names.tolist()):
                rows = order[starts[i] : starts[i + 1]]
                table = np.zeros((int(potentials.cardinality[a]), int(potentials.cardinality[b])))
                np.add.at(table, tuple(c.value[rows].T), c.amount[rows])
                yield (a, b), table


def _best_two(gains: Float) -> Float:
    """Largest sum over two or more rows of each column."""
    ordered = -np.sort(-gains, axis=0)
    return np.asarray(ordered[:2].sum(axis=0) + np.maximum(ordered[2:], 0.0).sum(axis=0))


def _cells(literal: tuple[int, int], other: int, amount: Float) -> Cells:
    """Cells of one value of a variable and each value of another."""
    pair = np.tile(np.array([literal[0], other], np.int32), (len(amount), 1))
    values = np.stack([np.full(len(amount), literal[1]), np.arange(len(amount))], axis=1).astype(np.int32)
    order = np.argsort(pair, axis=1)
    return Cells(np.take_along_axis(pair, order, axis=1), np.take_along_axis(values, order, axis=1), amount)


def _log_sum_of_several(own: Float, worth: Float) -> float:
    """Log of the summed weights of all sets of two or more atoms.

    Args:
        own: shape (n,), log-weight of each atom.
        worth: shape (n + 1,), log-weight of each number of true atoms.
    """
    sums = np.full(len(own) + 1, -np.inf)  # over all sets of so many of the atoms so far
    sums[0] = 0.0
    for gain in own.tolist():
        sums[1:] = np.logaddexp(sums[1:], sums[:-1] + gain)
    return float(np.logaddexp.reduce(sums[2:] + worth[2:]))
