"""Constants as numbers: what comparisons hold of them, and the facts of the predicates that stand for comparisons."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import prod

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, LimitReached
from mlnlite.model.formulas import AtomSchema, Const
from mlnlite.model.symbols import Predicate, Type
from mlnlite.syntax import tree
from mlnlite.syntax.walk import map_comparison
from mlnlite.syntax.write import write_formula

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]

MOST_CELLS = 20_000_000
"""Combinations of constants of which it is worked out whether a comparison holds."""

CLOSE = 1e-9
"""Numbers are equal if they differ by less than this, or this part of the larger one."""

_ARITHMETIC: Mapping[str, Callable[[Float, Float], Float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "%": operator.mod,
}


def number_of(constant: str) -> float | None:
    """The number that a constant names, or None.

    >>> number_of("3"), number_of("-0.5"), number_of("Anna"), number_of("nan")
    (3.0, -0.5, None, None)
    """
    try:
        value = float(constant)
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def comparison_constants(node: tree.Comparison | tree.TermExpression) -> Iterator[tree.Constant]:
    """The constants of a comparison."""
    if isinstance(node, tree.Constant):
        yield node
    elif isinstance(node, tree.Comparison | tree.Operation):
        yield from comparison_constants(node.left)
        yield from comparison_constants(node.right)


def comparison_predicate(formula: tree.Comparison, place: Mapping[str, int], types: tuple[str, ...]) -> Predicate:
    """The predicate whose facts are the numbers for which a comparison holds.

    Args:
        formula: the comparison.
        place: for each of its variables which argument it becomes.
        types: of the arguments.
    """
    shape = map_comparison(formula, lambda variable: tree.Variable(f"x{place[variable.name]}"))
    name = f"{write_formula(shape, 'standard')} ({', '.join(types)})"
    return Predicate(name, types, closed=True, span=formula.span, comparison=shape)


def holds(comparison: tree.Comparison, values: Sequence[Float]) -> Bool:
    """Where a comparison holds, with numbers (which broadcast) for its variables `x0`, `x1`, ...

    Where it has no value (division by zero) it does not hold.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        left, right = (_value(side, values) for side in (comparison.left, comparison.right))
        equal = np.abs(left - right) <= CLOSE * np.maximum(1.0, np.maximum(np.abs(left), np.abs(right)))
        truth = {
            "=": equal,
            "!=": ~equal,
            "<": (left < right) & ~equal,
            "<=": (left < right) | equal,
            ">": (left > right) & ~equal,
            ">=": (left > right) | equal,
        }[comparison.operator]
    return np.asarray(truth & np.isfinite(left) & np.isfinite(right), np.bool_)


def _value(term: tree.TermExpression, values: Sequence[Float]) -> Float:
    if isinstance(term, tree.Constant):
        return np.asarray(number_of(term.name), np.float64)
    if isinstance(term, tree.Variable):
        return values[int(term.name[1:])]
    return _ARITHMETIC[term.operator](_value(term.left, values), _value(term.right, values))


def comparison_rows(
    predicate: Predicate, types: Mapping[str, Type], present: Sequence[NDArray[np.int64]]
) -> NDArray[np.int32]:
    """The facts of a comparison, shape (n, arity).

    Args:
        predicate: one with a comparison.
        types: all constants.
        present: for each argument the constants that the database has.

    Raises:
        LimitReached: there are too many combinations.
    """
    assert predicate.comparison is not None
    if prod(map(len, present)) > MOST_CELLS:
        sizes = " x ".join(f"{len(p):,}" for p in present)
        message = f"the comparison {predicate} ranges over {sizes} constants; at most {MOST_CELLS:,} can be worked out"
        hint = "give the numbers a narrower type, or divide them into bins"
        raise LimitReached([Diagnostic("E412", message, predicate.span, hint)])
    numbers = [numbers_of(types[t])[ids] for t, ids in zip(predicate.types, present, strict=True)]
    grid = np.meshgrid(*numbers, indexing="ij", sparse=True)
    truth = np.broadcast_to(holds(predicate.comparison, grid), tuple(map(len, present)))
    rows = [ids[i] for ids, i in zip(present, np.nonzero(truth), strict=True)]
    return np.column_stack(rows).astype(np.int32).reshape(-1, predicate.arity)


def numbers_of(of: Type) -> Float:
    """The numbers of all constants of a type, NaN for those that are none."""
    return np.array([np.nan if (n := number_of(c)) is None else n for c in of.constants], np.float64)


def number_mistakes(predicates: Sequence[Predicate], types: Mapping[str, Type]) -> Iterator[Diagnostic]:
    """A mistake for each type whose constants are compared and are not all numbers."""
    seen: set[str] = set()
    for predicate in predicates:
        for name in predicate.types:
            wrong = [c for c in types[name].constants if number_of(c) is None]
            if wrong and name not in seen:
                seen.add(name)
                message = f"{wrong[0]} is a constant of {name} and no number, but {predicate} compares them as numbers"
                hint = "give the numbers a type of their own"
                yield Diagnostic("E314", message, predicate.span, hint)


def comparison_truth(schema: AtomSchema, predicates: Mapping[str, Predicate], types: Mapping[str, Type]) -> bool | None:
    """The truth of a comparison of constants; None for other atoms, and where there are variables."""
    predicate = predicates[schema.predicate]
    constants = [a.id for a in schema.arguments if isinstance(a, Const)]
    if predicate.comparison is None or len(constants) < len(schema.arguments):
        return None
    names = [types[t].constants[c] for t, c in zip(predicate.types, constants, strict=True)]
    return bool(holds(predicate.comparison, [np.asarray(number_of(name), np.float64) for name in names]))
