"""Which of the two dialects a model is written in, and formulas that are written in the other one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from mlnlite.errors import Diagnostic
from mlnlite.source import Span
from mlnlite.syntax import tree
from mlnlite.syntax.lines import Code
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.tables import Group
from mlnlite.syntax.walk import constants_of, variables_of

_MARKED = re.compile(r"\?\w[\w']*")
# What a variable of the standard dialect usually looks like.
LOOKS_VARIABLE = re.compile(r"[a-z]\d{0,2}'?")


def first_marked(codes: Iterable[Code]) -> Span | None:
    """The first variable with a question mark: the sign of the prac dialect."""
    for code in codes:
        match = _MARKED.search(code.bare)
        if match:
            return Span(code.source, match.start(), match.end())
    return None


def wrong_dialect(marked: Span) -> Diagnostic:
    """The mistake of reading prac text as standard."""
    words = {"actual": "prac", "asked": "standard", "found": marked.text, "meaning": "is a variable of the former only"}
    return mistake("E118", marked, "choose the dialect `prac`, or let it be found out", **words)


@dataclass(frozen=True, slots=True)
class PracCheck:
    """What tells variables of the standard dialect from constants of the prac dialect.

    Attributes:
        marked: some variable with a question mark in the model, if there is one.
        doubt: whether a formula without any variable may be one of the standard dialect: unless the user said which
            dialect it is, and the model confirms it.
    """

    marked: Span | None
    doubt: bool


def prac_mistakes(formula: tree.Formula, check: PracCheck) -> Iterator[Diagnostic]:
    """A constant of a prac formula that must have been meant as a variable: the first one."""
    constants = [c for c in constants_of(formula) if c.span and not c.span.text.startswith('"')]
    name = _suspect(_names(formula), [c.name for c in constants], check.doubt)
    if name is not None:
        yield _mistake(formula, name, next(c.span for c in constants if c.name == name), check)


def group_mistakes(group: Group, check: PracCheck) -> Iterator[Diagnostic]:
    """The same for the rows of a group that were not parsed one by one."""
    variables = _names(group.shape)
    if variables and not any(variables.intersection(row) for row in group.unquoted):
        return
    for row in group.unquoted:
        name = _suspect(variables, row, check.doubt)
        if name is not None:
            yield _mistake(group.shape, name, _place(group, row, name), check)
            return


def _place(group: Group, row: Sequence[str], name: str) -> Span:
    """Where the constant stands; the whole row if it is not found."""
    span = group.spans[next(i for i, constants in enumerate(group.rows) if constants == row)]
    word = re.search(rf"(?<=[(,\s]){re.escape(name)}(?=[),\s])", span.text)
    start, end = word.span() if word else (0, span.end - span.start)
    return Span(span.source, span.start + start, span.start + end)


def _names(formula: tree.Formula) -> set[str]:
    return {variable.name for variable in variables_of(formula)}


def _suspect(variables: set[str], constants: Sequence[str], doubt: bool) -> str | None:
    """A constant named like a variable of the formula; or, if it has none, one that looks like a variable.

    `x` does so alone; `a1` only if all constants of the formula are of this kind and one of them stands twice.
    """
    if variables or not doubt:
        return next((name for name in constants if name in variables), None)
    similar = [name for name in constants if LOOKS_VARIABLE.fullmatch(name)]
    joined = len(similar) == len(constants) > len(set(constants))
    return next((name for name in similar if joined or not name[-1].isdigit()), None)


def _mistake(formula: tree.Formula, name: str, span: Span | None, check: PracCheck) -> Diagnostic:
    hint = f'write `?{name}` if it is a variable, or "{name}" in quotes if it is a constant'
    if name in _names(formula):
        return mistake("E119", span, hint, name=name)
    if check.marked is not None:
        return mistake("E117", span, hint, bare=name, marked=check.marked.text, place=check.marked.place)
    words = {"actual": "standard", "asked": "prac", "found": name, "meaning": "would be a constant there"}
    return mistake("E118", span, hint, **words)


def constants_as_variables(statements: Sequence[tree.Statement]) -> Iterator[Diagnostic]:
    """Variables of the standard dialect that have the name of a declared constant."""
    declared = {c.name: (c, d) for d in _types(statements) for c in d.constants if c.name[:1].islower()}
    if not declared:
        return
    for formula in _formulas(statements):
        for variable in variables_of(formula):
            if variable.name in declared:
                constant, declaration = declared[variable.name]
                hint = f'write "{variable.name}" in quotes for the constant, or give the variable another name'
                words = {"place": constant.span.place if constant.span else "the model", "type": declaration.name}
                yield mistake("E120", variable.span, hint, name=variable.name, **words)


def _types(statements: Sequence[tree.Statement]) -> Iterator[tree.TypeDeclaration]:
    for statement in statements:
        if isinstance(statement, tree.TypeDeclaration):
            yield statement
        elif isinstance(statement, tree.Include):
            yield from _types(statement.program.statements)


def _formulas(statements: Sequence[tree.Statement]) -> Iterator[tree.Formula]:
    for statement in statements:
        if isinstance(statement, tree.FormulaStatement | tree.FormulaTable):
            yield statement.formula
        elif isinstance(statement, tree.Include):
            yield from _formulas(statement.program.statements)
