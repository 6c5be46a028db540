"""Rows of a template's plan, gathered by what evidence knows: rows that know the same leave the same formula."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any as Any_

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Relation
from mlnlite.ground.compile import Compiled, atom_column, equality_column
from mlnlite.ground.residual import CountShape, Decided, Shape, shape_of
from mlnlite.ground.room import Cut
from mlnlite.ground.tables import KNOWN_TRUE
from mlnlite.model.formulas import All, Any, AtomRef, Expression, Formula, Iff, Not
from mlnlite.model.propositional import Proposition, simplified

Int8 = NDArray[np.int8]
Int64 = NDArray[np.int64]

FEW = 81
"""Kinds of rows that are looked for one by one, without sorting."""


@dataclass(frozen=True, slots=True)
class Group:
    """Rows (their indices; all of them, if a slice) that leave the same shape of atoms (a column for each)."""

    index: Int64 | slice
    shape: Shape | CountShape
    atoms: tuple[Int64, ...]


def groups_of(formula: Formula, plan: Compiled, rows: Relation, cut: Cut) -> list[Group]:
    """All rows, gathered by their residual shape.

    Args:
        formula: without quantifiers.
        plan: what the rows are of.
        rows: the result of running it.
        cut: gives the arrays for what stays.
    """
    n_rows = len(next(iter(rows.values()))) if rows else 1
    features = _features(formula, plan, rows)
    code: NDArray[Any_] = np.zeros(n_rows, np.int8)
    base = 1
    for column in features.values():
        if len(column) and (column != column[0]).any():
            if base > 2**61 // 3:
                code = np.unique(code, return_inverse=True)[1].reshape(-1)
                base = int(code.max()) + 1
            code = code.astype(np.min_scalar_type(-3 * base), copy=False)
            code *= 3
            code += column
            base *= 3
    groups = []
    for index in _equal_rows(code, base):
        first = 0 if isinstance(index, slice) else index[0]
        known, merged = _meaning({key: int(column[first]) for key, column in features.items()})
        body = simplified(renamed(formula.body, merged), {**plan.known, **known})
        shape = shape_of(body)
        listed = () if isinstance(shape, Decided) else shape.atoms
        atoms = tuple(taken(rows[atom_column(i)], index, cut) for i in listed)
        groups.append(Group(index, shape, atoms))
    return groups


def taken(column: NDArray[Any_], index: Int64 | slice, cut: Cut) -> NDArray[Any_]:
    """The values of a column in some rows."""
    if isinstance(index, slice):
        return column[index]
    return column.take(index, mode="clip", out=cut(len(index), column.dtype))


def _equal_rows(code: NDArray[Any_], base: int) -> Sequence[Int64 | slice]:
    if len(code) == 0:
        return []
    if base == 1:
        return [slice(None)]
    if base <= FEW:
        masks = (code == value for value in range(base))
        return [index for mask in masks if len(index := np.flatnonzero(mask))]
    order = np.argsort(code, kind="stable")
    return list(np.split(order, np.flatnonzero(np.diff(code[order])) + 1))


def _features(formula: Formula, plan: Compiled, rows: Relation) -> dict[Proposition | tuple[int, int], Int8]:
    """Small numbers for each row: 0 unknown, 1 true, 2 false for a proposition; 1 for a pair of atoms that coincide."""
    features: dict[Proposition | tuple[int, int], Int8] = {}
    atoms = {i: rows[atom_column(i)] for i in plan.atoms}
    for i, column in atoms.items():
        if column.min(initial=0) < 0:
            features[AtomRef(i)] = np.negative(np.clip(column, -2, 0)).astype(np.int8)
    for i, equality in enumerate(plan.equalities):
        features[equality] = np.where(rows[equality_column(i)] == 0, np.int8(1), np.int8(2))
    for i, j in combinations(plan.atoms, 2):
        if formula.atoms[i].predicate == formula.atoms[j].predicate:
            equal = (atoms[i] == atoms[j]) & (atoms[i] >= 0)
            if equal.any():
                features[i, j] = equal.astype(np.int8)
    return features


def _meaning(
    features: Mapping[Proposition | tuple[int, int], int],
) -> tuple[dict[Proposition, bool], dict[int, int]]:
    """What is known, and for atoms that coincide with an earlier one, which."""
    known: dict[Proposition, bool] = {}
    merged: dict[int, int] = {}
    for key, value in features.items():
        if isinstance(key, tuple):
            if value:
                merged.setdefault(key[1], merged.get(key[0], key[0]))
        elif value:
            known[key] = value == -KNOWN_TRUE
    return known, merged


def renamed(expression: Expression, merged: Mapping[int, int]) -> Expression:
    """The expression with coinciding atoms made one."""
    if not merged:
        return expression
    match expression:
        case AtomRef(index):
            return AtomRef(merged.get(index, index))
        case Not(operand):
            return Not(renamed(operand, merged))
        case All(operands):
            return All(tuple(renamed(f, merged) for f in operands))
        case Any(operands):
            return Any(tuple(renamed(f, merged) for f in operands))
        case Iff(left, right):
            return Iff(renamed(left, merged), renamed(right, merged))
        case _:
            return expression
