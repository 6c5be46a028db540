"""What is left of a formula when some of its atoms are known: a constant, a clause, a conjunction, or a table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias, assert_never

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import LimitReached
from mlnlite.model.formulas import All, Any, AtomRef, Count, Equal, Exists, Expression, Iff, Not, parts_of
from mlnlite.model.propositional import FALSE, TRUE, Proposition

WIDEST_TABLE = 14
"""Atoms of a formula that is neither clause nor conjunction; its truth table has 2 to the power of this many cells."""


@dataclass(frozen=True, slots=True)
class Decided:
    """The formula is true, or false, whatever the unknown atoms are."""

    truth: bool


@dataclass(frozen=True, slots=True)
class ClauseShape:
    """A clause over atoms (indices in the formula) with signs (True: the atom itself); `negated`: its negation."""

    atoms: tuple[int, ...]
    signs: tuple[bool, ...]
    negated: bool


@dataclass(frozen=True, slots=True)
class TableShape:
    """Any other function: its truth table over atoms (indices in the formula)."""

    atoms: tuple[int, ...]
    truth: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class CountShape:
    """A function of a state, the sum of the steps of the true atoms: how many groundings are true at each state."""

    steps: tuple[int, ...]
    true: tuple[int, ...]


Shape: TypeAlias = Decided | ClauseShape | TableShape


def shape_of(expression: Expression) -> Shape:
    """The shape of a simplified expression over atoms.

    Raises:
        LimitReached: if it is neither clause nor conjunction and has more than `WIDEST_TABLE` atoms.
    """
    if expression in (TRUE, FALSE):
        return Decided(expression == TRUE)
    flat = _flat(expression)
    if flat is not None:
        return flat
    atoms = tuple(sorted(atoms_in(expression)))
    if len(atoms) > WIDEST_TABLE:
        raise LimitReached(
            f"a ground formula connects {len(atoms)} unknown atoms and is neither a clause nor a conjunction; "
            f"at most {WIDEST_TABLE} are possible",
            hint="give evidence, declare predicates of the quantified part closed, or split the formula into clauses",
        )
    return table_shape(atoms, truth_table(expression, tuple(map(AtomRef, atoms))))


def _flat(expression: Expression) -> ClauseShape | None:
    """The shape, if the expression is a literal or a flat connection of literals of distinct atoms."""
    operands = expression.operands if isinstance(expression, (All, Any)) else (expression,)
    literals: dict[int, bool] = {}
    for operand in operands:
        atom = operand.operand if isinstance(operand, Not) else operand
        if not isinstance(atom, AtomRef) or atom.index in literals:
            return None
        literals[atom.index] = not isinstance(operand, Not)
    atoms = tuple(sorted(literals))
    conjunction = isinstance(expression, All)
    return ClauseShape(atoms, tuple(literals[a] != conjunction for a in atoms), conjunction)


def atoms_in(expression: Expression) -> set[int]:
    """Indices of the atoms of an expression."""
    match expression:
        case AtomRef(index):
            return {index}
        case Equal():
            return set()
        case Not(operand):
            return atoms_in(operand)
        case All(operands) | Any(operands):
            return set().union(*map(atoms_in, operands))
        case Iff(left, right):
            return atoms_in(left) | atoms_in(right)
        case Exists() | Count():
            return atoms_in(expression.body)
        case _:
            assert_never(expression)


def equalities_in(expression: Expression) -> Iterator[Equal]:
    """The equalities of an expression, as often as they stand there."""
    return (part for part in parts_of(expression) if isinstance(part, Equal))


def truth_table(expression: Expression, propositions: tuple[Proposition, ...]) -> NDArray[np.bool_]:
    """Truth of an expression for all truth values of its propositions, shape (2,) * len(propositions)."""
    axes = {}
    for i, proposition in enumerate(propositions):
        shape = [1] * len(propositions)
        shape[i] = 2
        axes[proposition] = np.array([False, True]).reshape(shape)
    return np.broadcast_to(_values(expression, axes), (2,) * len(propositions)).copy()


def _values(expression: Expression, axes: dict[Proposition, NDArray[np.bool_]]) -> NDArray[np.bool_]:
    match expression:
        case AtomRef() | Equal():
            return axes[expression]
        case Not(operand):
            return np.asarray(~_values(operand, axes))
        case All(operands) | Any(operands):
            start = np.array(isinstance(expression, All))
            combine = np.logical_and if isinstance(expression, All) else np.logical_or
            for operand in operands:
                start = combine(start, _values(operand, axes))
            return start
        case Iff(left, right):
            return np.asarray(_values(left, axes) == _values(right, axes))
        case Exists() | Count():
            raise AssertionError("written out before")
        case _:
            assert_never(expression)


def table_shape(atoms: tuple[int, ...], truth: NDArray[np.bool_]) -> Shape:
    """The simplest shape of a truth table: atoms that do not matter are dropped."""
    axis = 0
    kept = list(atoms)
    while axis < len(kept):
        false, true = np.take(truth, 0, axis), np.take(truth, 1, axis)
        if np.array_equal(false, true):
            truth = false
            del kept[axis]
        else:
            axis += 1
    n_true = int(truth.sum())
    if n_true in (0, truth.size):
        return Decided(n_true > 0)
    if n_true in (1, truth.size - 1):
        negated = n_true == 1 and truth.size > 2
        cell = np.argwhere(truth == negated)[0]
        return ClauseShape(tuple(kept), tuple(not bool(bit) for bit in cell), negated)
    return TableShape(tuple(kept), truth)
