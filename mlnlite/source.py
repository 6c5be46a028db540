"""Places in text: a `Source` is a named text, a `Span` a stretch of it that can show itself with a caret."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from functools import cached_property


@dataclass(frozen=True)
class Source:
    """A text and the name that its user knows it by (a path, or `<text>`)."""

    name: str
    text: str = field(repr=False)

    @cached_property
    def line_starts(self) -> tuple[int, ...]:
        """Offset of the first character of each line."""
        starts, at = [0], self.text.find("\n")
        while at >= 0:
            starts.append(at + 1)
            at = self.text.find("\n", at + 1)
        return tuple(starts)

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of `offset`, both counted from 1."""
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1

    def line(self, number: int) -> str:
        """Text of line `number` (from 1), without its end of line."""
        start = self.line_starts[number - 1]
        end = self.text.find("\n", start)
        return self.text[start : end if end >= 0 else len(self.text)].rstrip("\r")


@dataclass(frozen=True, slots=True)
class Span:
    """Characters `start` to `end` (exclusive) of a source."""

    source: Source
    start: int
    end: int

    @property
    def line(self) -> int:
        """Line of the first character, from 1."""
        return self.source.position(self.start)[0]

    @property
    def column(self) -> int:
        """Column of the first character, from 1."""
        return self.source.position(self.start)[1]

    @property
    def text(self) -> str:
        """The characters themselves."""
        return self.source.text[self.start : self.end]

    @property
    def place(self) -> str:
        """`file:line:column`."""
        line, column = self.source.position(self.start)
        return f"{self.source.name}:{line}:{column}"

    def excerpt(self, width: int = 100) -> str:
        r"""The line of the span with carets under it.

        >>> print(Span(Source("m.mln", "P(x)\nQ(y) => R"), 5, 9).excerpt())
          2 | Q(y) => R
            | ^^^^
        """
        line, column = self.source.position(self.start)
        text = self.source.line(line).replace("\t", " ")
        length = max(1, min(self.end - self.start, len(text) - column + 1))
        left = max(0, column - 1 - width // 2) if len(text) > width else 0
        shown = text[left : left + width]
        caret = " " * (column - 1 - left) + "^" * min(length, max(1, len(shown) - (column - 1 - left)))
        number = f"{line:>3} | "
        return f"{number}{shown}\n{'| '.rjust(len(number))}{caret}"
