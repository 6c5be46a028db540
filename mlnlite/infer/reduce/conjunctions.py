"""Conjunctions of literals over variables, and their rewriting into cells, which fix one value per variable.

A clause differs from a constant only where all its literals are false, which is a conjunction; so is each cell of a
truth table. Everything that a network says comes down to "worlds where this conjunction holds gain this amount".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.network import Bool, Float, Int32, Int64

MAX_ARITY = 12
MAX_CELLS = 4096
_FEW_BITS = 12
_Number = TypeVar("_Number", np.int64, np.float64)


@dataclass(frozen=True, slots=True)
class Conjunctions:
    """Conjunctions over the same number of literals.

    Attributes:
        variable: shape (n, k); a variable may stand in a row several times.
        value: shape (n, k).
        equal: shape (n, k): the literal is `variable = value` or `variable != value`.
        amount: shape (n,), log-weight gained where the conjunction holds; minus infinity forbids it.
    """

    variable: Int32
    value: Int32
    equal: Bool
    amount: Float


@dataclass(frozen=True, slots=True)
class Cells:
    """Amounts of log-weight that worlds gain in one cell of a scope.

    Attributes:
        scope: shape (n, k), variables, rising in each row.
        value: shape (n, k), their values in that cell.
        amount: shape (n,); minus infinity forbids the cell.
    """

    scope: Int32
    value: Int32
    amount: Float


def starts_of(cardinality: Int32) -> Int64:
    """Shape (n_variables,), where the values of each variable start in an array over all values."""
    return np.cumsum(cardinality, dtype=np.int64) - cardinality


def distinct(amount: NDArray[_Number]) -> NDArray[_Number]:
    """The different numbers of an array of shape (n,), rising; where these are few, sorting is quicker than hashing."""
    rising = np.sort(amount)
    new = np.ones(len(rising), np.bool_)
    new[1:] = rising[1:] != rising[:-1]
    return rising[new]


def summed(key: Int64, amount: NDArray[_Number]) -> tuple[Int64, NDArray[_Number]]:
    """The distinct keys, rising, and the sum of the amounts of each.

    Args:
        key: shape (n,), not negative.
        amount: shape (n,). If it has few different values, these are sorted with the keys, which is fast.
    """
    if (np.diff(key) > 0).all():
        return key, amount
    kinds = distinct(amount)
    bits = len(kinds).bit_length()
    if bits <= _FEW_BITS and int(key.max()).bit_length() + bits < 64:
        packed = np.sort(key << bits | np.searchsorted(kinds, amount))
        key, amount = packed >> bits, kinds[packed & ((1 << bits) - 1)]
    else:
        order = np.argsort(key)
        key, amount = key[order], amount[order]
    first = np.flatnonzero(np.diff(key, prepend=-1))
    return key[first], np.add.reduceat(amount, first)


def split_wide(
    rows: Conjunctions, cardinality: Int32, max_arity: float = MAX_ARITY
) -> tuple[list[Conjunctions], Int32]:
    """Replaces conjunctions too wide for a table by chains of auxiliary variables.

    Auxiliary variable c of a chain is 1 exactly where the first c + 2 literals hold, so each world of the network has
    one world of the longer list of variables, with the same weight.

    Args:
        rows: any conjunctions.
        cardinality: shape (n_variables,), of the variables so far.
        max_arity: literals of a conjunction that is not too wide.

    Returns:
        Conjunctions that mean the same, and the cardinalities of all variables, the auxiliary ones appended.
    """
    k = rows.variable.shape[1]
    if k <= 2:
        return [rows], cardinality
    others = np.where(np.isfinite(rows.amount)[:, None], 2, cardinality[rows.variable] - 1)
    choices = np.where(rows.equal | (cardinality[rows.variable] <= 2), 1, others)
    wide = (k > max_arity) | (np.prod(choices, axis=1, dtype=float) > MAX_CELLS)
    if not np.any(wide):
        return [rows], cardinality
    parts = [_pick(rows, ~wide)]
    rows = _pick(rows, wide)
    n = len(rows.amount)
    auxiliary = len(cardinality) + np.arange(n * (k - 1), dtype=np.int32).reshape(n, k - 1)
    held = rows.variable[:, 0], rows.value[:, 0], rows.equal[:, 0]
    one, yes = np.ones(n, np.int32), np.ones(n, np.bool_)
    for c in range(1, k):
        literal = rows.variable[:, c], rows.value[:, c], rows.equal[:, c]
        both = auxiliary[:, c - 1], one, yes
        parts += _definition(both, held, literal)
        held = both
    parts.append(_conjoin([held], rows.amount))
    return parts, np.concatenate([cardinality, np.full(auxiliary.size, 2, np.int32)])


_Column = tuple[Int32, Int32, Bool]


def _conjoin(columns: Sequence[_Column], amount: Float) -> Conjunctions:
    """Conjunctions from their columns of literals."""
    variable, value, equal = (np.stack(part, axis=1) for part in zip(*columns, strict=True))
    return Conjunctions(variable, value, equal, amount)


def _definition(result: _Column, left: _Column, right: _Column) -> list[Conjunctions]:
    """Forbids what contradicts `result <=> left and right`."""
    never = np.full(len(result[0]), -np.inf)
    unless = [_conjoin([result, (v, x, ~equal)], never) for v, x, equal in (left, right)]
    return [*unless, _conjoin([(result[0], result[1], ~result[2]), left, right], never)]


def _pick(rows: Conjunctions, which: Bool | Int64) -> Conjunctions:
    """Some of the rows."""
    return Conjunctions(rows.variable[which], rows.value[which], rows.equal[which], rows.amount[which])


@dataclass(slots=True)
class _Partial:
    """Cells under construction: the literals placed so far of copies of some rows."""

    row: Int64
    scope: Int32
    value: Int32
    amount: Float

    def pick(self, which: Bool | Int64) -> _Partial:
        """Some of the copies."""
        return _Partial(self.row[which], self.scope[which], self.value[which], self.amount[which])


def cells_of(rows: Conjunctions, cardinality: Int32) -> tuple[list[Cells], float]:
    """Cells that add up to the conjunctions.

    `variable != value` becomes "the other value" for two values; else, for a finite amount, "anywhere" minus "at that
    value"; else one cell for each other value.

    Args:
        rows: conjunctions of few literals (see `split_wide`).
        cardinality: shape (n_variables,).

    Returns:
        Cells, those of equal arity together, and the amount that every world gains.
    """
    n, k = rows.variable.shape
    if k and (np.diff(rows.variable, axis=1) > 0).all() and (cardinality == 2).all():
        value = np.where(rows.equal, rows.value, 1 - rows.value).astype(np.int32)
        return [Cells(rows.variable, value, rows.amount)] if n else [], 0.0
    last = ~rows.equal & (cardinality[rows.variable] > 2)
    columns = np.argsort(last, axis=1, kind="stable")
    part = _Partial(np.arange(n), np.full((n, k), -1, np.int32), np.zeros((n, k), np.int32), rows.amount)
    for c in range(k):
        at = (part.row, columns[part.row, c])
        part = _place(part, c, (rows.variable[at], rows.value[at], rows.equal[at]), cardinality)
    return gather(part.scope, part.value, part.amount)


def _place(part: _Partial, column: int, literal: _Column, cardinality: Int32) -> _Partial:
    """Adds one literal to each copy: drops the copies that contradict it, splits those that need several cells."""
    variable, value, equal = literal
    size = cardinality[variable]
    value = np.where(~equal & (size == 2), 1 - value, value).astype(np.int32)
    equal = equal | (size == 2)
    same = part.scope == variable[:, None]
    known = same.any(axis=1)
    agrees = (part.value[np.arange(len(known)), same.argmax(axis=1)] == value) == equal
    alive = np.where(known, agrees, equal | (size > 1))
    fresh = alive & ~known & (size > 1)
    part.scope[fresh & equal, column] = variable[fresh & equal]
    part.value[fresh & equal, column] = value[fresh & equal]
    soft = np.flatnonzero(fresh & ~equal & np.isfinite(part.amount))
    hard = np.flatnonzero(fresh & ~equal & ~np.isfinite(part.amount))
    minus = part.pick(soft)
    minus.scope[:, column], minus.value[:, column] = variable[soft], value[soft]
    minus.amount = -minus.amount
    alive[hard] = False
    parts = [part.pick(alive), minus, *_others(part, column, (hard, variable[hard], value[hard]), cardinality)]
    parts = [p for p in parts if len(p.row)] or [part.pick(alive)]
    fields = zip(*((p.row, p.scope, p.value, p.amount) for p in parts), strict=True)
    return _Partial(*(np.concatenate(f) for f in fields))


def _others(part: _Partial, column: int, at: tuple[Int64, Int32, Int32], cardinality: Int32) -> list[_Partial]:
    """Copies of rows, one for each value of the variable but one."""
    rows, variable, value = at
    copies = []
    for other in range(int(cardinality[variable].max(initial=0))):
        use = (value != other) & (cardinality[variable] > other)
        copy = part.pick(rows[use])
        copy.scope[:, column], copy.value[:, column] = variable[use], other
        copies.append(copy)
    return copies


def gather(scope: Int32, value: Int32, amount: Float) -> tuple[list[Cells], float]:
    """Sorts the literals of each cell by variable and the cells by arity.

    Args:
        scope: shape (n, k), -1 where there is no literal.
        value: shape (n, k).
        amount: shape (n,).

    Returns:
        Cells, those of equal arity together, and the amount of those without a literal.
    """
    arity = (scope >= 0).sum(axis=1)
    unused = np.iinfo(np.int32).max
    order = np.argsort(np.where(scope < 0, unused, scope), axis=1)
    scope, value = (np.take_along_axis(a, order, axis=1) for a in (scope, value))
    cells = []
    for k in np.unique(arity[arity > 0]):
        rows = arity == k
        cells.append(Cells(scope[rows, :k], value[rows, :k], amount[rows]))
    return cells, float(amount[arity == 0].sum())
