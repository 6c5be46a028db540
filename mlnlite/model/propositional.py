"""Typed formulas as Boolean functions of propositions: quantifiers written out, partial assignments, disjoint cubes.

A proposition is an atom or an equality of the formula. A cube is a conjunction of literals over propositions; the cubes
that `cubes` gives are disjoint, so a formula's true (or false) groundings are the sum of theirs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias, assert_never

from mlnlite.errors import LimitReached
from mlnlite.model.formulas import (
    All,
    Any,
    AtomRef,
    AtomSchema,
    Const,
    Equal,
    Exists,
    Expression,
    Formula,
    Iff,
    Not,
    Var,
)
from mlnlite.model.formulas import Argument as Term

Proposition: TypeAlias = AtomRef | Equal
Cube: TypeAlias = Mapping[Proposition, bool]

TRUE = All(())
FALSE = Any(())

MOST_CUBES = 4096
MOST_WRITTEN_OUT = 20_000


@dataclass(frozen=True, slots=True)
class Binding:
    """Terms for some variables."""

    terms: Mapping[int, Term]

    def term(self, term: Term) -> Term:
        """The term with the binding applied."""
        return self.terms.get(term.index, term) if isinstance(term, Var) else term


def without_quantifiers(formula: Formula, constants: Mapping[str, Iterable[int]]) -> Formula:
    """The formula with each `EXIST` written out as a disjunction over the constants of its type.

    Raises:
        LimitReached: if that gives more atoms than is sensible.
    """
    if not any(v.bound for v in formula.variables):
        return formula
    atoms: dict[AtomSchema, int] = {}
    body = _written_out(formula, formula.body, Binding({}), {k: tuple(v) for k, v in constants.items()}, atoms)
    return replace(formula, atoms=tuple(atoms), body=simplified(body, {}))


def _written_out(
    formula: Formula,
    expression: Expression,
    binding: Binding,
    constants: Mapping[str, tuple[int, ...]],
    atoms: dict[AtomSchema, int],
) -> Expression:
    def inside(e: Expression, b: Binding = binding) -> Expression:
        return _written_out(formula, e, b, constants, atoms)

    match expression:
        case AtomRef(index):
            schema = formula.atoms[index]
            bound = AtomSchema(schema.predicate, tuple(map(binding.term, schema.arguments)))
            if len(atoms) > MOST_WRITTEN_OUT:
                raise LimitReached(f"a quantifier ranges over more than {MOST_WRITTEN_OUT:,} atoms in one formula")
            return AtomRef(atoms.setdefault(bound, len(atoms)))
        case Equal(left, right):
            return _equal(binding.term(left), binding.term(right))
        case Not(operand):
            return Not(inside(operand))
        case All(operands):
            return All(tuple(map(inside, operands)))
        case Any(operands):
            return Any(tuple(map(inside, operands)))
        case Iff(left_side, right_side):
            return Iff(inside(left_side), inside(right_side))
        case Exists((), body):
            return inside(body)
        case Exists((first, *rest), body):
            values = constants[formula.variables[first].type]
            rest_of_it = Exists(tuple(rest), body)
            return Any(tuple(inside(rest_of_it, Binding({**binding.terms, first: Const(c)})) for c in values))
        case _:
            raise AssertionError(expression)


def _equal(left: Term, right: Term) -> Expression:
    if left == right:
        return TRUE
    if isinstance(left, Const) and isinstance(right, Const):
        return FALSE
    return Equal(left, right)


def simplified(expression: Expression, known: Cube) -> Expression:
    """The expression with the truth of some propositions put in; `TRUE` or `FALSE` if that decides it."""
    match expression:
        case AtomRef():
            return _constant(known[expression]) if expression in known else expression
        case Equal(left, right):
            folded = _equal(left, right)
            return _constant(known[expression]) if expression in known else folded
        case Not(operand):
            inside = simplified(operand, known)
            return _negated(inside)
        case All(operands):
            return _connected(operands, known, All)
        case Any(operands):
            return _connected(operands, known, Any)
        case Iff(left_side, right_side):
            left_simple, right_simple = simplified(left_side, known), simplified(right_side, known)
            for a, b in ((left_simple, right_simple), (right_simple, left_simple)):
                if a == TRUE:
                    return b
                if a == FALSE:
                    return _negated(b)
            return TRUE if left_simple == right_simple else Iff(left_simple, right_simple)
        case Exists():
            raise AssertionError("quantifiers are written out before")
        case _:
            assert_never(expression)


def _constant(value: bool) -> Expression:
    return TRUE if value else FALSE


def _negated(expression: Expression) -> Expression:
    if isinstance(expression, Not):
        return expression.operand
    return FALSE if expression == TRUE else TRUE if expression == FALSE else Not(expression)


def _connected(operands: tuple[Expression, ...], known: Cube, kind: type[All] | type[Any]) -> Expression:
    neutral, absorbing = (TRUE, FALSE) if kind is All else (FALSE, TRUE)
    parts: dict[Expression, None] = {}
    for operand in operands:
        simple = simplified(operand, known)
        if simple == absorbing:
            return absorbing
        if isinstance(simple, kind):
            parts.update(dict.fromkeys(simple.operands))
        elif simple != neutral:
            parts[simple] = None
    return next(iter(parts)) if len(parts) == 1 else kind(tuple(parts))


def first_proposition(expression: Expression) -> Proposition:
    """The leftmost proposition of an expression that has one."""
    match expression:
        case AtomRef() | Equal():
            return expression
        case Not(operand):
            return first_proposition(operand)
        case All(operands) | Any(operands):
            return first_proposition(operands[0])
        case Iff(left, _):
            return first_proposition(left)
        case Exists():
            raise AssertionError("quantifiers are written out before")
        case _:
            assert_never(expression)


def cubes(expression: Expression, value: bool) -> tuple[Cube, ...]:
    """Disjoint cubes that cover exactly where the expression has a value.

    Raises:
        LimitReached: if there are too many.

    >>> a, b = AtomRef(0), AtomRef(1)
    >>> len(cubes(Any((Not(a), b)), False)), len(cubes(Iff(a, b), False))
    (1, 2)
    """
    found: list[Cube] = []
    stack: list[tuple[Expression, dict[Proposition, bool]]] = [(simplified(expression, {}), {})]
    while stack:
        rest, cube = stack.pop()
        if rest in (TRUE, FALSE):
            if (rest == TRUE) == value:
                found.append(cube)
            continue
        if len(found) > MOST_CUBES:
            raise LimitReached(f"a formula splits into more than {MOST_CUBES:,} cases")
        proposition = first_proposition(rest)
        for truth in (False, True):
            stack.append((simplified(rest, {proposition: truth}), {**cube, proposition: truth}))
    return tuple(found)
