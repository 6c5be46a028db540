"""Formulas that differ only in constants and weights, gathered into one `FormulaTable`; big files come through here.

A line `weight formula` is cut at its constants. What is left is its key. The first line of each key is parsed by the grammar, and
if the constants found by cutting are constants for the grammar too, all further lines of that key are rows without parsing.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source, Span
from mlnlite.syntax import tree
from mlnlite.syntax.grammar import parse_node
from mlnlite.syntax.walk import constants_of, variables_of, with_holes

# Weight, blanks, formula: of one line, without quotes. A weight is a number or a function of something without blanks.
_WEIGHTED = re.compile(
    r"([-+]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|inf)|(?:logx|logit|log10|log2|log|ln|exp|sqrt)\([-+*/.\d()eE]+\))"
    r"[ \t]+([^\n\"]*[^\n\".\s])"
)
# A subset of what the grammar takes for a constant in an argument place.
_CONSTANT = {
    "standard": re.compile(r"(?<=[(,])[ \t]*(-?[A-Z0-9]\w*(?:[-.]\w+)*)[ \t]*(?=[,)])", re.ASCII),
    "prac": re.compile(r"(?<=[(,])[ \t]*(-?\w+(?:[-.]\w+)*)[ \t]*(?=[,)])"),
}


@dataclass(slots=True)
class Group:
    """Formulas of one shape, in file order.

    Attributes:
        first: the first of them.
        shape: the formula with holes in place of its constants.
        rows: for each formula its constants, one for each hole.
        weights: the weights.
        spans: where the formulas stand.
        unquoted: rows whose constants were read without parsing: none of them was in quotes.
    """

    first: tree.FormulaStatement
    shape: tree.Formula
    rows: list[Sequence[str]] = field(default_factory=list)
    weights: list[tree.WeightExpression] = field(default_factory=list)
    spans: list[Span] = field(default_factory=list)
    unquoted: list[Sequence[str]] = field(default_factory=list)


# How the constants that were cut out fill the holes: a number is one of them, a text stands in the key.
_Filling: TypeAlias = tuple[int | str, ...] | None


@dataclass(slots=True)
class Tables:
    """The formulas gathered so far.

    Attributes:
        dialect: how to read them.
        groups: the groups by shape.
        keys: for each key seen its group and filling (None: the constants as they come), or None if it must be parsed.
        weights: the weights read so far, by text.
    """

    dialect: tree.Dialect
    groups: dict[tree.Formula, Group] = field(default_factory=dict)
    keys: dict[str, tuple[Group, _Filling] | None] = field(default_factory=dict)
    weights: dict[str, tree.WeightExpression] = field(default_factory=dict)


def read_row(tables: Tables, source: Source, text: str, start: int) -> Group | None | bool:
    """Reads one line as a row of a group.

    Returns:
        False if the line must be parsed as a statement, a group if the row is the first of a new group, else None.
    """
    match = _WEIGHTED.fullmatch(text)
    if match is None:
        return False
    parts = _CONSTANT[tables.dialect].split(match[2])
    key = "\0".join(parts[::2])
    try:
        known = tables.keys[key]
    except KeyError:
        return _read_first(tables, source, match, start, key)
    if known is None:
        return False
    weight = _weight(tables, match[1], source, start)
    if weight is None:
        return False
    group, filling = known
    constants = parts[1::2]
    group.unquoted.append(constants)
    group.rows.append(constants if filling is None else [constants[f] if isinstance(f, int) else f for f in filling])
    group.weights.append(weight)
    group.spans.append(Span(source, start, start + len(text)))
    return None


def _weight(tables: Tables, text: str, source: Source, start: int) -> tree.WeightExpression | None:
    weight = tables.weights.get(text)
    if weight is None:
        try:
            weight = parse_node("weight", text, source, start, tables.dialect).value
        except SyntaxMistake:
            return None
        weight = tables.weights[text] = without_spans(weight)
    return weight


def without_spans(weight: tree.WeightExpression) -> tree.WeightExpression:
    """The same weight for another place: rows know where they stand themselves."""
    match weight:
        case tree.Number():
            return replace(weight, span=None)
        case tree.Call():
            return replace(weight, arguments=tuple(map(without_spans, weight.arguments)), span=None)
        case tree.Arithmetic():
            left = None if weight.left is None else without_spans(weight.left)
            return replace(weight, left=left, right=without_spans(weight.right), span=None)


def _read_first(tables: Tables, source: Source, match: re.Match[str], start: int, key: str) -> Group | None | bool:
    """Parses the first line of a key and remembers how further lines are to be read."""
    tables.keys[key] = None
    try:
        statement = parse_node(f"{tables.dialect}_statement", match[0], source, start, tables.dialect)
    except SyntaxMistake:
        return False
    if not can_gather(statement):
        return False
    filling = _filling(statement.formula, [m.span(1) for m in _CONSTANT[tables.dialect].finditer(match[2])], start + match.start(2))
    new = add(tables, statement)
    group = tables.groups[with_holes(statement.formula)]
    if filling is not False:
        tables.keys[key] = group, filling
    group.unquoted.append(group.rows[-1])
    return new


def _filling(formula: tree.Formula, cuts: list[tuple[int, int]], offset: int) -> _Filling | bool:
    """How cut constants fill the holes of a formula; False if a cut is not a constant of it."""
    places = {(start + offset, end + offset): number for number, (start, end) in enumerate(cuts)}
    constants = constants_of(formula)
    filling = tuple(places.pop((c.span.start, c.span.end), c.name) if c.span else c.name for c in constants)
    if places:
        return False
    return None if filling == tuple(range(len(cuts))) else filling


def can_gather(statement: tree.FormulaStatement) -> bool:
    """Whether a formula may become a row: soft, with a weight that may be learnt, and without `+`."""
    if statement.weight is None or statement.fixed or statement.unique:
        return False
    return not any(variable.plus for variable in variables_of(statement.formula))


def add(tables: Tables, statement: tree.FormulaStatement) -> Group | None:
    """Adds a parsed formula to its group; the group, if it is new."""
    assert statement.weight is not None
    assert statement.span is not None
    shape = with_holes(statement.formula)
    known = tables.groups.get(shape)
    group = known or Group(statement, shape)
    group.rows.append([constant.name for constant in constants_of(statement.formula)])
    group.weights.append(statement.weight)
    group.spans.append(statement.span)
    tables.groups[shape] = group
    return None if known else group


def finish(group: Group) -> tree.FormulaStatement | tree.FormulaTable:
    """The statement itself if the group has one row only, else the table."""
    if len(group.rows) == 1:
        return group.first
    shared: dict[str, str] = {}
    columns = tuple(tuple([shared.setdefault(c, c) for c in column]) for column in zip(*group.rows, strict=True))
    return tree.FormulaTable(group.shape, columns, tuple(group.weights), tuple(group.spans), group.spans[0])
