"""Takes the leaves off many trees at once: comes in potentials, goes out what is left, and how to get back.

A variable that shares cells with only one other is summed (or maximised) out, all such variables in one stroke, round
after round, as long as a round has enough of them to be worth it. Elimination does the same, one at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32, Int64
from mlnlite.infer.reduce.conjunctions import Cells, starts_of
from mlnlite.infer.reduce.fill import Placed, fill
from mlnlite.infer.reduce.potentials import Potentials

FEWEST = 64
_LARGEST = 4096


class Gone(Protocol):
    """Variables that were summed out, each hanging on another one."""

    @property
    def variable(self) -> Int64:
        """Shape (n,)."""

    @property
    def hangs_on(self) -> Int64:
        """Shape (n,), the variable that each hangs on."""


@dataclass(frozen=True, slots=True)
class Leaves:
    """Leaves of one round that have equal cardinalities.

    Attributes:
        variable: shape (n,).
        parent: shape (n,), the variable that each hangs on.
        table: shape (n, cardinality, cardinality of the parent): after sums the distribution of the leaf given its
            parent, after maxima the log-weight of both.
    """

    variable: Int64
    parent: Int64
    table: Float

    @property
    def hangs_on(self) -> Int64:
        """The parents."""
        return self.parent


@dataclass(frozen=True, slots=True)
class _Edge:
    """Leaves to be, before anything is worked out.

    Attributes:
        leaf: shape (n,).
        parent: shape (n,).
        pair: shape (n,), number of the pair of variables.
    """

    leaf: Int64
    parent: Int64
    pair: Int64


def peel(potentials: Potentials, *, maximise: bool, fewest: int = FEWEST) -> tuple[Potentials, tuple[Leaves, ...]]:
    """Eliminates leaves.

    Args:
        potentials: of a network.
        maximise: take maxima, not sums.
        fewest: smallest number of leaves worth a round.

    Returns:
        Potentials over the same variables in which the leaves have one value and no cells, and the leaves in the order
        in which they went.
    """
    pairs = next((c for c in potentials.cells if c.scope.shape[1] == 2), None)
    if pairs is None or len(pairs.amount) < fewest:
        return potentials, ()
    n = len(potentials.cardinality)
    key = pairs.scope[:, 0].astype(np.int64) * n + pairs.scope[:, 1]
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    names = np.stack(np.divmod(key[order][first], n), axis=1)
    rounds = _rounds(potentials, names, fewest)
    starts = np.append(first, len(key))
    sorted_cells = Cells(pairs.scope[order], pairs.value[order], pairs.amount[order])
    start, single = _single(potentials)
    leaves: list[Leaves] = []
    for edge in rounds:
        for same in _by_shape(edge, potentials.cardinality):
            table = _tables(same, sorted_cells, starts, potentials.cardinality)
            table += single[start[same.leaf, None] + np.arange(table.shape[1])][:, :, None]
            message, table = _message(table, maximise)
            np.add.at(single, start[same.parent, None] + np.arange(message.shape[1]), message)
            leaves.append(Leaves(same.leaf, same.parent, table))
    return _core(potentials, single, leaves), tuple(leaves)


def _rounds(potentials: Potentials, names: Int64, fewest: int) -> list[_Edge]:
    """Which variables go in which round.

    Args:
        potentials: of a network.
        names: shape (n_pairs, 2), the pairs of variables that share cells of arity 2.
        fewest: smallest number of leaves worth a round.
    """
    n = len(potentials.cardinality)
    bound = np.zeros(n, np.bool_)
    for c in potentials.cells:
        if c.scope.shape[1] > 2:
            bound[c.scope.ravel()] = True
    for chains in potentials.chains:
        bound[chains.variable.ravel()] = True
    left = np.arange(len(names))
    rounds: list[_Edge] = []
    while True:
        ends = names[left]
        small = np.prod(potentials.cardinality[ends], axis=1, dtype=np.int64) <= _LARGEST
        leaf = (np.bincount(ends.ravel(), minlength=n) == 1) & ~bound
        goes = leaf[ends] & small[:, None]
        which = goes.any(axis=1)
        if np.count_nonzero(which) < fewest:
            return rounds
        first = goes[which, 0]
        a, b = ends[which].T
        rounds.append(_Edge(np.where(first, a, b), np.where(first, b, a), left[which]))
        left = left[~which]


def _single(potentials: Potentials) -> tuple[Int64, Float]:
    """Where the values of each variable start, and the amounts that each value gains by itself."""
    cardinality = potentials.cardinality
    start = starts_of(cardinality)
    amount = np.zeros(int(cardinality.sum()))
    for c in potentials.cells:
        if c.scope.shape[1] == 1:
            np.add.at(amount, start[c.scope[:, 0]] + c.value[:, 0], c.amount)
    return start, amount


def _by_shape(edge: _Edge, cardinality: Int32) -> list[_Edge]:
    """Leaves with equal cardinalities, their parents' included."""
    shapes, which = np.unique(
        np.stack([cardinality[edge.leaf], cardinality[edge.parent]], axis=1), axis=0, return_inverse=True
    )
    rows = [np.flatnonzero(which.ravel() == i) for i in range(len(shapes))]
    return [_Edge(edge.leaf[r], edge.parent[r], edge.pair[r]) for r in rows]


