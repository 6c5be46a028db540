"""Nodes that exist while a statement is read, and never in a tree: `lower` replaces them by formulas that mean them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mlnlite.source import Span


@dataclass(frozen=True, slots=True)
class Both:
    """`*P(x)`: the formula stands twice, with `P(x)` and with `!P(x)`."""

    atom: Any
    span: Span


@dataclass(frozen=True, slots=True)
class Group:
    """`p|q(x)`: the formula stands once for each of the predicates."""

    predicates: tuple[str, ...]
    arguments: tuple[Any, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Apply:
    """`f(x)` as a term: the value of a function."""

    function: str
    arguments: tuple[Any, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Rule:
    """`head :- body`."""

    head: Any
    body: Any
    span: Span


@dataclass(frozen=True, slots=True)
class Function:
    """`person motherOf(person)`: declares a function."""

    name: str
    arguments: tuple[Any, ...]
    value: str
    span: Span


@dataclass(frozen=True, slots=True)
class Macro:
    """`$w` in a weight."""

    name: str
    span: Span


@dataclass(frozen=True, slots=True)
class Definition:
    """`$w = 0.5`."""

    name: str
    value: Any
    span: Span
