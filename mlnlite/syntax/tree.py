"""The syntax tree: one frozen class for each rule of the grammar. Comes out of `parse`, goes into `check` and `write`.

Spans say where a node stood and do not count for equality, so `parse(write(t)) == t` can be tested.
"""

# ruff: noqa: RUF009 (a span is a field, not a value)
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from mlnlite.source import Span

Dialect: TypeAlias = Literal["standard", "prac"]
"""How a tree is written: every tree has a text in these."""

Foreign: TypeAlias = Literal["alchemy", "tuffy", "rockit", "lomrf"]
"""Languages of other systems: they are read into a tree of the standard dialect."""

AnyDialect: TypeAlias = Literal["standard", "prac", "alchemy", "tuffy", "rockit", "lomrf"]


def _span() -> Span | None:
    return field(default=None, compare=False, repr=False)


# --- terms


@dataclass(frozen=True, slots=True)
class Variable:
    """`x` (standard) or `?x` (prac), name without the question mark; `plus` for `+x`: one weight per constant."""

    name: str
    plus: bool = False
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Constant:
    """`Anna`, `42`, `"any text"` (kept without the quotes)."""

    name: str
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Hole:
    """Place number `index` of a `FormulaTable`, which each of its rows fills with a constant."""

    index: int
    span: Span | None = _span()


Term: TypeAlias = Variable | Constant | Hole


@dataclass(frozen=True, slots=True)
class Operation:
    """`left operator right` of numbers that terms name, operator one of `+ - * / %`."""

    operator: str
    left: TermExpression
    right: TermExpression
    span: Span | None = _span()


TermExpression: TypeAlias = Variable | Constant | Operation


# --- formulas


@dataclass(frozen=True, slots=True)
class Atom:
    """`P(t, ...)`."""

    predicate: str
    arguments: tuple[Term, ...]
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Equality:
    """`t = u`; `t != u` and `t =/= u` are its negation."""

    left: Term
    right: Term
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Comparison:
    """`x < y`, `u = t + 1`: constants compared as numbers; operator one of `< <= > >= = !=`."""

    operator: str
    left: TermExpression
    right: TermExpression
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Count:
    """`count(f | x, y) <= 2`: for how many bindings of the variables `body` is true; operator as in `Comparison`."""

    variables: tuple[str, ...]
    body: Formula
    operator: str
    number: int
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Not:
    """`!f`."""

    operand: Formula
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class And:
    """`f ^ g ^ ...`, two operands or more."""

    operands: tuple[Formula, ...]
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Or:
    """`f v g v ...`, two operands or more."""

    operands: tuple[Formula, ...]
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Implies:
    """`f => g`."""

    body: Formula
    head: Formula
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Iff:
    """`f <=> g`."""

    left: Formula
    right: Formula
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Quantified:
    """`EXIST x, y (f)` or `FORALL x (f)`."""

    quantifier: Literal["exist", "forall"]
    variables: tuple[str, ...]
    body: Formula
    span: Span | None = _span()


Formula: TypeAlias = Atom | Equality | Comparison | Count | Not | And | Or | Implies | Iff | Quantified


# --- weights


@dataclass(frozen=True, slots=True)
class Number:
    """A number of a weight expression."""

    value: float
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Call:
    """`logx(p)`, `log(a/b)`, `exp(x)`, ...: a named function of expressions."""

    function: str
    arguments: tuple[WeightExpression, ...]
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """`left operator right`, operator one of `+ - * / ^`; unary minus is `0 - x` with `left` None."""

    operator: str
    left: WeightExpression | None
    right: WeightExpression
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Size:
    """`domSize(type)`: how many constants a type has."""

    type: str
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class NumberOf:
    """`x:`: the number that the constant of a variable names. Stands alone, never in an expression."""

    variable: str
    span: Span | None = _span()


WeightExpression: TypeAlias = Number | Call | Arithmetic | Size | NumberOf


# --- statements


@dataclass(frozen=True, slots=True)
class TypeDeclaration:
    """`person = {Anna, Bob}`."""

    name: str
    constants: tuple[Constant, ...]
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a declaration: a type, and `!` (exactly one value), `?` (at most one) or nothing."""

    type: str
    marker: Literal["", "!", "?"] = ""
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class PredicateDeclaration:
    """`P(type, type!)`; `*P(type)` says that the world of P is closed."""

    name: str
    arguments: tuple[Argument, ...]
    closed: bool = False
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class FormulaStatement:
    """A formula with its weight.

    Attributes:
        formula: the formula.
        weight: its weight; None if it has none (to be learnt) or is hard.
        hard: written with a final dot.
        fixed: the weight is not to be learnt (`@5 f`, `#fixweight`).
        unique: groups of `+` variables whose order does not matter (`#unique{+a,+b}`).
    """

    formula: Formula
    weight: WeightExpression | None = None
    hard: bool = False
    fixed: bool = False
    unique: tuple[tuple[str, ...], ...] = ()
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class FormulaTable:
    """Soft formulas that differ only in constants and weights, as one formula with holes and a table.

    Attributes:
        formula: the common shape, with `Hole(0)`, `Hole(1)`, ... in place of every constant, equal ones too.
        columns: for each hole the constants of all rows, `columns[hole][row]`.
        weights: one weight for each row.
        spans: where each row stands.
    """

    formula: Formula
    columns: tuple[tuple[str, ...], ...]
    weights: tuple[WeightExpression, ...]
    spans: tuple[Span, ...] = field(default=(), compare=False, repr=False)
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Test:
    """`@test given FACTS query FORMULA = 0.44 +- 0.001`: what `mlnlite test` verifies.

    Attributes:
        query: the formula whose probability is asked.
        probability: what it is to be.
        tolerance: how far from it is good.
        given: facts, comma separated, as text.
    """

    query: str
    probability: float
    tolerance: float
    given: str = ""
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class Include:
    """`#include "file"`, with what is in it."""

    path: str
    program: Program
    span: Span | None = _span()


Statement: TypeAlias = TypeDeclaration | PredicateDeclaration | FormulaStatement | FormulaTable | Test | Include


@dataclass(frozen=True, slots=True)
class Origin:
    """How a text was read.

    Attributes:
        dialect: the language it was read in.
        reasons: why it was taken for that, empty if its user said so.
        notes: what in it means something else than in the system it was written for.
    """

    dialect: AnyDialect
    reasons: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Program:
    """A whole model file."""

    statements: tuple[Statement, ...]
    dialect: Dialect
    span: Span | None = _span()
    origin: Origin | None = field(default=None, compare=False, repr=False)
