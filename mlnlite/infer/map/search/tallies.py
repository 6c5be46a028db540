"""Counting factors as local search sees them: come in chains, go out flat arrays of how values move their states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlnlite.ground.network import Float, Int32, Int64
from mlnlite.infer.reduce.counting import Chains


@dataclass(frozen=True, slots=True)
class Tallies:
    """The state of each counting factor is its base and what the values that hold add to it.

    Attributes:
        begin: shape (total cardinality + 1,), where the entries of each value start.
        factor: shape (n_entries,), the factor that each value moves.
        step: shape (n_entries,), by how much.
        value: shape (n_entries,), the value of each entry, rising.
        base: shape (n_factors,).
        offset: shape (n_factors,), where the worths of the states of each start.
        table: worths, finite: what is forbidden costs more than all that a world can gain otherwise.
        most: shape (n_factors,), the largest worth of each.
        move: shape (n_factors,), the most that one count is worth more than the next one that is possible.
        first: shape (n_factors + 1,), where the values that move each factor start in `mover`.
        mover: shape (n_entries,), these values.
    """

    begin: Int64
    factor: Int32
    step: Int64
    value: Int64
    base: Int64
    offset: Int64
    table: Float
    most: Float
    move: Float
    first: Int64
    mover: Int64

    @property
    def arrays(self) -> tuple[Int64, Int32, Int64, Int64, Float, Float]:
        """What kernels need."""
        return self.begin, self.factor, self.step, self.offset, self.table, self.most

    def states(self, holds: Int32) -> Int64:
        """State of each factor.

        Args:
            holds: shape (total cardinality,), 1 for the values that hold.
        """
        state = self.base.copy()
        np.add.at(state, self.factor, self.step * holds[self.value])
        return state

    def gains(self, holds: Int32) -> Float:
        """What each factor gains, see `states`; forbidden states at their penalty."""
        return np.asarray(self.table[self.offset + self.states(holds)])


def range_of(chains: Sequence[Chains]) -> float:
    """What counting factors can gain or lose at most, forbidden states aside."""
    most = 0.0
    for c in chains:
        for rows, worth in c.scaled():
            most += float(np.abs(worth[np.isfinite(worth)]).max(initial=0.0)) * len(rows)
    return most


def tallies_of(chains: Sequence[Chains], start: Int64, penalty: float) -> Tallies:
    """The arrays of chains.

    Args:
        chains: of a component.
        start: shape (n + 1,), where the values of each variable start in an array over all values.
        penalty: what a forbidden state costs.
    """
    n, value, step, factor = 0, [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    base, table, lengths, move = [np.zeros(0, np.int64)], [np.zeros(0)], [np.zeros(0, np.int64)], [np.zeros(0)]
    for c in chains:
        for rows, worth in c.scaled():
            equal, shape = c.equal[rows], (len(rows), len(c.steps))
            value.append((start[c.variable[rows]] + c.value[rows]).ravel())
            step.append((np.where(equal, 1, -1) * c.steps).astype(np.int64).ravel())
            factor.append(np.broadcast_to(n + np.arange(len(rows))[:, None], shape).ravel())
            base.append(np.where(equal, 0, c.steps).sum(axis=1))
            table.append(np.tile(np.where(np.isneginf(worth), -penalty, worth), len(rows)))
            lengths.append(np.full(len(rows), len(worth)))
            move.append(np.full(len(rows), np.abs(np.diff(worth[np.isfinite(worth)])).max(initial=0.0)))
            n += len(rows)
    values, sizes, owner, worths = (
        np.concatenate(value),
        np.concatenate(lengths),
        np.concatenate(factor),
        np.concatenate(table),
    )
    order, offset = np.argsort(values, kind="stable"), np.cumsum(sizes) - sizes
    return Tallies(
        np.searchsorted(values[order], np.arange(start[-1] + 1)), owner[order].astype(np.int32),
        np.concatenate(step)[order], values[order], np.concatenate(base), offset, worths,
        np.maximum.reduceat(worths, offset) if n else np.zeros(0), np.concatenate(move),
        np.searchsorted(owner, np.arange(n + 1)), values,
    )  # fmt: skip
