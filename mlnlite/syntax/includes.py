"""The files of a model: sources and what they include, found before anything is parsed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mlnlite.errors import Diagnostic, SyntaxMistake
from mlnlite.source import Source, Span
from mlnlite.syntax.files import read_source, similar_file
from mlnlite.syntax.lines import Code, strip_comments
from mlnlite.syntax.messages import mistake

MAX_INCLUDES = 50
_INCLUDE = re.compile(r'^[ \t]*#include[ \t]*(?:"([^"\n]*)"|<([^>\n]*)>)[ \t\r]*$', re.MULTILINE)
ANY_INCLUDE = re.compile(r"#include\b")


@dataclass(frozen=True, slots=True)
class File:
    """A source ready to be parsed.

    Attributes:
        code: its text without comments.
        included: for the offset of each `#include` its path as written and the file, None if it could not be read.
        mistakes: what was wrong so far, in this file and in those it includes.
    """

    code: Code
    included: dict[int, tuple[str, File | None]]
    mistakes: tuple[Diagnostic, ...]

    def codes(self) -> Iterator[Code]:
        """The code of this file and of all that it includes."""
        yield self.code
        for _, file in self.included.values():
            if file:
                yield from file.codes()


def load(source: Source, chain: tuple[str, ...] = ()) -> File:
    """The file of a source, with all that it includes; `chain` holds the real paths of the files that led here."""
    code, mistakes = strip_comments(source)
    included: dict[int, tuple[str, File | None]] = {}
    if "#" in code.text and "#include" in code.text:
        chain = (*chain, _real(source.name))
        for match in _INCLUDE.finditer(code.text):
            path = match[1] if match[1] is not None else match[2]
            span = Span(source, match.start() + match[0].index("#"), match.end())
            file, wrong = _included(path, span, chain)
            included[span.start] = path, file
            mistakes += wrong
    return File(code, included, tuple(mistakes))


def _included(path: str, span: Span, chain: tuple[str, ...]) -> tuple[File | None, list[Diagnostic]]:
    target = Path(span.source.name).parent / path
    real = _real(str(target))
    if real in chain:
        names = " -> ".join(Path(name).name for name in (*chain[chain.index(real) :], real))
        return None, [mistake("E138", span, "one of these files has to do without the other", chain=names)]
    if len(chain) >= MAX_INCLUDES:
        return None, [mistake("E139", span, "put the statements into fewer files", limit=MAX_INCLUDES)]
    if target.suffix in (".cpp", ".jar"):
        hint = "give the values that it computes as facts of a predicate"
        return None, [mistake("E110", span, hint, construct=f"an include of program code (`{path}`)")]
    if not target.exists():
        hint = similar_file(target) or "the path is taken relative to the including file"
        return None, [mistake("E137", span, hint, path=path)]
    try:
        file = load(read_source(target), chain)
    except SyntaxMistake as error:
        return None, list(error.diagnostics)
    return file, list(file.mistakes)


def _real(name: str) -> str:
    return str(Path(name).resolve())
