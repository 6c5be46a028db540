"""Lines that start with `#`: what they say about the next formula."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from mlnlite.errors import Diagnostic, SyntaxMistake, did_you_mean
from mlnlite.source import Span
from mlnlite.syntax import tree
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.place import Place

_KNOWN = ("#unique", "#fixweight", "#include", "#group", "#fuzzy")
_WORD = re.compile(r"#[\w-]*")
_UNIQUE = re.compile(r"#unique\s*\{\s*(\+\??\w[\w']*(?:\s*,\s*\+\??\w[\w']*)*)\s*\}")


@dataclass(frozen=True, slots=True)
class Pending:
    """The directives that wait for their formula: their places, and what they said."""

    directives: tuple[Span, ...] = ()
    fixed: bool = False
    unique: tuple[tuple[str, ...], ...] = ()

    def applied(self, statement: tree.Statement) -> tree.Statement:
        """The statement as the directives before it want it.

        Raises:
            SyntaxMistake: it is not a formula.
        """
        if not self.directives:
            return statement
        if not isinstance(statement, tree.FormulaStatement):
            raise SyntaxMistake(self.left_over())
        return replace(statement, fixed=self.fixed or statement.fixed, unique=self.unique)

    def left_over(self) -> list[Diagnostic]:
        """A mistake for each directive that no formula follows."""
        problem, hint = "stands before a formula, but none follows", "put it on the line before its formula"
        return [mistake("E112", span, hint, directive=_word(span.text), problem=problem) for span in self.directives]


def _word(text: str) -> str:
    match = _WORD.match(text)
    return match[0] if match else text


def read_directive(text: str, place: Place, pending: Pending) -> Pending:
    """What is pending after the directive `text`, which stands at `place`.

    Raises:
        SyntaxMistake: unknown, malformed or not supported.
    """
    word, span = _word(text), place.span(0, len(text))
    mark = place.span(0, len(word))
    match word:
        case "#unique":
            found = _UNIQUE.fullmatch(text)
            if found is None:
                hint = "write `#unique{+a,+b}`, in the prac dialect `#unique{+?a,+?b}`"
                raise _malformed(span, word, "has to name variables with `+`", hint)
            names = tuple(name.strip().lstrip("+").lstrip("?") for name in found[1].split(","))
            return replace(pending, directives=(*pending.directives, mark), unique=(*pending.unique, names))
        case "#fixweight":
            if text != word:
                raise _malformed(span, word, "stands alone on its line", "put the formula on the next line")
            return replace(pending, directives=(*pending.directives, mark), fixed=True)
        case "#include":
            if not re.fullmatch(r'#include\s*(?:"[^"]+"|<[^>]+>)', text):
                raise _malformed(span, word, "needs the name of a file", 'write `#include "file.mln"`')
            return pending
        case "#group" | "#AdaptiveMLNDependency":
            return pending
        case "#fuzzy":
            hint = "remove the line: an atom of the predicate is then either true or false"
            raise SyntaxMistake([mistake("E110", mark, hint, construct="`#fuzzy` (a predicate with graded truth)")])
    if ":-" in text:
        raise SyntaxMistake([mistake("E110", mark, "drop the `#`", construct="a passing predicate (`#P(...) :-`)")])
    if text[1:2].isspace() or text == "#":
        raise SyntaxMistake([mistake("E111", mark, "a comment starts with `//`", found=word)])
    hint = did_you_mean(word, _KNOWN) or f"known are {', '.join(_KNOWN[:-1])}; a comment starts with `//`"
    raise SyntaxMistake([mistake("E111", mark, hint, found=word)])


def _malformed(span: Span, word: str, problem: str, hint: str) -> SyntaxMistake:
    return SyntaxMistake([mistake("E112", span, hint, directive=word, problem=problem)])
