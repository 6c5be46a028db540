"""Which of the two dialects a model is written in, and formulas that are written in the other one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

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
_QUOTE_HINT = 'write `?{0}` if it is a variable, or "{0}" in quotes if it is a constant'


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


def prac_mistakes(formula: tree.Formula, marked: Span | None) -> Iterator[Diagnostic]:
    """Constants of a prac formula that must have been meant as variables.

    Args:
        formula: a formula read in the prac dialect.
        marked: some variable with a question mark in the model, if there is one.
    """
    constants = [c for c in constants_of(formula) if c.span and not c.span.text.startswith('"')]
    found = _suspicious(formula, [c.name for c in constants])
    spans = {c.name: c.span for c in reversed(constants)}
    yield from (_mistake(formula, name, spans[name], marked) for name in found)


def group_mistakes(group: Group, marked: Span | None) -> Iterator[Diagnostic]:
    """The same for the rows of a group that were not parsed one by one."""
    names = {name for row in group.unquoted for name in row}
    for name in _suspicious(group.shape, sorted(names)):
        row = next(i for i, constants in enumerate(group.rows) if name in constants)
        span = group.spans[row]
        word = re.search(rf"(?<=[(,\s]){re.escape(name)}(?=[),\s])", span.text)
        start, end = word.span() if word else (0, span.end - span.start)
        yield _mistake(group.shape, name, Span(span.source, span.start + start, span.start + end), marked)


def _suspicious(formula: tree.Formula, constants: Sequence[str]) -> list[str]:
    """At most one constant: one named like a variable of the formula or, if that has none, one that looks like one."""
    variables = {variable.name for variable in variables_of(formula)}
    for name in constants:
        if name in variables or (not variables and LOOKS_VARIABLE.fullmatch(name)):
            return [name]
    return []


def _mistake(formula: tree.Formula, name: str, span: Span | None, marked: Span | None) -> Diagnostic:
    hint = _QUOTE_HINT.format(name)
    if any(variable.name == name for variable in variables_of(formula)):
        return mistake("E119", span, hint, name=name)
    if marked is not None:
        return mistake("E117", span, hint, bare=name, marked=marked.text, place=marked.place)
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
