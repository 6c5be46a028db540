"""From the text of a model, in one or several sources, to its `Program`. All mistakes are reported at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from mlnlite.errors import Diagnostic, SyntaxMistake
from mlnlite.source import Source, Span
from mlnlite.syntax import tree
from mlnlite.syntax.detect import NOTES, detected
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
from mlnlite.syntax.programs import Vocabulary, completion, finished, read_test, recursive
from mlnlite.syntax.queries import parse_atom_query, split_queries
from mlnlite.syntax.statements import read_foreign, read_statement
from mlnlite.syntax.tables import Gathering, add, can_gather, finish, read_row
from mlnlite.syntax.tree import AnyDialect, Dialect, Origin, Program

__all__ = ["parse_atom_query", "parse_model", "read_source", "split_queries"]

MAX_MISTAKES = 100


@dataclass(slots=True)
class _Reading:
    """What is known while the files of a model are read.

    Attributes:
        dialect: of the model.
        check: what tells the dialects apart.
        vocabulary: what statements have defined so far.
        mistakes: what was wrong so far.
    """

    dialect: AnyDialect
    check: PracCheck
    vocabulary: Vocabulary = field(default_factory=Vocabulary)
    mistakes: list[Diagnostic] = field(default_factory=list)


def parse_model(sources: Sequence[Source], dialect: AnyDialect | None = None) -> Program:
    """The program of a model.

    Args:
        sources: its files; each continues the one before.
        dialect: how to read it; found out from the variables if None.

    Returns:
        The program: statements in the order of the files, formulas that differ only in constants and weights as tables.
        The languages of other systems (alchemy, tuffy, rockit, lomrf) give a program of the standard dialect.

    Raises:
        SyntaxMistake: with every mistake in every file.
    """
    program, mistakes = parse_what_can_be_read(sources, dialect)
    if mistakes:
        raise SyntaxMistake(mistakes)
    return program


def parse_what_can_be_read(
    sources: Sequence[Source], dialect: AnyDialect | None = None
) -> tuple[Program, list[Diagnostic]]:
    """As `parse_model`, with the mistakes beside the program, which lacks the statements that they stand in."""
    files = [load(source) for source in sources]
    codes = [code for file in files for code in file.codes()]
    marked = first_marked(codes)
    check = PracCheck(marked, doubt=dialect is None or marked is None)
    found, reasons = (dialect, ()) if dialect else detected(codes) if marked is None else ("prac", (_why(marked),))
    reading = _Reading(found, check)
    reading.mistakes += [diagnostic for file in files for diagnostic in file.mistakes]
    if dialect == "standard" and marked:
        return Program((), "standard"), [*reading.mistakes, wrong_dialect(marked)]
    statements = _read_files(files, reading)
    if reading.dialect not in ("prac", "rockit"):
        reading.mistakes += constants_as_variables(statements)
    span = Span(sources[0], 0, len(sources[0].text)) if sources else None
    origin = Origin(found, reasons, NOTES[found])
    return Program(statements, _written(found), span, origin), _in_order(reading.mistakes)


def _why(marked: Span) -> str:
    return f"a variable with a question mark at {marked.place}"


def _written(dialect: AnyDialect) -> Dialect:
    """The dialect of the tree of a language."""
    return "prac" if dialect == "prac" else "standard"


def _in_order(mistakes: list[Diagnostic]) -> list[Diagnostic]:
    """Files in the order in which they were met, places in a file from top to bottom, each mistake once."""
    names = {d.span.source.name: None for d in mistakes if d.span}
    rank = {name: number for number, name in enumerate(names)}
    ordered = sorted(mistakes, key=lambda d: (rank[d.span.source.name], d.span.start) if d.span else (-1, 0))
    return list({str(diagnostic): diagnostic for diagnostic in ordered}.values())


def _read_files(files: Sequence[File], reading: _Reading) -> tuple[tree.Statement, ...]:
    gathering = Gathering(_written(reading.dialect))
    for file in files:
        _read_file(file, reading, gathering)
    try:
        if reading.dialect == "tuffy":
            reading.mistakes += recursive(reading.vocabulary)
        rules, reading.vocabulary.rules = list(completion(reading.vocabulary)), {}
        gathering.items += rules
    except SyntaxMistake as error:
        reading.mistakes += error.diagnostics
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
            if text.startswith("@test"):
                gathering.items.append(read_test(text, place))
            elif text[0] == "#":
                pending = read_directive(text, place, pending)
                _read_include(file, place.span(0, len(text)), reading, gathering)
            else:
                waiting, pending = pending, Pending()
                _read_statement(text, place, waiting, reading, gathering)
        except SyntaxMistake as error:
            reading.mistakes += error.diagnostics
    reading.mistakes += pending.left_over()


def _read_statement(text: str, place: Place, waiting: Pending, reading: _Reading, gathering: Gathering) -> None:
    language, vocabulary = reading.dialect, reading.vocabulary
    if language == "standard" or language == "prac":
        if not waiting.directives and read_row(gathering, text, place):
            return
        statement = read_statement(text, place, language, vocabulary.declared)
    else:
        statement = read_foreign(text, place, language, vocabulary.declared)
    for meant in finished(waiting.applied(statement), vocabulary):
        _add(meant, reading, gathering)


def _read_include(file: File, span: Span, reading: _Reading, gathering: Gathering) -> None:
    path, included = file.included.get(span.start, ("", None))
    if included:
        source = included.code.source
        program = Program(
            _read_files([included], reading), _written(reading.dialect), Span(source, 0, len(source.text))
        )
        gathering.items.append(tree.Include(path, program, span))


def _add(statement: tree.Statement, reading: _Reading, gathering: Gathering) -> None:
    if isinstance(statement, tree.FormulaStatement):
        if reading.dialect == "prac":
            reading.mistakes += prac_mistakes(statement.formula, reading.check)
        if can_gather(statement):
            add(gathering, statement)
            return
    gathering.items.append(statement)
