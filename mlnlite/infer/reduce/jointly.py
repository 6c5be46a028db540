"""Variables with few joint states, by hard formulas, as one: comes in a component, goes out one with fewer variables.

Levels of a scale (`Above(x, 3) => Above(x, 2).`), definitions (`Both(x) <=> First(x) ^ Second(x).`), copies leave far
fewer states than their variables have values to combine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from mlnlite.ground.network import Float, Int32, Int64
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.parts import Part

_MOST_STATES, _MOST_GROWTH, _MOST_CELLS = 64, 1.5, 50_000
"""Of a group; how many times as many a further variable may make them; cells to rewrite, and of the result."""

Literals = tuple[tuple[int, int], ...]
"""Variables and the values that they have."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A component with groups of variables as one variable each.

    Attributes:
        part: the smaller component.
        cardinality: shape (n,), of the variables as they were.
        owner: shape (n,), the variable of `part` that stands for each variable.
        value: for each variable, shape (n_states of its group,): its value in each state.
    """

    part: Part
    cardinality: Int32
    owner: Int64
    value: tuple[Int64, ...]

    def distribution(self, variable: int, of_owner: Float) -> Float:
        """The distribution of a variable of the component from that of the one that stands for it."""
        return np.bincount(self.value[variable], of_owner, self.cardinality[variable]).astype(np.float64)


def jointly(part: Part) -> Joint | None:
    """Merges variables where hard formulas leave few states; None if there are none, or too much to rewrite."""
    hard = any(np.isneginf(c.amount).any() for c in part.cells)
    if not hard or sum(len(c.amount) for c in part.cells) > _MOST_CELLS:
        return None
    groups = _groups(part)
    if len(groups) == len(part.variables) or any(not len(states) for _, states in groups):
        return None
    owner, value = np.zeros(len(part.variables), np.int64), [np.zeros(0, np.int64)] * len(part.variables)
    for i, (members, states) in enumerate(groups):
        owner[members] = i
        for v, column in zip(members, states.T, strict=True):
            value[v] = column
    cells = _rewritten(part, owner, value)
    if cells is None:
        return None
    cardinality = np.array([len(states) for _, states in groups], np.int32)
    smaller = replace(part, variables=np.arange(len(groups)), cardinality=cardinality, cells=cells)
    return Joint(smaller, part.cardinality, owner, tuple(value))


def _groups(part: Part) -> list[tuple[list[int], Int64]]:
    """Groups of variables, each with its states: shape (n_states, n_members)."""
    forbidden: list[list[Literals]] = [[] for _ in part.variables]
    for cells in part.cells:
        for row in np.flatnonzero(np.isneginf(cells.amount)).tolist():
            literals = tuple(zip(cells.scope[row].tolist(), cells.value[row].tolist(), strict=True))
            for v, _ in literals:
                forbidden[v].append(literals)
    groups, taken = [], np.zeros(len(part.variables), np.bool_)
    for v in np.argsort([-len(f) for f in forbidden], kind="stable").tolist():
        if not taken[v]:
            groups.append(_grown(v, part, forbidden, taken))
            taken[groups[-1][0]] = True
    return groups


def _grown(start: int, part: Part, forbidden: Sequence[list[Literals]], taken: np.ndarray) -> tuple[list[int], Int64]:
    """A group around a variable: joined by what leaves fewest states, as long as these are few."""
    members, states = [start], np.arange(part.cardinality[start], dtype=np.int64)[:, None]
    while True:
        near = {u for v in members for f in forbidden[v] for u, _ in f if u not in members and not taken[u]}
        tried = [(u, _with(u, members, states, part, forbidden)) for u in sorted(near)]
        if not tried:
            return members, states
        u, more = min(tried, key=lambda t: len(t[1]))
        if len(more) > min(_MOST_STATES, _MOST_GROWTH * len(states)) or len(more) == len(states) * part.cardinality[u]:
            return members, states
        members, states = [*members, u], more


def _with(u: int, members: list[int], states: Int64, part: Part, forbidden: Sequence[list[Literals]]) -> Int64:
    """The states of a group with a further variable."""
    n_values = int(part.cardinality[u])
    more = np.column_stack([np.repeat(states, n_values, axis=0), np.tile(np.arange(n_values), len(states))])
    column = {v: i for i, v in enumerate([*members, u])}
    for literals in forbidden[u]:
        if all(v in column for v, _ in literals):
            more = more[~np.all([more[:, column[v]] == value for v, value in literals], axis=0)]
    return more


def _rewritten(part: Part, owner: Int64, value: Sequence[Int64]) -> tuple[Cells, ...] | None:
    """Cells over groups; None if they are too many."""
    amounts: dict[Literals, float] = {}
    for cells in part.cells:
        for scope, values, amount in zip(
            cells.scope.tolist(), cells.value.tolist(), cells.amount.tolist(), strict=True
        ):
            holds: dict[int, np.ndarray] = {}
            for v, x in zip(scope, values, strict=True):
                g = int(owner[v])
                holds[g] = holds.get(g, np.array(True)) & (value[v] == x)
            for states in product(*(np.flatnonzero(holds[g]).tolist() for g in sorted(holds))):
                key = tuple(zip(sorted(holds), states, strict=True))
                amounts[key] = amounts.get(key, 0.0) + amount
            if len(amounts) > _MOST_CELLS:
                return None
    found = []
    for arity in sorted({len(key) for key in amounts}):
        rows = {key: a for key, a in amounts.items() if len(key) == arity}
        table = np.array(list(rows), np.int32)
        found.append(Cells(table[:, :, 0], table[:, :, 1], np.array(list(rows.values()))))
    return tuple(found)
