"""From the text of a model, in one or several sources, to its `Program`. All mistakes are reported at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from mlnlite.errors import Diagnostic, SyntaxMistake
from mlnlite.source import Source, Span
from mlnlite.syntax import tree
from mlnlite.syntax.dialects import (
    PracCheck,
    constants_as_variables,
    first_marked,
    group_mistakes,
    prac_mistakes,
    wrong_dialect,
)
from mlnlite.syntax.directives import Pending, read_directive
from mlnlite.syntax.files import read_source
from mlnlite.syntax.includes import File, load
from mlnlite.syntax.lines import split_statements
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.place import Place
from mlnlite.syntax.queries import parse_atom_query, split_queries
from mlnlite.syntax.statements import read_statement
from mlnlite.syntax.tables import Gathering, add, can_gather, finish, read_row
from mlnlite.syntax.tree import Dialect, Program

__all__ = ["parse_atom_query", "parse_model", "read_source", "split_queries"]

MAX_MISTAKES = 100


@dataclass(slots=True)
class _Reading:
    """What is known while the files of a model are read.

    Attributes:
        dialect: of the model.
        check: what tells the dialects apart.
        declared: the first declaration of each predicate so far.
        mistakes: what was wrong so far.
    """

    dialect: Dialect
    check: PracCheck
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
    check = PracCheck(marked, doubt=dialect is None or marked is None)
    reading = _Reading(dialect or ("prac" if marked else "standard"), check)
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
    """Files in the order in which they were met, places in a file from top to bottom, each mistake once."""
    names = {d.span.source.name: None for d in mistakes if d.span}
    rank = {name: number for number, name in enumerate(names)}
    ordered = sorted(mistakes, key=lambda d: (rank[d.span.source.name], d.span.start) if d.span else (-1, 0))
    return list({str(diagnostic): diagnostic for diagnostic in ordered}.values())


def _read_files(files: Sequence[File], reading: _Reading) -> tuple[tree.Statement, ...]:
    gathering = Gathering(reading.dialect)
    for file in files:
        _read_file(file, reading, gathering)
    if reading.dialect == "prac":
        for group in gathering.groups.values():
            reading.mistakes += group_mistakes(group, reading.check)
    return finish(gathering)


def _read_file(file: File, reading: _Reading, gathering: Gathering) -> None:
    pending = Pending()
    for start, end in split_statements(file.code):
        place, text = Place(file.code.source, start), file.code.text[start:end]
        if len(reading.mistakes) >= MAX_MISTAKES:
            reading.mistakes.append(mistake("E199", place.span(0, len(text)), limit=MAX_MISTAKES))
            return
        try:
            if text[0] == "#":
                pending = read_directive(text, place, pending)
                _read_include(file, place.span(0, len(text)), reading, gathering)
            else:
                waiting, pending = pending, Pending()
                if waiting.directives or not read_row(gathering, text, place):
                    statement = read_statement(text, place, reading.dialect, reading.declared)
                    _add(waiting.applied(statement), reading, gathering)
        except SyntaxMistake as error:
            reading.mistakes += error.diagnostics
    reading.mistakes += pending.left_over()


def _read_include(file: File, span: Span, reading: _Reading, gathering: Gathering) -> None:
    path, included = file.included.get(span.start, ("", None))
    if included:
        source = included.code.source
        program = Program(_read_files([included], reading), reading.dialect, Span(source, 0, len(source.text)))
        gathering.items.append(tree.Include(path, program, span))


def _add(statement: tree.Statement, reading: _Reading, gathering: Gathering) -> None:
    if isinstance(statement, tree.PredicateDeclaration):
        reading.declared.setdefault(statement.name, statement)
    if isinstance(statement, tree.FormulaStatement):
        if reading.dialect == "prac":
            reading.mistakes += prac_mistakes(statement.formula, reading.check)
        if can_gather(statement):
            add(gathering, statement)
            return
    gathering.items.append(statement)
