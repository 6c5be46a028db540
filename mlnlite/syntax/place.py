"""Where a statement stands while it is parsed, and in which language."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from mlnlite.source import Source, Span

Language: TypeAlias = Literal["standard", "prac", "evidence", "alchemy", "tuffy", "rockit", "lomrf"]


@dataclass(frozen=True, slots=True)
class Place:
    """A statement stands at `offset` of `source`, in a language."""

    source: Source
    offset: int
    language: Language = "standard"

    def span(self, start: int, end: int) -> Span:
        """The span of characters `start` to `end` of the statement."""
        return Span(self.source, self.offset + start, self.offset + end)

    def token(self, token: Any) -> Span:  # noqa: ANN401
        """The span of a token, which knows its `start_pos` in the statement."""
        return self.span(token.start_pos, token.start_pos + len(token))
