"""Formulas that differ only in constants and weights, gathered into one `FormulaTable`; big files come through here.

A line `weight formula` is cut at its constants. What is left is its key. The first line of each key is parsed by the
grammar; if what was cut out are constants for the grammar too, all further lines of that key are rows without parsing.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias, assert_never

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Span
from mlnlite.syntax import tree
from mlnlite.syntax.grammar import parse_node
from mlnlite.syntax.lower import statements_of
from mlnlite.syntax.place import Place
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


# How the constants that were cut out fill the holes: a number is one of them, a text stands in the key itself.
_Filling: TypeAlias = tuple[int | str, ...] | None


@dataclass(slots=True)
class Gathering:
    """The statements of a program under construction.

    Attributes:
        dialect: how to read them.
        items: the statements so far; a group stands where its first formula stood.
        groups: the groups by shape.
        keys: for each key seen its group and filling (None: the constants as they come), or None if it must be parsed.
        weights: the weights read so far that are more than a number, by text.
    """

    dialect: tree.Dialect
    items: list[tree.Statement | Group] = field(default_factory=list)
    groups: dict[tree.Formula, Group] = field(default_factory=dict)
    keys: dict[str, tuple[Group, _Filling] | None] = field(default_factory=dict)
    weights: dict[str, tree.WeightExpression] = field(default_factory=dict)


def read_row(gathering: Gathering, text: str, place: Place) -> bool:
    """Adds the line `text`, which stands at `place`, to its group; False if it must be parsed as a statement."""
    match = _WEIGHTED.fullmatch(text)
    if match is None:
        return False
    parts = _CONSTANT[gathering.dialect].split(match[2])
    key = "\0".join(parts[::2])
    if key not in gathering.keys:
        return _read_first(gathering, match, place, key)
    known = gathering.keys[key]
    weight = known and _weight(gathering, match[1], place)
    if not (known and weight):
        return False
    group, filling = known
    constants = parts[1::2]
    group.unquoted.append(constants)
    group.rows.append(constants if filling is None else [f if isinstance(f, str) else constants[f] for f in filling])
    group.weights.append(weight)
    group.spans.append(place.span(0, len(text)))
    return True


def _weight(gathering: Gathering, text: str, place: Place) -> tree.WeightExpression | None:
    if text[-1].isdigit():
        value = float(text)
        return None if math.isinf(value) else tree.Number(value)
    weight = gathering.weights.get(text)
    if weight is None:
        try:
            weight = _without_spans(parse_node("weight", text, place, gathering.dialect).value)
        except SyntaxMistake:
            return None
        gathering.weights[text] = weight
    return weight


def _without_spans(weight: tree.WeightExpression) -> tree.WeightExpression:
    """The same weight for another place: rows know where they stand themselves."""
    match weight:
        case tree.Number() | tree.Size() | tree.NumberOf():
            return replace(weight, span=None)
        case tree.Call():
            return replace(weight, arguments=tuple(map(_without_spans, weight.arguments)), span=None)
        case tree.Arithmetic():
            left = None if weight.left is None else _without_spans(weight.left)
            return replace(weight, left=left, right=_without_spans(weight.right), span=None)
    assert_never(weight)


def _read_first(gathering: Gathering, match: re.Match[str], place: Place, key: str) -> bool:
    """Parses the first line of a key and remembers how further lines are to be read."""
    gathering.keys[key] = None
    try:
        statement = parse_node(f"{gathering.dialect}_statement", match[0], place, gathering.dialect)
        plain = [statement] == statements_of(statement)
    except SyntaxMistake:
        return False
    if not (plain and can_gather(statement)):
        return False
    cuts = [cut.span(1) for cut in _CONSTANT[gathering.dialect].finditer(match[2])]
    group = add(gathering, statement)
    group.unquoted.append(group.rows[-1])
    holes = _places(statement.formula, cuts, place.offset + match.start(2))
    if holes is not None:
        gathering.keys[key] = group, None if holes == list(range(len(cuts))) else tuple(holes)
    return True


def _places(formula: tree.Formula, cuts: list[tuple[int, int]], offset: int) -> list[int | str] | None:
    """For each constant of a formula the number of its cut, or itself; None if a cut is not a constant."""
    numbers = {(start + offset, end + offset): number for number, (start, end) in enumerate(cuts)}
    constants = constants_of(formula)
    places = [numbers.pop((c.span.start, c.span.end), c.name) if c.span else c.name for c in constants]
    return None if numbers else places


def can_gather(statement: tree.FormulaStatement) -> bool:
    """Whether a formula may become a row: soft, with a weight that may be learnt, and without `+`."""
    if statement.weight is None or statement.fixed or statement.unique:
        return False
    if statement.weight.span is not None and statement.weight.span.text[-1:] == ":":
        return False  # `p=0.8:` and `x:`
    return not any(variable.plus for variable in variables_of(statement.formula))


def add(gathering: Gathering, statement: tree.FormulaStatement) -> Group:
    """Adds a parsed formula to its group, which may be new."""
    assert statement.weight is not None
    assert statement.span is not None
    shape = with_holes(statement.formula)
    group = gathering.groups.get(shape)
    if group is None:
        group = gathering.groups[shape] = Group(statement, shape)
        gathering.items.append(group)
    group.rows.append([constant.name for constant in constants_of(statement.formula)])
    group.weights.append(statement.weight)
    group.spans.append(statement.span)
    return group


def finish(gathering: Gathering) -> tuple[tree.Statement, ...]:
    """The statements; a group with one row only is the formula it came from, any other a table."""
    return tuple(_table(item) if isinstance(item, Group) else item for item in gathering.items)


def _table(group: Group) -> tree.FormulaStatement | tree.FormulaTable:
    if len(group.rows) == 1:
        return group.first
    shared: dict[str, str] = {}
    columns = tuple(tuple([shared.setdefault(c, c) for c in column]) for column in zip(*group.rows, strict=True))
    return tree.FormulaTable(group.shape, columns, tuple(group.weights), tuple(group.spans), group.spans[0])
