"""From the text of an evidence file to its `EvidenceProgram`: facts as columns, a million of them in seconds."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

from mlnlite.errors import Diagnostic, SyntaxMistake
from mlnlite.source import Source, Span
from mlnlite.syntax.build import Fact
from mlnlite.syntax.facts import EvidenceProgram
from mlnlite.syntax.grammar import parse_node
from mlnlite.syntax.includes import ANY_INCLUDE, File, load
from mlnlite.syntax.letters import LargeFile, Letters, letters_of
from mlnlite.syntax.lines import split_facts
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.pieces import Piece, log_odds
from mlnlite.syntax.place import Place
from mlnlite.syntax.plain import Tokens, read_plain
from mlnlite.syntax.rows import Progress, Rows
from mlnlite.syntax.tree import TypeDeclaration

if TYPE_CHECKING:
    from mlnlite.syntax.bulk import Vocabulary

MAX_MISTAKES = 100
BULK = 1 << 22
"""Characters from which on facts are read by compiled code, which takes .4 s to load."""
_VALUE = re.compile(r'(?:-?\w[\w.:/$-]*|"(?:[^"\\\n]|\\[^\n])*")\s*=(?!\s*\{)')
_TYPE = re.compile(r"[^\W\d][\w'-]*\s*=\s*\{")


@dataclass(slots=True)
class _Reading:
    """What has been read so far.

    Attributes:
        tokens: the words that a pattern has met.
        rows: the facts.
        progress: where reading is.
        types: the type declarations.
        mistakes: what was wrong so far.
        vocabulary: the words that compiled code has met.
    """

    tokens: Tokens = field(default_factory=Tokens)
    rows: Rows = field(default_factory=Rows)
    progress: Progress = field(default_factory=Progress)
    types: list[TypeDeclaration] = field(default_factory=list)
    mistakes: list[Diagnostic] = field(default_factory=list)
    vocabulary: Vocabulary | None = None


def parse_evidence(source: Source) -> EvidenceProgram:
    """The facts of an evidence file; every argument is a constant, in all dialects.

    `---` alone on a line starts the next database. Facts of an included file belong to the database of the `#include`.

    Raises:
        SyntaxMistake: with every mistake in the file.
    """
    reading = _Reading()
    reading.rows.words = reading.tokens.words
    start = _read_plain(source, reading) if isinstance(source, LargeFile) else 0
    if start is not None:
        file = load(source)
        reading.mistakes += file.mistakes
        _read_file(file, reading, start)
    if reading.mistakes:
        raise SyntaxMistake(reading.mistakes)
    n_databases = reading.progress.database + (not reading.progress.separator)
    tables = tuple(reading.rows.tables(reading.vocabulary.texts() if reading.vocabulary else ()))
    return EvidenceProgram(tables, tuple(reading.types), n_databases, Span(source, 0, 1))


def _read_plain(source: LargeFile, reading: _Reading) -> int | None:
    """Facts at the begin of a large file, which need no text; where other lines begin, if there are any."""
    return next((rest[0] for rest in _read_bulk(source, source.chunks(), 0, reading)), None)


def _read_file(file: File, reading: _Reading, begin: int = 0) -> None:
    """Large files by compiled code; what that leaves, and small files, by a pattern; what that leaves, by the grammar.

    An included file may have databases of its own, so it is read between what stands before and after it.
    """
    text = file.code.text
    for start, end in pairwise([begin, *sorted(i for i in file.included if i >= begin), len(text)]):
        first = (text.find("\n", start) + 1 or end) if start in file.included else start
        if end - first < BULK:
            _read_lines(file, start, end, reading)
            continue
        _read_lines(file, start, first, reading)
        for left, behind in _read_bulk(file.code.source, [letters_of(text[first:end])], first, reading):
            if len(reading.mistakes) <= MAX_MISTAKES:
                _read_lines(file, left, min(behind, end), reading)


def _read_bulk(source: Source, chunks: Iterable[Letters], start: int, reading: _Reading) -> Iterator[tuple[int, int]]:
    """Facts by compiled code; start and end of the lines that it leaves."""
    from mlnlite.syntax.bulk import Vocabulary, read_bulk

    reading.vocabulary = reading.vocabulary or Vocabulary()
    for found in read_bulk(chunks, start, reading.progress, reading.vocabulary):
        if isinstance(found, Piece):
            reading.rows.add_bulk(source, found)
        else:
            yield found


def _read_lines(file: File, start: int, end: int, reading: _Reading) -> None:
    """Plain facts by a pattern, the stretches between them statement by statement."""
    for found in read_plain(file.code.text, start, end, reading.progress, reading.tokens):
        if isinstance(found, Piece):
            reading.rows.add_piece(file.code.source, found)
        elif len(reading.mistakes) <= MAX_MISTAKES:
            _read_between(file, *found, reading)


def _read_between(file: File, start: int, end: int, reading: _Reading) -> None:
    if not file.code.text[start:end].strip():
        return
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
        reading.progress.database += 1
        reading.progress.separator = True
        return
    reading.progress.separator = False
    if text.startswith("#"):
        _read_include(file, start, end, reading)
    elif text.startswith("---"):
        raise SyntaxMistake([mistake("E147", Span(source, start, end), "put `---` alone on its line", found=text)])
    elif _TYPE.match(text):
        reading.types.append(parse_node("type_declaration", text, Place(source, start), "evidence"))
    else:
        rule = "value" if _VALUE.match(text) else "fact"
        fact: Fact = parse_node(rule, text, Place(source, start), "evidence")
        what, database = (fact.predicate, fact.arguments), reading.progress.database
        if fact.unknown or not _is_certain(fact):
            reading.rows.add(source, what, _weight(fact), (database, start))
        else:
            reading.rows.add(source, what, fact.positive == (fact.truth != 0.0), (database, start))


def _weight(fact: Fact) -> float:
    """The log-odds of soft evidence."""
    if fact.unknown and not fact.positive:
        hint = "write `?` alone to leave the fact open, or `!` alone if it is false"
        raise SyntaxMistake([mistake("E145", fact.span, hint)])
    if fact.truth is None:
        return 0.0
    return log_odds(fact.truth if fact.positive else 1 - fact.truth)


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
            _read_file(included, reading)
    elif ANY_INCLUDE.match(text):
        hint = 'write `#include "file.db"`'
        raise SyntaxMistake([mistake("E112", span, hint, directive="#include", problem="needs the name of a file")])
    else:
        hint = "a comment starts with `//`; the only directive of evidence is `#include`"
        raise SyntaxMistake([mistake("E111", span, hint, found=text.split()[0])])
