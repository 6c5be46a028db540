"""Atoms that exclude each other as one variable: comes in a network, goes out one with fewer variables.

A group of atoms of which at most one is true in all worlds that matter has one value for each atom and one for "none",
not two for each atom. Where two true atoms are forbidden that is the same network; where they only cost a lot, it is
the network given that no group has two (see `bounded`, which says how much that leaves out).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mlnlite.ground.network import Bool, Clauses, Counts, Float, Int64, Network

STEEP = 6.0
"""Log-weight that two true atoms must cost at least."""


@dataclass(frozen=True, slots=True)
class Exclusion:
    """A network in which groups of atoms are variables.

    Attributes:
        network: with value 0 of each group for "none", and value i + 1 for its atom i.
        variable: shape (n_groups,), the variable of each group.
        worth: for each group, shape (n_atoms of the group + 1,): log-weight of so many true atoms, less that of none.
    """

    network: Network
    variable: Int64
    worth: tuple[Float, ...]


@dataclass(frozen=True, slots=True)
class _Group:
    """Atoms that exclude each other; the factor that says so is row `row` of block `block` of the counts."""

    atoms: Int64
    worth: Float
    block: int
    row: int


def exclusion(network: Network, atoms: Bool) -> Exclusion | None:
    """Merges the atoms of each group that is fit for it; None if there is no group.

    Args:
        network: with counting factors (see `patterns.with_counts`).
        atoms: shape (n_atoms,), which atoms may be merged: all of a component or none of it.
    """
    groups = _disjoint(g for g in _candidates(network) if atoms[g.atoms].all())
    owner = np.full(network.n_atoms, -1, np.int64)
    for i, g in enumerate(groups):
        owner[g.atoms] = i
    soft = np.array([np.isfinite(g.worth).all() for g in groups], np.bool_)
    fit = np.logical_not(soft & _unfit(network, groups, owner)) if groups else soft
    chosen = [g for g, f in zip(groups, fit.tolist(), strict=True) if f]
    return _merged(network, chosen) if chosen else None


def _candidates(network: Network) -> Iterator[_Group]:
    """Counting factors over plain atoms for which none and one true are the same, and two far worse."""
    plain = (network.cardinality == 2) & ~network.block
    for b, counts in enumerate(network.counts):
        if not counts.plain:
            continue
        weight = network.weights[counts.weight]
        same_sign = (counts.literals > 0) == (counts.literals[:, :1] > 0)
        for row in np.flatnonzero(same_sign.all(axis=1)).tolist():
            worth = _worth(_by_true_atoms(counts, row), float(weight[row]), int(counts.count[row]))
            atoms = np.abs(counts.literals[row]).astype(np.int64) - 1
            steep = len(atoms) > 1 and worth[1] == 0 and (worth[2:] <= -STEEP).all()
            if steep and plain[network.variable[atoms]].all():
                yield _Group(atoms, worth, b, row)


def _by_true_atoms(counts: Counts, row: int) -> Int64:
    """Number of true groundings for each number of true atoms; the literals have one sign."""
    return counts.true if counts.literals[row, 0] > 0 else counts.true[::-1]


def _worth(true: Int64, weight: float, count: int) -> Float:
    """Log-weight of each number of true atoms, less that of none; not a number where none is forbidden."""
    if np.isfinite(weight):
        return np.asarray(weight * count * (true - true[0]))
    allowed = np.where(true == true.max(), 0.0, -np.inf)
    return allowed if allowed[0] == 0 else np.full(len(true), np.nan)


def _disjoint(groups: Iterator[_Group]) -> list[_Group]:
    """Groups that share no atom with an earlier one."""
    taken: set[int] = set()
    found = []
    for g in groups:
        own = set(g.atoms.tolist())
        if taken.isdisjoint(own):
            taken |= own
            found.append(g)
    return found


def _unfit(network: Network, groups: list[_Group], owner: Int64) -> Bool:
    """Groups of which two true atoms could do more, or less, than the bound takes into account; shape (n_groups,)."""
    found = np.zeros(len(groups) + 1, np.bool_)  # the last place is for atoms without a group
    size = np.array([*(len(g.atoms) for g in groups), 0])
    own = {(g.block, g.row) for g in groups}
    for clauses in network.clauses:
        found[_unfit_clauses(network, clauses, owner, size)] = True
    for tables in network.tables:
        mine = owner[tables.atoms]
        found[mine[_several(mine) | np.isposinf(network.weights[tables.weight])]] = True
    for b, counts in enumerate(network.counts):
        other = np.array([(b, row) not in own for row in range(len(counts.literals))], np.bool_)
        found[owner[np.abs(counts.literals[other]) - 1]] = True
    return found[:-1]


def _unfit_clauses(network: Network, clauses: Clauses, owner: Int64, size: Int64) -> Int64:
    """Groups with several atoms in a soft clause, or one that a hard clause asks for ("one of all" is fine)."""
    mine, positive = owner[np.abs(clauses.literals) - 1], clauses.literals > 0
    hard = np.isposinf(network.weights[clauses.weight])
    some = (mine == mine[:, :1]).all(axis=1) & positive.all(axis=1) & (size[mine[:, 0]] == mine.shape[1])
    asked = np.broadcast_to(clauses.negated | positive, mine.shape) & (hard & ~some)[:, None]
    return np.concatenate([mine[~hard & _several(mine)].ravel(), mine[asked]])


def _several(mine: Int64) -> Bool:
    """Rows with two atoms of one group."""
    ordered = np.sort(mine, axis=1)
    return np.asarray(((ordered[:, 1:] == ordered[:, :-1]) & (ordered[:, 1:] >= 0)).any(axis=1))


def _merged(network: Network, groups: list[_Group]) -> Exclusion:
    """The network in which each group is one variable."""
    variable, value = network.variable.astype(np.int64), network.value.copy()
    cardinality, block = network.cardinality.copy(), network.block.copy()
    for g in groups:
        first = variable[g.atoms[0]]
        variable[g.atoms], value[g.atoms] = first, np.arange(1, len(g.atoms) + 1)
        cardinality[first], block[first] = len(g.atoms) + 1, True
    used, variable = np.unique(variable, return_inverse=True)
    counts, decided = _without(network, groups)
    merged = replace(
        network, variable=variable.ravel().astype(np.int32), value=value, cardinality=cardinality[used],
        block=block[used], counts=counts, decided_true=decided,
    )  # fmt: skip
    return Exclusion(
        merged, merged.variable[[g.atoms[0] for g in groups]].astype(np.int64), tuple(g.worth for g in groups)
    )


def _without(network: Network, groups: list[_Group]) -> tuple[tuple[Counts, ...], Int64]:
    """The counting factors that are left; those that are not are worth what they are with no true atom."""
    decided = network.decided_true.copy()
    kept = []
    for b, counts in enumerate(network.counts):
        gone = np.zeros(len(counts.literals), np.bool_)
        gone[[g.row for g in groups if g.block == b]] = True
        at_none = [_by_true_atoms(counts, row)[0] for row in np.flatnonzero(gone).tolist()]
        np.add.at(decided, counts.weight[gone], counts.count[gone] * np.array(at_none, np.int64))
        rest = counts.literals[~gone], counts.true, counts.weight[~gone], counts.count[~gone], counts.steps
        kept += [] if gone.all() else [Counts(*rest)]
    return tuple(kept), decided
