"""Typed formulas as Boolean functions of propositions: quantifiers written out, partial assignments, disjoint cubes.

A proposition is an atom or an equality of the formula. A cube is a conjunction of literals over propositions; the cubes
that `cubes` gives are disjoint, so a formula's true (or false) groundings are the sum of theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from math import comb
from typing import TypeAlias, assert_never

from mlnlite.errors import Diagnostic, LimitReached
from mlnlite.model.formulas import (
    All,
    Any,
    AtomRef,
    AtomSchema,
    Const,
    Count,
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


def _open(schema: AtomSchema) -> bool | None:
    return None


def without_quantifiers(
    formula: Formula,
    constants: Mapping[str, Iterable[int]],
    decide: Callable[[AtomSchema], bool | None] = _open,
    binding: Binding = Binding({}),
) -> Formula:
    """The formula with each `EXIST` written out as a disjunction over the constants of its type.

    Args:
        formula: the formula.
        constants: of each type.
        decide: the truth of an atom, or None if it is to stay an atom.
        binding: terms for free variables.

    Raises:
        LimitReached: if that gives more atoms than is sensible.
    """
    if not any(v.bound for v in formula.variables):
        return formula
    atoms: dict[AtomSchema, int] = {}
    writing = _Writing(formula, {k: tuple(v) for k, v in constants.items()}, decide, atoms)
    body = _written_out(writing, formula.body, binding)
    return replace(formula, atoms=tuple(atoms), body=simplified(body, {}))


@dataclass(frozen=True, slots=True)
class Counted:
    """Whether between `low` and `high` of some cases are true; the i-th is a proposition of its own, `AtomRef(~i)`."""

    cases: tuple[Expression, ...]
    low: int
    high: int


def with_counted(
    formula: Formula, constants: Mapping[str, Iterable[int]], decide: Callable[[AtomSchema], bool | None] = _open
) -> tuple[Formula, tuple[Counted, ...]]:
    """The formula with each outermost `EXIST` and `count` as one proposition over cases, its bindings.

    Args: see `without_quantifiers`; what stands inside of a case is written out as there.

    Returns:
        The formula, whose `AtomRef(~i)` stands for the i-th counted proposition, and these.

    Raises:
        LimitReached: if that gives more atoms than is sensible.
    """
    atoms: dict[AtomSchema, int] = {}
    counted: list[Counted] = []
    writing = _Writing(formula, {k: tuple(v) for k, v in constants.items()}, decide, atoms, counted)
    body = simplified(_written_out(writing, formula.body, Binding({})), {})
    return replace(formula, atoms=tuple(atoms), body=body), tuple(counted)


@dataclass(frozen=True, slots=True)
class _Writing:
    """The formula that is written out, the atoms so far, and what is counted, if quantifiers are."""

    formula: Formula
    constants: Mapping[str, tuple[int, ...]]
    decide: Callable[[AtomSchema], bool | None]
    atoms: dict[AtomSchema, int]
    counted: list[Counted] | None = None


def _written_out(writing: _Writing, expression: Expression, binding: Binding) -> Expression:
    formula, atoms = writing.formula, writing.atoms

    def inside(e: Expression) -> Expression:
        return _written_out(writing, e, binding)

    match expression:
        case AtomRef(index):
            schema = formula.atoms[index]
            bound = AtomSchema(schema.predicate, tuple(map(binding.term, schema.arguments)))
            truth = writing.decide(bound)
            if truth is not None:
                return _constant(truth)
            if len(atoms) > MOST_WRITTEN_OUT:
                raise LimitReached(f"a quantifier ranges over more than {MOST_WRITTEN_OUT:,} atoms in one formula")
            return AtomRef(atoms.setdefault(bound, len(atoms)))
        case Equal(left, right):
            return _equal(binding.term(left), binding.term(right))
        case Not(operand):
            return Not(inside(operand))
        case All(operands):
            return FALSE if _has(writing, operands, binding, False) else All(tuple(map(inside, operands)))
        case Any(operands):
            return TRUE if _has(writing, operands, binding, True) else Any(tuple(map(inside, operands)))
        case Iff(left_side, right_side):
            return Iff(inside(left_side), inside(right_side))
        case Exists() | Count():
            return _quantified(writing, expression, binding)
        case _:
            raise AssertionError(expression)


def _has(writing: _Writing, operands: Sequence[Expression], binding: Binding, truth: bool) -> bool:
    """Whether one of some expressions is a literal that is known to have a truth value."""
    for operand in operands:
        atom, value = (operand.operand, not truth) if isinstance(operand, Not) else (operand, truth)
        if isinstance(atom, AtomRef):
            schema = writing.formula.atoms[atom.index]
            bound = AtomSchema(schema.predicate, tuple(map(binding.term, schema.arguments)))
            if writing.decide(bound) is value:
                return True
    return False


def _quantified(writing: _Writing, expression: Exists | Count, binding: Binding) -> Expression:
    """A quantifier written out over its cases, or as a counted proposition."""
    inner = replace(writing, counted=None)
    bindings = _bindings(writing.formula, expression.variables, writing.constants)
    cases = [
        simplified(_written_out(inner, expression.body, Binding({**binding.terms, **more})), {}) for more in bindings
    ]
    low, high = (1, None) if isinstance(expression, Exists) else (expression.low, expression.high)
    high = len(cases) if high is None else high
    if writing.counted is None:
        return between(cases, low, high)
    left, low, high = _undecided(cases, low, high)
    if high < 0 or low > len(left):
        return FALSE
    if low == 0 and high >= len(left):
        return TRUE
    if low == 1 and high >= len(left):
        parts = (case.operands if isinstance(case, Any) else (case,) for case in left)
        left = list(dict.fromkeys(p for operands in parts for p in operands))
        high = len(left)
    writing.counted.append(Counted(tuple(left), low, min(high, len(left))))
    return AtomRef(~(len(writing.counted) - 1))


def _undecided(cases: Sequence[Expression], low: int, high: int) -> tuple[list[Expression], int, int]:
    """The cases that are not constants, and the bounds for them."""
    certain = sum(case == TRUE for case in cases)
    return [case for case in cases if case not in (TRUE, FALSE)], max(0, low - certain), high - certain


def _bindings(
    formula: Formula, variables: tuple[int, ...], constants: Mapping[str, tuple[int, ...]]
) -> Iterator[dict[int, Term]]:
    """All constants for some variables, the last one fastest."""
    for values in product(*(constants[formula.variables[v].type] for v in variables)):
        yield dict(zip(variables, map(Const, values), strict=True))


def between(cases: Sequence[Expression], low: int, high: int) -> Expression:
    """Whether between `low` and `high` of some expressions are true.

    Raises:
        LimitReached: it takes too large a formula to say so.

    >>> a, b = AtomRef(0), AtomRef(1)
    >>> between([a, b], 1, 2) == Any((a, b)), between([a, b, TRUE], 3, 3) == All((a, b))
    (True, True)
    """
    left, low, high = _undecided(cases, low, high)
    if high < 0 or low > len(left):
        return FALSE
    if low == len(left):
        return All(tuple(left))
    if high == 0:
        return Not(Any(tuple(left)))
    if high >= len(left) and low <= 1:
        return Any(tuple(left)) if low else TRUE
    ways = min(comb(len(left), min(high + 1, len(left) // 2)), comb(len(left), min(max(low, 1), len(left) // 2)))
    if len(left) * ways > MOST_WRITTEN_OUT * 8:
        message = f"`count` with bounds {low} and {high} over {len(left)} atoms has too many cases"
        hint = "count over fewer constants, or bound the number by 0, 1 or 2"
        raise LimitReached([Diagnostic("E411", message, hint=hint)])
    return _decision(left, low, high)


def _decision(cases: Sequence[Expression], low: int, high: int) -> Expression:
    """The first case decides what is left to be counted."""
    if low <= 0 and high >= len(cases):
        return TRUE
    if high < 0 or low > len(cases):
        return FALSE
    first, rest = cases[0], cases[1:]
    yes, no = _decision(rest, low - 1, high - 1), _decision(rest, low, high)
    return simplified(Any((All((first, yes)), All((Not(first), no)))), {})


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
        case Exists() | Count():
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
        case Exists() | Count():
            raise AssertionError("quantifiers are written out before")
        case _:
            assert_never(expression)


@lru_cache(maxsize=128)
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
