"""Factors taken out of blocks and put in: blocks whose rows are in the order in which `merge` leaves them, in and out.

Rows are found by bisection, so that what stays is only copied.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.assemble import index_in
from mlnlite.ground.blocks import Blocks
from mlnlite.ground.merge import Factors
from mlnlite.ground.network import Clauses, Counts, Tables

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

Block = TypeVar("Block", Clauses, Tables, Counts)
Array = NDArray[Any]


def without(blocks: Blocks, less: Blocks, dropped: Bool) -> Blocks:
    """The blocks less the counts of other factors, all of which they have.

    Args:
        blocks: whose.
        less: what to take away.
        dropped: shape (n_weights,), weights of which every factor goes.
    """
    return _pairwise(blocks, less, lambda rows, other: _without(rows, other, dropped))


def together(blocks: Blocks, more: Blocks) -> Blocks:
    """The factors of both, equal ones made one."""
    return _pairwise(blocks, more, _together)


def renumbered(blocks: Blocks, before: Int64, after: Int64) -> Blocks:
    """The blocks with the indices that their atoms have among those of `after`, not of `before`, both rising."""
    if np.array_equal(before, after):
        return blocks
    atom = index_in(after)(before)  # those that are gone are in no row
    literal = np.concatenate([np.zeros(1, np.int32), atom + np.int32(1), -atom[::-1] - np.int32(1)])
    return Blocks(
        tuple(replace(b, literals=literal.take(b.literals, mode="wrap")) for b in blocks.clauses),
        tuple(replace(b, atoms=atom.take(b.atoms)) for b in blocks.tables),
        tuple(replace(b, literals=literal.take(b.literals, mode="wrap")) for b in blocks.counts),
    )


# --- blocks as rows


def _pairwise(blocks: Blocks, others: Blocks, combine: Callable[[Factors, Factors], Factors]) -> Blocks:
    return Blocks(
        _combined(blocks.clauses, others.clauses, combine),
        _combined(blocks.tables, others.tables, combine),
        _combined(blocks.counts, others.counts, combine),
    )


def _combined(
    blocks: Sequence[Block], others: Sequence[Block], combine: Callable[[Factors, Factors], Factors]
) -> tuple[Block, ...]:
    """Blocks of the same shape combined, those that come out empty left out."""
    mine: dict[Hashable, Block] = {_shape(b): b for b in blocks}
    theirs: dict[Hashable, Block] = {_shape(b): b for b in others}
    found = []
    for shape in (*mine, *(s for s in theirs if s not in mine)):
        block = mine.get(shape) or theirs[shape]
        first, second = (_rows(side[shape]) if shape in side else _no_rows(block) for side in (mine, theirs))
        rows, weight, count = combine(first, second)
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
    return block.atoms if isinstance(block, Tables) else block.literals, block.weight, block.count


def _no_rows(block: Clauses | Tables | Counts) -> Factors:
    rows, weight, count = _rows(block)
    return rows[:0], weight[:0], count[:0]


def _with_rows(block: Block, rows: Int32, weight: Int32, count: Int64) -> Block:
    if isinstance(block, Tables):
        return replace(block, atoms=rows, weight=weight, count=count)
    return replace(block, literals=rows, weight=weight, count=count)


# --- rows


def _without(factors: Factors, less: Factors, dropped: Bool) -> Factors:
    rows, weight, count = factors
    if not len(less[1]) and not dropped.any():
        return factors
    place = _places(factors, less)
    left = count.copy()
    left[place] -= less[2]
    if not dropped.any():
        gone = place[left[place] == 0]
        return _deleted(rows, gone), _deleted(weight, gone), _deleted(left, gone)
    keep = np.flatnonzero((left > 0) & ~dropped[weight])
    return rows[keep], weight[keep], left[keep]


def _together(factors: Factors, more: Factors) -> Factors:
    rows, weight, count = factors
    if not len(more[1]):
        return factors
    place = _places(factors, more)
    there = np.zeros(len(place), np.bool_)
    if len(weight):
        inside = np.minimum(place, len(weight) - 1)
        there = (weight[inside] == more[1]) & (rows[inside] == more[0]).all(axis=1)
    count = count.copy()
    count[place[there]] += more[2][there]
    new, at = ~there, place[~there]
    return _inserted(rows, at, more[0][new]), _inserted(weight, at, more[1][new]), _inserted(count, at, more[2][new])


FEW = 1000
"""Rows up to which an array is cut into pieces: these are copied whole, which is faster than by an index or a mask."""


def _deleted(array: Array, at: Int64) -> Array:
    """An array without some rows, whose indices rise."""
    if len(at) > FEW:
        return np.delete(array, at, axis=0)
    if not len(at):
        return array
    first, *others = np.split(array, at)
    return np.concatenate([first, *(part[1:] for part in others)])


def _inserted(array: Array, at: Int64, rows: Array) -> Array:
    """An array with rows put in before those at some indices, which rise."""
    if len(at) > FEW:
        return np.insert(array, at, rows, axis=0)
    if not len(at):
        return array
    first, *others = np.split(array, at)
    return np.concatenate([first, *(part for i, old in enumerate(others) for part in (rows[i : i + 1], old))])


def _places(factors: Factors, wanted: Factors) -> Int64:
    """Where rows stand, or would stand: the number of rows before each."""
    low = np.zeros(len(wanted[1]), np.int64)
    high = np.full(len(wanted[1]), len(factors[1]), np.int64)
    for _ in range(len(factors[1]).bit_length()):
        middle, searched = (low + high) // 2, low < high
        less = _less(factors, np.minimum(middle, len(factors[1]) - 1), wanted)
        low, high = np.where(searched & less, middle + 1, low), np.where(searched & ~less, middle, high)
    return low


def _less(factors: Factors, index: Int64, wanted: Factors) -> Bool:
    """Whether the rows at some indices stand before those that are wanted."""
    rows, weight, _ = factors
    less = np.zeros(len(index), np.bool_)
    for mine, other in zip(reversed(rows[index].T), reversed(wanted[0].T), strict=True):
        mine, other = _rank(mine), _rank(other)
        less = (mine < other) | (mine == other) & less
    return np.asarray((weight[index] < wanted[1]) | (weight[index] == wanted[1]) & less)


def _rank(number: NDArray[np.int32]) -> Int64:
    """By what rows are in order: the atom of a literal, then whether it is negative."""
    return np.abs(number, dtype=np.int64) * 2 + (number < 0)
