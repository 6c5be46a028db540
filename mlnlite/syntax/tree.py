"""The syntax tree: one frozen class for each rule of the grammar. Comes out of `parse`, goes into `check` and `write`.

Spans say where a node stood and do not count for equality, so `parse(write(t)) == t` can be tested.
"""

# ruff: noqa: RUF009 (a span is a field, not a value)
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from mlnlite.source import Span

Dialect: TypeAlias = Literal["standard", "prac"]


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


Formula: TypeAlias = Atom | Equality | Not | And | Or | Implies | Iff | Quantified


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


WeightExpression: TypeAlias = Number | Call | Arithmetic


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
class Include:
    """`#include "file"`, with what is in it."""

    path: str
    program: Program
    span: Span | None = _span()


Statement: TypeAlias = TypeDeclaration | PredicateDeclaration | FormulaStatement | FormulaTable | Include


@dataclass(frozen=True, slots=True)
class Program:
    """A whole model file."""

    statements: tuple[Statement, ...]
    dialect: Dialect
    span: Span | None = _span()


# --- evidence


@dataclass(frozen=True, slots=True)
class FactTable:
    """All facts about one predicate with one number of arguments, in file order, as columns.

    Attributes:
        predicate: its name.
        columns: `columns[argument][row]`, constants as text.
        truth: `truth[row]`: True for `P(a)`, False for `!P(a)`.
        database: `database[row]`: which of the databases, separated by `---`, the fact is in (from 0).
        offset: `offset[row]`: where in the source the fact starts.
    """

    predicate: str
    columns: tuple[list[str], ...]
    truth: list[bool]
    database: list[int]
    offset: list[int] = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class SoftFact:
    """`0.7 P(a)`, or `?P(a)` with probability 0.5.

    Attributes:
        predicate: its name.
        arguments: constants as text.
        probability: of the fact, by this piece of evidence alone.
        unknown: written `?P(a)`.
        database: which of the databases it is in (from 0).
    """

    predicate: str
    arguments: tuple[str, ...]
    probability: float
    unknown: bool
    database: int
    span: Span | None = _span()


@dataclass(frozen=True, slots=True)
class EvidenceProgram:
    """A whole evidence file: facts, constants that it declares, the number of its databases, soft facts."""

    facts: tuple[FactTable, ...]
    types: tuple[TypeDeclaration, ...]
    n_databases: int
    soft: tuple[SoftFact, ...] = ()
    span: Span | None = _span()
