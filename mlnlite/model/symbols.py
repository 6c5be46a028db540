"""Types with their constants, and predicates: the vocabulary of a model."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from mlnlite.source import Span
from mlnlite.syntax.tree import Comparison


@dataclass(frozen=True)
class Type:
    """A type and its constants. A constant's id is its place in `constants`."""

    name: str
    constants: tuple[str, ...] = ()

    @cached_property
    def index(self) -> dict[str, int]:
        """Id of each constant."""
        return {constant: i for i, constant in enumerate(self.constants)}

    def extended(self, constants: list[str]) -> Type:
        """This type with new constants after the old ones, whose ids stay."""
        new = [c for c in dict.fromkeys(constants) if c not in self.index]
        return Type(self.name, self.constants + tuple(new)) if new else self


@dataclass(frozen=True, slots=True)
class Predicate:
    """A relation over types.

    Attributes:
        name: its name.
        types: the type of each argument.
        value: index of the argument marked `!` or `?`, whose values exclude each other; None if there is none.
        marker: `!` exactly one value, `?` at most one, empty if `value` is None.
        closed: what is not a fact is false.
        span: where it was declared.
        comparison: of the predicates that stand for comparisons of numbers, the comparison, with variables `x0`, `x1`,
            ... for the arguments. Their facts follow from the constants.
    """

    name: str
    types: tuple[str, ...]
    value: int | None = None
    marker: Literal["", "!", "?"] = ""
    closed: bool = False
    span: Span | None = field(default=None, compare=False, repr=False)
    comparison: Comparison | None = None

    @property
    def arity(self) -> int:
        """Number of arguments."""
        return len(self.types)

    @property
    def keys(self) -> tuple[int, ...]:
        """Indices of the arguments that name a block: all but `value`."""
        return tuple(i for i in range(self.arity) if i != self.value)

    def __str__(self) -> str:
        """The declaration as it is written.

        >>> str(Predicate("age", ("person", "years"), value=1, marker="!"))
        'age(person, years!)'
        """
        if self.comparison:
            return self.name
        marks = [t + (self.marker if i == self.value else "") for i, t in enumerate(self.types)]
        inside = f"({', '.join(marks)})" if marks else ""
        return f"{'*' if self.closed else ''}{self.name}{inside}"
