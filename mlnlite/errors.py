"""What a user can do wrong, as data: a `Diagnostic` says what and where, an `MlnError` carries all of them at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

from mlnlite.source import Span


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One mistake or warning.

    Attributes:
        code: stable code, `E...` for errors, `W...` for warnings.
        message: one sentence: what is wrong, with what was found and what was expected.
        span: where, if it is in a text.
        hint: what to do about it, or empty.
        severity: errors stop, warnings do not.
        found: what stands there; by default the text of the span, its first line.
        expected: what could stand there instead, or empty.
    """

    code: str
    message: str
    span: Span | None = None
    hint: str = ""
    severity: Literal["error", "warning"] = "error"
    found: str = ""
    expected: str = ""

    def __post_init__(self) -> None:
        """Looks up what stands at the place."""
        if not self.found and self.span:
            object.__setattr__(self, "found", self.span.text.split("\n", 1)[0])

    def __str__(self) -> str:
        """The message as a person reads it: place, sentence, excerpt with caret, hint."""
        place = f"{self.span.place}: " if self.span else ""
        lines = [f"{place}{self.severity} [{self.code}]: {self.message}"]
        if self.span:
            lines.append(self.span.excerpt())
        if self.hint:
            lines.append(f"  hint: {self.hint}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """Plain data for `--format json`."""
        where = {"file": self.span.source.name, "line": self.span.line, "column": self.span.column} if self.span else {}
        record = {"code": self.code, "severity": self.severity, "message": self.message}
        return record | {"found": self.found, "expected": self.expected, "hint": self.hint} | where


class MlnError(Exception):
    """The only kind of exception that a user's input can cause. Carries every diagnostic that was found."""

    def __init__(self, diagnostics: Iterable[Diagnostic] | str, hint: str = "") -> None:
        """Takes the diagnostics, or one sentence that has no place in a text."""
        if isinstance(diagnostics, str):
            diagnostics = [Diagnostic("E000", diagnostics, hint=hint)]
        self.diagnostics: tuple[Diagnostic, ...] = tuple(diagnostics)
        super().__init__("\n\n".join(map(str, self.diagnostics)))


class SyntaxMistake(MlnError):
    """The text is not in the language."""


class ModelMistake(MlnError):
    """The text is in the language but does not make a model."""


class EvidenceMistake(MlnError):
    """Facts that do not fit the model or each other."""


class QueryMistake(MlnError):
    """A question that the model has no answer to."""


class Contradiction(MlnError):
    """Hard formulas that no world satisfies together with the evidence."""


class LimitReached(MlnError):
    """An answer within the stated limits of memory, width or time does not exist; says what would help."""


class MissingPart(MlnError):
    """An optional package is needed; names what to install."""


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Diagnostics file by file and in the order of their places; those without a place last."""
    listed = list(diagnostics)
    files = {d.span.source.name: i for i, d in reversed(list(enumerate(listed))) if d.span}
    return sorted(listed, key=lambda d: (files[d.span.source.name], d.span.start) if d.span else (len(listed), 0))


def did_you_mean(word: str, known: Sequence[str]) -> str:
    """A hint with the nearest known words, or an empty text.

    >>> did_you_mean("Smoke", ["Smokes", "Cancer"])
    'did you mean Smokes?'
    """
    near = get_close_matches(word, known, n=2, cutoff=0.6) or [k for k in known if k.lower() == word.lower()]
    return f"did you mean {' or '.join(near)}?" if near else ""
