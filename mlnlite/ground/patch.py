"""Factors taken out of blocks and put in: blocks whose rows are in the order in which `merge` leaves them, in and out.

Rows are found by bisection, and each array is copied once, so that what stays costs little more than its memory.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.blocks import Blocks
from mlnlite.ground.index import index_in
from mlnlite.ground.merge import Factors
from mlnlite.ground.network import Clauses, Counts, Tables
from mlnlite.model.change import spliced

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

Block = TypeVar("Block", Clauses, Tables, Counts)

CHUNK = 1 << 16
"""Numbers that are changed at once, so that they stay in the cache."""

FEW = 4
"""Atoms that may come or go for the others to be numbered anew by sums, which is faster than by a table."""

Renumber = Callable[[Int32, Int32], Int32]
"""Writes literals with the atoms' new indices to the second array, which may be the first, and returns it."""


def patched(blocks: Blocks, taken: Blocks, put: Blocks, dropped: Bool, atoms: tuple[Int64, Int64]) -> Blocks:
    """The blocks less the counts of some factors, all of which they have, and with others, equal ones made one.

    Args:
        blocks: whose.
        taken: what to take away.
        put: what to add, with the indices that atoms have afterwards.
        dropped: shape (n_weights,), weights of which every factor goes.
        atoms: the numbers of the atoms before and after, both rising.
    """
    renumber = _renumbering(*atoms)

    def combined(mine: Sequence[Block], less: Sequence[Block], more: Sequence[Block]) -> tuple[Block, ...]:
        return _combined(mine, less, more, lambda a, b, c: _changed(a, b, c, dropped, renumber))

    return Blocks(
        combined(blocks.clauses, taken.clauses, put.clauses),
        combined(blocks.tables, taken.tables, put.tables),
        combined(blocks.counts, taken.counts, put.counts),
    )


# --- blocks as rows of literals


def _combined(
    blocks: Sequence[Block],
    less: Sequence[Block],
    more: Sequence[Block],
    combine: Callable[[Factors, Factors, Factors], Factors],
) -> tuple[Block, ...]:
    """Blocks of the same shape combined, those that come out empty left out."""
    mine, taken, put = ({_shape(b): b for b in side} for side in (blocks, less, more))
    found = []
    for shape, block in {**mine, **put}.items():
        sides = (_rows(side[shape]) if shape in side else _no_rows(block) for side in (mine, taken, put))
        rows, weight, count = combine(*sides)
        for array in (rows, weight, count):
            array.setflags(write=False)
        found.append(_with_rows(block, rows, weight, count))
    return tuple(b for b in found if len(b.weight))


def _shape(block: Clauses | Tables | Counts) -> Hashable:
    if isinstance(block, Clauses):
        return block.literals.shape[1], block.negated
    if isinstance(block, Tables):
        return block.truth.shape, block.truth.tobytes()
    return block.true.tobytes(), block.steps.tobytes()


def _rows(block: Clauses | Tables | Counts) -> Factors:
    literals = block.atoms + np.int32(1) if isinstance(block, Tables) else block.literals
    return literals, block.weight, block.count


def _no_rows(block: Clauses | Tables | Counts) -> Factors:
    rows, weight, count = _rows(block)
    return rows[:0], weight[:0], count[:0]


def _with_rows(block: Block, rows: Int32, weight: Int32, count: Int64) -> Block:
    if isinstance(block, Tables):
        return replace(block, atoms=rows - np.int32(1), weight=weight, count=count)
    return replace(block, literals=rows, weight=weight, count=count)


# --- rows


