"""Typed formulas: variables are numbers, constants are ids, each distinct atom stands once in a list."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class TypedVariable:
    """A variable with its type; `bound` by a quantifier inside the formula, or free."""

    name: str
    type: str
    bound: bool = False


@dataclass(frozen=True, slots=True)
class Var:
    """Variable number `index` of the formula."""

    index: int


@dataclass(frozen=True, slots=True)
class Const:
    """Constant number `id` of its argument's type."""

    id: int


Argument: TypeAlias = Var | Const


@dataclass(frozen=True, slots=True)
class AtomSchema:
    """An atom with variables: `predicate(arguments)`."""

    predicate: str
    arguments: tuple[Argument, ...]


@dataclass(frozen=True, slots=True)
class AtomRef:
    """The truth of atom number `index` of the formula."""

    index: int


@dataclass(frozen=True, slots=True)
class Equal:
    """Whether two terms of one type are the same constant."""

    left: Argument
    right: Argument


@dataclass(frozen=True, slots=True)
class Not:
    """Negation."""

    operand: Expression


@dataclass(frozen=True, slots=True)
class All:
    """Conjunction; true if empty."""

    operands: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Any:
    """Disjunction; false if empty."""

    operands: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Iff:
    """Both or neither."""

    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Exists:
    """Some binding of `variables` makes `body` true. FORALL is `Not(Exists(v, Not(body)))`."""

    variables: tuple[int, ...]
    body: Expression


@dataclass(frozen=True, slots=True)
class Count:
    """Between `low` and `high` bindings of `variables` make `body` true; `high` None: any number from `low`."""

    variables: tuple[int, ...]
    body: Expression
    low: int
    high: int | None


Expression: TypeAlias = AtomRef | Equal | Not | All | Any | Iff | Exists | Count


@dataclass(frozen=True, slots=True)
class Formula:
    """A typed formula.

    Attributes:
        variables: all variables, free ones and bound ones; a bound variable belongs to one quantifier.
        atoms: the distinct atoms.
        body: how they are connected.
    """

    variables: tuple[TypedVariable, ...]
    atoms: tuple[AtomSchema, ...]
    body: Expression

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the free variables: one grounding for each binding of these."""
        return tuple(i for i, v in enumerate(self.variables) if not v.bound)


def parts_of(expression: Expression) -> Iterator[Expression]:
    """An expression and all that is in it."""
    yield expression
    match expression:
        case Not(body) | Exists(_, body) | Count(_, body, _, _):
            yield from parts_of(body)
        case All(operands) | Any(operands):
            for operand in operands:
                yield from parts_of(operand)
        case Iff(left, right):
            yield from parts_of(left)
            yield from parts_of(right)
        case _:
            pass
