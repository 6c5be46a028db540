"""Functions of a state to the simplest factors: comes in how far each atom moves the state, go out shapes.

The state of a ground formula is a sum over its true atoms, each with a step of its own, so a number of true atoms is a
state and so are several numbers at once (as digits). What is known only shifts the state, so all that is left of many
rows is found by arithmetic on whole columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.network import Counts
from mlnlite.ground.residual import ClauseShape, CountShape, Decided, TableShape

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]

NONE = -1
"""In place of an atom: nothing."""

NARROW = 4
"""Atoms of a function that is as well kept as a truth table."""


@dataclass(frozen=True, slots=True)
class Reduced:
    """Rows that leave the same function.

    Attributes:
        index: shape (n,), which rows.
        shape: the function, of `atoms`.
        atoms: for each atom of the shape a column, shape (n,).
        certain: how many groundings are true whatever the atoms are; the shape says how many more.
    """

    index: Int64
    shape: Decided | ClauseShape | TableShape | CountShape
    atoms: tuple[Int64, ...]
    certain: int


def reduced(atoms: Int64, steps: Int64, offset: Int64, true: Int64) -> list[Reduced]:
    """What some rows leave, gathered by shape.

    Args:
        atoms: shape (n, m), or `NONE`; one atom may stand several times in a row.
        steps: shape (n, m), what the state gains where the atom is true.
        offset: shape (n,), the state where no atom is true.
        true: shape (n_states,), number of true groundings at each state.
    """
    atoms, steps = _each_once(atoms, steps)
    present = (atoms != NONE) & (steps != 0)
    values = np.unique(steps[present])
    kind = np.where(present, np.searchsorted(values, steps), len(values))
    n_of_kind = [(kind == i).sum(axis=1) for i in range(len(values))]
    atoms = np.take_along_axis(atoms, np.argsort(kind, axis=1, kind="stable"), 1)
    cases, case = np.unique(np.stack([offset, *n_of_kind], axis=1), axis=0, return_inverse=True)
    rows = np.argsort(case.reshape(-1), kind="stable")
    ends = np.cumsum(np.bincount(case.reshape(-1), minlength=len(cases)))
    found = []
    for index, (start, *sizes) in zip(np.split(rows, ends[:-1]), cases.tolist(), strict=True):
        kept, shape, certain = _shape(true, start, values, sizes)
        firsts = np.cumsum([0, *sizes])
        columns = [c for i in kept for c in range(firsts[i], firsts[i + 1])]
        found.append(Reduced(index, shape, tuple(atoms[index, c] for c in columns), certain))
    return found


def _each_once(atoms: Int64, steps: Int64) -> tuple[Int64, Int64]:
    """The atoms of each row in rising order; the steps of equal ones added up in the place of the first."""
    order = np.argsort(atoms, axis=1, kind="stable")
    atoms, steps = np.take_along_axis(atoms, order, 1), np.take_along_axis(steps, order, 1)
    again = np.zeros(atoms.shape, np.bool_)
    again[:, 1:] = (atoms[:, 1:] == atoms[:, :-1]) & (atoms[:, 1:] != NONE)
    if not again.any():
        return atoms, steps
    first = np.flatnonzero(~again.ravel())
    sums = np.zeros(atoms.size, np.int64)
    sums[first] = np.add.reduceat(steps.ravel(), first)
    return np.where(again, NONE, atoms), sums.reshape(atoms.shape)


def _shape(
    true: Int64, start: int, values: Int64, sizes: Sequence[int]
) -> tuple[list[int], Decided | ClauseShape | TableShape | CountShape, int]:
    """Kinds of atoms that matter, the function of them, and the number of groundings that are true in any case.

    Args:
        true: see `reduced`.
        start: the state where no atom is true.
        values: step of each kind of atom.
        sizes: number of atoms of each kind.
    """
    kept = [i for i, n in enumerate(sizes) if n]
    state = np.array(start)
    for i in kept:
        state = np.add.outer(state, values[i] * np.arange(sizes[i] + 1))
    grid = true[state]
    certain = int(grid.min())
    for axis in reversed(range(len(kept))):
        if (np.diff(grid, axis=axis) == 0).all():
            grid = grid.take(0, axis)
            del kept[axis]
    return kept, shape_of_counts(grid - certain, [sizes[i] for i in kept]), certain


def shape_of_counts(grid: Int64, sizes: Sequence[int]) -> Decided | ClauseShape | TableShape | CountShape:
    """The simplest shape of a function of several counts.

    Args:
        grid: shape (sizes[0] + 1, sizes[1] + 1, ...), number of true groundings; the smallest is 0.
        sizes: number of atoms of each count; no count without influence.
    """
    if not len(sizes):
        return Decided(truth=False)
    n_atoms = sum(sizes)
    if grid.max() == 1:
        for outlier in (0, 1):
            cells = np.argwhere(grid == outlier)
            if len(cells) == 1 and all(j in (0, n) for j, n in zip(cells[0], sizes, strict=True)):
                signs = np.repeat(cells[0] == 0, sizes)
                return ClauseShape(tuple(range(n_atoms)), tuple(signs.tolist()), negated=outlier == 1)
        if n_atoms <= NARROW:
            return TableShape(tuple(range(n_atoms)), spread(grid, sizes).astype(np.bool_))
    strides = [int(np.prod(grid.shape[i + 1 :])) for i in range(len(sizes))]
    return CountShape(tuple(np.repeat(strides, sizes).tolist()), tuple(grid.ravel().tolist()))


def counts_of(shape: CountShape, rows: Int32, weight: Int32, count: Int64) -> Counts:
    """Counting factors of one shape.

    Args:
        shape: of all.
        rows: shape (n, m), index of each atom.
        weight: shape (n,).
        count: shape (n,).
    """
    return Counts(rows + np.int32(1), np.array(shape.true), weight, count, np.array(shape.steps, np.int32))


def spread(grid: Int64, sizes: Sequence[int]) -> Int64:
    """A function of several counts as one of the atoms that are counted, shape (2,) * sum(sizes)."""
    digits = np.indices((2,) * sum(sizes))
    return np.asarray(grid[tuple(part.sum(axis=0) for part in np.split(digits, np.cumsum(sizes)[:-1]))])
