"""From the text of a model, in one or several sources, to its `Program`. All mistakes are reported at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from mlnlite.errors import Diagnostic, SyntaxMistake
from mlnlite.source import Source, Span
from mlnlite.syntax import tree
from mlnlite.syntax.dialects import constants_as_variables, first_marked, group_mistakes, prac_mistakes, wrong_dialect
from mlnlite.syntax.directives import Pending, read_directive
from mlnlite.syntax.files import read_source
from mlnlite.syntax.includes import File, load
from mlnlite.syntax.lines import split_statements
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.queries import parse_atom_query, split_queries
from mlnlite.syntax.statements import read_statement
from mlnlite.syntax.tables import Group, Tables, add, can_gather, finish, read_row
from mlnlite.syntax.tree import Dialect, Program

__all__ = ["parse_atom_query", "parse_model", "read_source", "split_queries"]

MAX_MISTAKES = 100


@dataclass(slots=True)
class _Reading:
    """What is known while the files of a model are read.

    Attributes:
        dialect: of the model.
        marked: a variable with a question mark, if there is one.
        declared: the declaration of each predicate so far.
        mistakes: what was wrong so far.
    """

    dialect: Dialect
    marked: Span | None
    declared: dict[str, tree.PredicateDeclaration] = field(default_factory=dict)
    mistakes: list[Diagnostic] = field(default_factory=list)


def parse_model(sources: Sequence[Source], dialect: Dialect | None = None) -> Program:
    """The program of a model.

    Args:
        sources: its files; each continues the one before.
        dialect: how to read it; found out from the variables if None.

    Returns:
        The program: statements in the order of the files, formulas that differ only in constants and weights as tables.

    Raises:
        SyntaxMistake: with every mistake in every file.
    """
    files = [load(source) for source in sources]
    marked = first_marked(code for file in files for code in file.codes())
    reading = _Reading(dialect or ("prac" if marked else "standard"), marked)
    reading.mistakes += [diagnostic for file in files for diagnostic in file.mistakes]
    if dialect == "standard" and marked:
        raise SyntaxMistake([*reading.mistakes, wrong_dialect(marked)])
    statements = _read_files(files, reading)
    if reading.dialect == "standard":
        reading.mistakes += constants_as_variables(statements)
    if reading.mistakes:
        raise SyntaxMistake(_in_order(reading.mistakes))
    span = Span(sources[0], 0, len(sources[0].text)) if sources else None
    return Program(statements, reading.dialect, span)


def _in_order(mistakes: list[Diagnostic]) -> list[Diagnostic]:
    """Files in the order in which they were met, places in a file from top to bottom."""
    names = {d.span.source.name: None for d in mistakes if d.span}
    rank = {name: number for number, name in enumerate(names)}
    ordered = sorted(mistakes, key=lambda d: (rank[d.span.source.name], d.span.start) if d.span else (-1, 0))
    return list(dict.fromkeys(ordered))


def _read_files(files: Sequence[File], reading: _Reading) -> tuple[tree.Statement, ...]:
    tables = Tables(reading.dialect)
    items: list[tree.Statement | Group] = []
    for file in files:
        _read_file(file, reading, tables, items)
    if reading.dialect == "prac":
        for group in tables.groups.values():
            reading.mistakes += group_mistakes(group, reading.marked)
    return tuple(finish(item) if isinstance(item, Group) else item for item in items)


def _read_file(file: File, reading: _Reading, tables: Tables, items: list[tree.Statement | Group]) -> None:
    source, code = file.code.source, file.code.text
    pending = Pending()
    for start, end in split_statements(file.code):
        if len(reading.mistakes) >= MAX_MISTAKES:
            reading.mistakes.append(mistake("E199", Span(source, start, end), limit=MAX_MISTAKES))
            return
        text = code[start:end]
        try:
            if text[0] == "#":
                pending = read_directive(text, source, start, pending)
                if start in file.included:
                    _read_include(file, start, end, reading, items)
                continue
            row = False if pending.directives else read_row(tables, source, text, start)
            if row is False:
                _read_one(text, source, start, pending, reading, tables, items)
                pending = Pending()
            elif isinstance(row, Group):
                items.append(row)
        except SyntaxMistake as error:
            reading.mistakes += error.diagnostics
            pending = Pending()
    reading.mistakes += pending.left_over()


def _read_include(file: File, start: int, end: int, reading: _Reading, items: list[tree.Statement | Group]) -> None:
    path, included = file.included[start]
    if included:
        program = Program(_read_files([included], reading), reading.dialect, Span(included.code.source, 0, 0))
        items.append(tree.Include(path, program, Span(file.code.source, start, end)))


def _read_one(
    text: str,
    source: Source,
    start: int,
    pending: Pending,
    reading: _Reading,
    tables: Tables,
    items: list[tree.Statement | Group],
) -> None:
    statement = pending.applied(read_statement(text, source, start, reading.dialect, reading.declared))
    if isinstance(statement, tree.PredicateDeclaration):
        reading.declared.setdefault(statement.name, statement)
    if not isinstance(statement, tree.FormulaStatement):
        items.append(statement)
        return
    if reading.dialect == "prac":
        reading.mistakes += prac_mistakes(statement.formula, reading.marked)
    if can_gather(statement):
        group = add(tables, statement)
        if group:
            items.append(group)
    else:
        items.append(statement)
