"""From a source to its statements: comments become blanks, and lines are joined to statements. Offsets never change."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from mlnlite.errors import Diagnostic
from mlnlite.source import Source, Span
from mlnlite.syntax.messages import mistake

# ruff: noqa: RUF001 (signs that look like ours are the point here)
# A line that ends like this goes on in the next one.
_GOES_ON = ("^", "=>", "=", "!", ",", "(", "{", " v", ")v", "->", "&", "|", " and", " or", "∧", "∨", "→", "⇒")
# A line of evidence, or all lines of a type.
_FACT_LINE = re.compile(r"[^\W\d][\w'-]*[ \t]*=[ \t]*\{[^{}()=]*\}[^\n]*|\S[^\n]*")
_EQUALS_V = re.compile(r"=\s*v$")
_QUANTIFIER = re.compile(r"\b(?i:exists?|forall)\s+[?\w',\s]+$")
_NEW_STATEMENT = re.compile(
    r"#|@|\*\w|---|\w+\s*=\s*\{"  # a directive, a fixed weight, a closed predicate, a separator, a type
    r"|(?:[-+]?[.\d][^\s(),]*|(?:log|logx|logit|ln|exp|sqrt)\(\S*\))\s+[!(?]*[^\W\d]"  # a weight and a formula
)


@dataclass(frozen=True)
class Code:
    """A source without what the grammar does not see.

    Attributes:
        source: the source.
        text: its text with every character of a comment replaced by a blank.
    """

    source: Source
    text: str

    @cached_property
    def bare(self) -> str:
        """The text with every character of a quoted constant replaced by `_`."""
        return _COMMENT_OR_QUOTE.sub(lambda m: "_" * len(m[0]), self.text) if '"' in self.text else self.text


_COMMENT_OR_QUOTE = re.compile(r'//[^\n]*|/\*.*?(?:\*/|\Z)|"(?:[^"\\\n]|\\[^\n])*"', re.DOTALL)
_VISIBLE = re.compile(r"[^\n]")


def strip_comments(source: Source) -> tuple[Code, list[Diagnostic]]:
    """The code of a source, and a mistake if a comment is never closed."""
    text = source.text
    if "/" not in text or ("//" not in text and "/*" not in text):  # one sign is looked for ten times as fast
        return Code(source, text), []
    code = _COMMENT_OR_QUOTE.sub(lambda m: m[0] if m[0][0] == '"' else _VISIBLE.sub(" ", m[0]), text)
    return Code(source, code), list(_unclosed(source)) if "/*" in text else []


def _unclosed(source: Source) -> Iterator[Diagnostic]:
    for match in _COMMENT_OR_QUOTE.finditer(source.text):
        if match[0].startswith("/*") and (len(match[0]) < 4 or not match[0].endswith("*/")):
            hint = "everything after it is taken as comment; write `*/` where the comment ends"
            yield mistake("E113", Span(source, match.start(), match.start() + 2), hint)


def _goes_on(text: str) -> bool:
    if text.endswith(_GOES_ON):
        return not _EQUALS_V.search(text)
    return text[-1] != ")" and _QUANTIFIER.search(text) is not None


def split_statements(code: Code) -> Iterator[tuple[int, int]]:
    """Start and end offset of each statement.

    A statement ends with its line, unless a parenthesis or brace is open or the line ends in a connective. A blank
    line, or one that is clearly another statement, ends it even then: one mistake shall not swallow the file.
    """
    start, end, depth, offset = -1, 0, 0, 0
    for line in code.bare.split("\n"):
        text = line.strip()
        if text:
            if start >= 0 and _NEW_STATEMENT.match(text):
                yield start, end
                start = -1
            left = offset + line.index(text[0])
            if start < 0:
                start, depth = left, 0
            end = left + len(text)
            depth += text.count("(") + text.count("{") - text.count(")") - text.count("}")
            if (depth <= 0 and not _goes_on(text)) or text[0] == "#":
                yield start, end
                start = -1
        elif start >= 0 and not code.source.text[offset : offset + len(line)].strip():
            yield start, end
            start = -1
        offset += len(line) + 1
    if start >= 0:
        yield start, end


def split_facts(code: Code, first: int, last: int) -> Iterator[tuple[int, int]]:
    """Start and end offset of each line between two offsets that is not blank; a type may take several lines."""
    for match in _FACT_LINE.finditer(code.bare, first, last):
        yield match.start(), match.start() + len(match[0].rstrip())