def _tables(edge: _Edge, cells: Cells, starts: Int64, cardinality: Int32) -> Float:
    """Log-potentials of each leaf and its parent: shape (n, cardinality of leaf, of parent)."""
    counts = starts[edge.pair + 1] - starts[edge.pair]
    table = np.repeat(np.arange(len(edge.pair)), counts)
    within = np.arange(len(table)) - np.repeat(np.cumsum(counts) - counts, counts)
    rows = starts[edge.pair][table] + within
    axis = (cells.scope[rows] != edge.leaf[table][:, None]).astype(np.int64)
    shape = int(cardinality[edge.leaf[0]]), int(cardinality[edge.parent[0]])
    return fill(len(edge.pair), shape, [Placed(table, axis, cells.value[rows].astype(np.int64), cells.amount[rows])])


def _message(table: Float, maximise: bool) -> tuple[Float, Float]:
    """What the parents gain, and what has to be kept to get back."""
    peak = table.max(axis=1)
    if maximise:
        return peak, table
    peak[np.isneginf(peak)] = 0.0
    weight = np.exp(table - peak[:, None, :])
    mass = weight.sum(axis=1)
    with np.errstate(divide="ignore"):
        message = peak + np.log(mass)
    return message, weight / np.where(mass > 0, mass, 1.0)[:, None, :]


def _core(potentials: Potentials, single: Float, leaves: list[Leaves]) -> Potentials:
    """What is left."""
    gone = np.zeros(len(potentials.cardinality), np.bool_)
    for group in leaves:
        gone[group.variable] = True
    start, cardinality = starts_of(potentials.cardinality), potentials.cardinality
    variable = np.repeat(np.arange(len(gone), dtype=np.int32), cardinality)
    value = (np.arange(len(variable)) - np.repeat(start, cardinality)).astype(np.int32)
    own = Cells(variable[:, None], value[:, None], single)
    cells = [_pick(own, (single != 0) & ~gone[variable])]
    for c in potentials.cells:
        if c.scope.shape[1] > 1:
            cells.append(_pick(c, np.logical_not(gone[c.scope].any(axis=1))))
    left = np.where(gone, 1, cardinality).astype(np.int32)
    return replace(potentials, cardinality=left, cells=tuple(c for c in cells if len(c.amount)))


def _pick(cells: Cells, which: Bool) -> Cells:
    """Some of the cells."""
    return Cells(cells.scope[which], cells.value[which], cells.amount[which])


def with_parents(gone: Sequence[Gone], wanted: Bool) -> Bool:
    """The wanted variables and those that they hang on."""
    wanted = wanted.copy()
    for group in gone:
        wanted[group.hangs_on[wanted[group.variable]]] = True
    return wanted


def changed_by(gone: Sequence[Gone]) -> Int64:
    """The variables that others hung on."""
    return np.concatenate([group.hangs_on for group in gone] or [np.zeros(0, np.int64)])


def put_back_values(leaves: tuple[Leaves, ...], values: Int64) -> None:
    """Gives each leaf its best value, once those of the rest are known (after maxima)."""
    for group in reversed(leaves):
        at_parent = group.table[np.arange(len(group.variable)), :, values[group.parent]]
        values[group.variable] = at_parent.argmax(axis=1)


def put_back_distributions(leaves: tuple[Leaves, ...], start: Int64, probability: Float) -> None:
    """Gives each leaf its distribution, once those of the rest are known (after sums).

    Args:
        leaves: as they went.
        start: shape (n_variables,), where each distribution starts.
        probability: shape (total cardinality,), filled in here.
    """
    for group in reversed(leaves):
        n_values, n_parent = group.table.shape[1:]
        parent = probability[start[group.parent, None] + np.arange(n_parent)]
        own = np.einsum("nvp,np->nv", group.table, parent)
        probability[start[group.variable, None] + np.arange(n_values)] = own


def put_back_labels(gone: Sequence[Gone], label: Int32) -> Int32:
    """Components of all variables, those that are gone in that of what they hung on."""
    label = label.copy()
    for group in reversed(gone):
        label[group.variable] = label[group.hangs_on]
    return label
