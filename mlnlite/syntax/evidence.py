"""From the text of an evidence file to its `EvidenceProgram`: facts as columns, a million of them in seconds."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from mlnlite.errors import Diagnostic, SyntaxMistake
from mlnlite.source import Source, Span
from mlnlite.syntax.build import Fact
from mlnlite.syntax.grammar import parse_node
from mlnlite.syntax.includes import ANY_INCLUDE, File, load
from mlnlite.syntax.lines import split_facts
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.place import Place
from mlnlite.syntax.tree import Dialect, EvidenceProgram, FactTable, SoftFact, TypeDeclaration

MAX_MISTAKES = 100
_MANY = 20_000
# A fact on a line of its own whose constants are plain words: a subset of what the grammar accepts.
_WORD = r" *+-?\w++(?:[-.]\w++)*+ *+"
_FACT = re.compile(rf"^[ \t]*+(!?)([^\W\d]\w*+)\(({_WORD}(?:,{_WORD})*+)\)[ \t\r]*+$", re.MULTILINE)
_VALUE = re.compile(r'(?:-?\w[\w.:/$-]*|"(?:[^"\\\n]|\\[^\n])*")\s*=(?!\s*\{)')
_TYPE = re.compile(r"[^\W\d][\w'-]*\s*=\s*\{")


@dataclass(slots=True)
class _Rows:
    """A fact table that grows. Arguments of facts read by the pattern stay together, uncut, until there are many."""

    columns: tuple[list[str], ...]
    truth: list[bool] = field(default_factory=list)
    database: list[int] = field(default_factory=list)
    offset: list[int] = field(default_factory=list)
    uncut: list[str] = field(default_factory=list)


@dataclass(slots=True)
class _Reading:
    """What has been read so far.

    Attributes:
        rows: the facts by predicate and number of arguments.
        constants: every constant once, so that equal ones share one string.
        types: the type declarations.
        soft: the soft facts.
        database: number of the database that is being read.
        separator: a `---` after which nothing has been read yet.
        offset: where facts stand if they come from an included file: at its `#include`.
        mistakes: what was wrong so far.
    """

    rows: dict[tuple[str, int], _Rows] = field(default_factory=dict)
    constants: dict[str, str] = field(default_factory=dict)
    types: list[TypeDeclaration] = field(default_factory=list)
    soft: list[SoftFact] = field(default_factory=list)
    database: int = 0
    separator: bool = False
    offset: int | None = None
    mistakes: list[Diagnostic] = field(default_factory=list)


def parse_evidence(source: Source, dialect: Dialect) -> EvidenceProgram:
    """The facts of an evidence file; every argument is a constant in both dialects.

    `---` alone on a line starts the next database. Facts of an included file belong to the database of the `#include`,
    and their place is that of the `#include`.

    Args:
        source: the file.
        dialect: the dialect of the model; since facts have no variables, it makes no difference.

    Raises:
        SyntaxMistake: with every mistake in the file.
    """
    reading = _Reading()
    file = load(source)
    reading.mistakes += file.mistakes
    _read_file(file, reading)
    if reading.mistakes:
        raise SyntaxMistake(reading.mistakes)
    n_databases = reading.database + (not reading.separator)
    span = Span(source, 0, len(source.text))
    return EvidenceProgram(tuple(_tables(reading)), tuple(reading.types), n_databases, tuple(reading.soft), span)


def _tables(reading: _Reading) -> Iterator[FactTable]:
    for (predicate, _), rows in reading.rows.items():
        _cut(rows, reading.constants)
        yield FactTable(predicate, rows.columns, rows.truth, rows.database, rows.offset)


def _read_file(file: File, reading: _Reading) -> None:
    """Plain facts by one pattern, the stretches between them statement by statement."""
    done, text, included_at = 0, file.code.text, reading.offset
    for match in _FACT.finditer(text):
        sign, predicate, arguments = match.groups()
        start = match.start(1)
        if start - done > 1 and not text[done:start].isspace():
            _read_between(file, done, start, reading)
            if len(reading.mistakes) > MAX_MISTAKES:
                return
        done = match.end()
        rows = _rows(reading, predicate, arguments.count(",") + 1)
        rows.uncut.append(arguments)
        if len(rows.uncut) >= _MANY:
            _cut(rows, reading.constants)
        rows.truth.append(not sign)
        rows.database.append(reading.database)
        rows.offset.append(start if included_at is None else included_at)
        reading.separator = False
    _read_between(file, done, len(text), reading)


def _rows(reading: _Reading, predicate: str, n_arguments: int) -> _Rows:
    rows = reading.rows.get((predicate, n_arguments))
    if rows is None:
        rows = reading.rows[predicate, n_arguments] = _Rows(tuple([] for _ in range(n_arguments)))
    return rows


def _add(reading: _Reading, fact: Fact, positive: bool, offset: int) -> None:
    rows = _rows(reading, fact.predicate, len(fact.arguments))
    _cut(rows, reading.constants)
    for column, name in zip(rows.columns, fact.arguments, strict=True):
        column.append(reading.constants.setdefault(name, name))
    rows.truth.append(positive)
    rows.database.append(reading.database)
    rows.offset.append(offset if reading.offset is None else reading.offset)


def _cut(rows: _Rows, constants: dict[str, str]) -> None:
    """Moves the uncut arguments into the columns, many at once."""
    if rows.uncut:
        words = ",".join(rows.uncut).replace(" ", "").split(",")
        shared = list(map(constants.setdefault, words, words))
        for number, column in enumerate(rows.columns):
            column += shared[number :: len(rows.columns)]
        rows.uncut.clear()


def _read_between(file: File, start: int, end: int, reading: _Reading) -> None:
    for first, last in split_facts(file.code, start, end):
        if len(reading.mistakes) >= MAX_MISTAKES:
            reading.mistakes.append(mistake("E199", Span(file.code.source, first, last), limit=MAX_MISTAKES))
            return
        try:
            _read_statement(file, first, last, reading)
        except SyntaxMistake as error:
            reading.mistakes += error.diagnostics


def _read_statement(file: File, start: int, end: int, reading: _Reading) -> None:
    source, text = file.code.source, file.code.text[start:end]
    if text == "---":
        reading.database += 1
        reading.separator = True
        return
    reading.separator = False
    if text.startswith("#"):
        _read_include(file, start, end, reading)
    elif text.startswith("---"):
        raise SyntaxMistake([mistake("E147", Span(source, start, end), "put `---` alone on its line", found=text)])
    elif _TYPE.match(text):
        reading.types.append(parse_node("type_declaration", text, Place(source, start), "evidence"))
    else:
        rule = "value" if _VALUE.match(text) else "fact"
        fact: Fact = parse_node(rule, text, Place(source, start), "evidence")
        if fact.unknown or not _is_certain(fact):
            _add_soft(reading, fact, start)
        else:
            _add(reading, fact, fact.positive == (fact.truth != 0.0), start)


def _add_soft(reading: _Reading, fact: Fact, start: int) -> None:
    if fact.unknown and not fact.positive:
        hint = "write `?` alone to leave the fact open, or `!` alone if it is false"
        raise SyntaxMistake([mistake("E145", fact.span, hint)])
    probability = 0.5 if fact.truth is None else fact.truth if fact.positive else 1 - fact.truth
    assert fact.span is not None
    place = Span(fact.span.source, start if reading.offset is None else reading.offset, fact.span.end)
    span = fact.span if reading.offset is None else place
    soft = SoftFact(fact.predicate, fact.arguments, probability, fact.unknown, reading.database, span)
    reading.soft.append(soft)


def _is_certain(fact: Fact) -> bool:
    """Whether the number in front of a fact, if any, is 0 or 1."""
    if fact.truth in (None, 0.0, 1.0):
        return True
    if 0.0 < (fact.truth or 0.0) < 1.0:
        return False
    hint = "weights belong to the formulas of the model; write the fact without a number"
    raise SyntaxMistake([mistake("E148", fact.span, hint, found=f"{fact.truth:g}")])


def _read_include(file: File, start: int, end: int, reading: _Reading) -> None:
    text, span = file.code.text[start:end], Span(file.code.source, start, end)
    if start in file.included:
        included = file.included[start][1]
        if included:
            outer, reading.offset = reading.offset, start if reading.offset is None else reading.offset
            _read_file(included, reading)
            reading.offset = outer
    elif ANY_INCLUDE.match(text):
        hint = 'write `#include "file.db"`'
        raise SyntaxMistake([mistake("E112", span, hint, directive="#include", problem="needs the name of a file")])
    else:
        hint = "a comment starts with `//`; the only directive of evidence is `#include`"
        raise SyntaxMistake([mistake("E111", span, hint, found=text.split()[0])])
