"""A component as local search sees it: comes in a component, go out flat arrays, moves and their worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32, Int64
from mlnlite.infer.map.search.tallies import Tallies, range_of, tallies_of
from mlnlite.infer.reduce.parts import Part


@dataclass(frozen=True, slots=True)
class Landscape:
    """Cells by the values that they need.

    Attributes:
        start: shape (n + 1,), where the values of each variable start in an array over all values.
        begin: shape (total cardinality + 1,), where the cells of each value start.
        cell: shape (n_literals,), the cells that need each value.
        first: shape (n_cells + 1,), where the literals of each cell start.
        literal: shape (n_literals,), the values that each cell needs, as places among all values.
        amount: shape (n_cells,), finite: forbidden cells cost more than all that a world can gain otherwise.
        hard: shape (n_cells,), the forbidden ones.
        tallies: counting factors.
    """

    start: Int64
    begin: Int64
    cell: Int32
    first: Int64
    literal: Int32
    amount: Float
    hard: Bool
    tallies: Tallies


def landscape_of(part: Part) -> Landscape:
    """The arrays of a component."""
    start = np.concatenate([[0], np.cumsum(part.cardinality, dtype=np.int64)])
    amount = np.concatenate([np.zeros(0), *(c.amount for c in part.cells)])
    widths = np.concatenate([np.zeros(0, np.int64), *(np.full(len(c.amount), c.scope.shape[1]) for c in part.cells)])
    literal = np.concatenate([np.zeros(0, np.int64), *((start[c.scope] + c.value).ravel() for c in part.cells)])
    owner = np.repeat(np.arange(len(amount), dtype=np.int32), widths)
    order = np.argsort(literal, kind="stable")
    begin = np.searchsorted(literal[order], np.arange(start[-1] + 1))
    hard = np.isneginf(amount)
    penalty = 1.0 + 2.0 * (float(np.abs(amount[~hard]).sum()) + range_of(part.chains))
    return Landscape(
        start, begin, owner[order], np.concatenate([[0], np.cumsum(widths)]), literal.astype(np.int32),
        np.where(hard, -penalty, amount), hard, tallies_of(part.chains, start, penalty),
    )  # fmt: skip


def holding(landscape: Landscape, world: Int64) -> Int32:
    """1 for the values that hold in a world; shape (total cardinality,)."""
    holds = np.zeros(int(landscape.start[-1]), np.int32)
    holds[landscape.start[:-1] + world] = 1
    return holds


def missing_of(landscape: Landscape, world: Int64) -> Int32:
    """For each cell, how many of its literals do not hold in a world; shape (n_cells,)."""
    lengths = np.diff(landscape.first)
    true = np.zeros(len(lengths), np.int32)
    np.add.at(true, np.repeat(np.arange(len(lengths)), lengths), holding(landscape, world)[landscape.literal])
    return (lengths - true).astype(np.int32)


def worth(landscape: Landscape, world: Int64) -> float:
    """What a world gains, what is forbidden at its penalty."""
    of_counts = landscape.tallies.gains(holding(landscape, world)).sum()
    return float(landscape.amount[missing_of(landscape, world) == 0].sum() + of_counts)