def _changed(mine: Factors, less: Factors, more: Factors, dropped: Bool, renumber: Renumber | None) -> Factors:
    rows, weight, count = mine
    if not len(less[1]) and not len(more[1]) and not dropped.any():
        return rows if renumber is None else renumber(rows, np.empty_like(rows)), weight, count
    place = _places(less, len(weight), lambda i: (rows[i], weight[i]))
    left = count[place] - less[2]
    gone = place[left == 0]
    if dropped.any():
        gone = np.union1d(gone, np.flatnonzero(dropped[weight]))
    before = gone - np.arange(len(gone))

    def staying(i: Int64) -> tuple[Int32, Int32]:
        i = i + np.searchsorted(before, i, side="right")
        found = rows[i]
        return found if renumber is None else renumber(found, found), weight[i]

    n_left = len(weight) - len(gone)
    at = _places(more, n_left, staying)
    there = at < n_left
    found_rows, found_weight = staying(at[there])
    there[there] = (found_weight == more[1][there]) & (found_rows == more[0][there]).all(axis=1)
    new, at_new = ~there, at[~there]
    count = _recounted(
        spliced(count, gone, at_new, more[2][new]) if len(gone) + len(at_new) else count.copy(),
        np.concatenate([(place - np.searchsorted(gone, place))[left > 0], at[there]]),
        np.concatenate([-less[2][left > 0], more[2][there]]),
        at_new,
    )
    changed = spliced(rows, gone, at_new, more[0][new])
    if renumber is not None:
        changed = renumber(changed, changed if changed is not rows else np.empty_like(rows))
        changed[at_new + np.arange(len(at_new))] = more[0][new]  # these had their new indices
    return changed, spliced(weight, gone, at_new, more[1][new]), count


def _recounted(count: Int64, staying: Int64, by: Int64, at_new: Int64) -> Int64:
    """Counts with some changed: of rows that stayed, each of which new rows have come before."""
    np.add.at(count, staying + np.searchsorted(at_new, staying, side="right"), by)
    return count


def _places(wanted: Factors, n: int, row_at: Callable[[Int64], tuple[Int32, Int32]]) -> Int64:
    """Where rows stand, or would stand, among `n` rows in rising order, which `row_at` gives by their indices."""
    low, high = np.zeros(len(wanted[1]), np.int64), np.full(len(wanted[1]), n, np.int64)
    for _ in range(n.bit_length() if len(low) else 0):
        middle, searched = np.minimum((low + high) // 2, n - 1), low < high
        less = _less(*row_at(middle), wanted)
        low, high = np.where(searched & less, middle + 1, low), np.where(searched & ~less, middle, high)
    return low


def _less(rows: Int32, weight: Int32, wanted: Factors) -> Bool:
    """Whether rows stand before others in the order of `merge`."""
    less = np.zeros(len(weight), np.bool_)
    for mine, other in zip(reversed(_ranks(rows).T), reversed(_ranks(wanted[0]).T), strict=True):
        less = (mine < other) | (mine == other) & less
    return np.asarray((weight < wanted[1]) | (weight == wanted[1]) & less)


def _ranks(literals: Int32) -> Int64:
    """By what rows are in order: the atom of a literal, then whether it is negative."""
    return np.abs(literals, dtype=np.int64) * 2 + (literals < 0)


# --- indices of atoms


def _renumbering(before: Int64, after: Int64) -> Renumber | None:
    """What gives literals their new indices; None if these are the old ones. Atoms that are gone are in no literal."""
    steps = _steps(before, after)
    if steps is None:
        atom = index_in(after, len(before))(before)
        literal = np.concatenate([np.zeros(1, np.int32), atom + np.int32(1), -atom[::-1] - np.int32(1)])
        return lambda literals, out: literal.take(literals, out=out, mode="wrap")
    return (lambda literals, out: _moved(literals, steps, out)) if steps else None


def _steps(before: Int64, after: Int64) -> list[tuple[int, int]] | None:
    """By how much the numbers of literals above some numbers change; None if there are many of these."""
    steps: list[tuple[int, int]] = []
    i = j = 0
    while True:
        n = min(len(before) - i, len(after) - j)
        differ = before[i : i + n] != after[j : j + n]
        same = int(differ.argmax()) if differ.any() else n
        i, j = i + same, j + same
        if i == len(before) and j == len(after):
            return steps
        if len(steps) == FEW:
            return None
        if j == len(after) or (i < len(before) and before[i] < after[j]):
            i += 1  # the literals of the atom that goes have the number i + 1
            steps.append((i, -1))
        else:
            steps.append((i, 1))
            j += 1


def _moved(literals: Int32, steps: list[tuple[int, int]], out: Int32) -> Int32:
    flat, moved = literals.reshape(-1), out.reshape(-1)
    for start in range(0, len(flat), CHUNK):
        part = flat[start : start + CHUNK]
        by = np.zeros(len(part), np.int8)
        for number, step in steps:
            by += np.int8(step) * ((part > number).view(np.int8) - (part < -number).view(np.int8))
        np.add(part, by, out=moved[start : start + CHUNK])
    return out
