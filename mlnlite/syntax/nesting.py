"""How deeply a statement may be nested: recursion over the tree must never run out of stack."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TypeAlias

from mlnlite.errors import SyntaxMistake
from mlnlite.syntax import raw, tree
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.place import Place

MAX_DEPTH = 200
_HINT = "split the formula into several"
_TOKEN = re.compile(r'"(?:[^"\\\n]|\\[^\n])*"|[()]|!(?!=)|(?i:\b(?:exists?|forall)(?=\s))|[^\s!()"]+')


def refuse_deep_nesting(text: str, place: Place) -> None:
    """Passes a statement whose parentheses, negations and quantifiers are nested at most `MAX_DEPTH` deep.

    Raises:
        SyntaxMistake: it is deeper; points at the first place that is.
    """
    if len(text) <= MAX_DEPTH:
        return
    for start, depth in _depths(text):
        if depth > MAX_DEPTH:
            raise SyntaxMistake([mistake("E116", place.span(start, start + 1), _HINT, limit=MAX_DEPTH)])


def _depths(text: str) -> Iterator[tuple[int, int]]:
    """Depth after each token that opens something. A quantifier may reach to the end of its parentheses."""
    outside: list[int] = []
    level = negations = 0
    for match in _TOKEN.finditer(text):
        token = match[0]
        if token == "!":
            negations += 1
        elif token == "(":
            outside.append(level)
            level, negations = level + negations + 1, 0
        elif token == ")":
            level, negations = outside.pop() if outside else 0, 0
        elif token.lower() in ("exist", "exists", "forall"):
            level, negations = level + negations + 1, 0
        else:
            negations = 0
        yield match.start(), level + negations


def refuse_long_chain(text: str, place: Place) -> None:
    """Passes a statement with at most `MAX_DEPTH` implications, which nest where a language chains them.

    Raises:
        SyntaxMistake: it has more.
    """
    if text.count("=>") > MAX_DEPTH:
        raise SyntaxMistake([mistake("E116", place.span(0, len(text)), _HINT, limit=MAX_DEPTH)])


def refuse_long_expression(weight: tree.WeightExpression | tree.Operation) -> None:
    """Passes a weight, or arithmetic of terms, that is nested at most `MAX_DEPTH` deep, sums and products included.

    Raises:
        SyntaxMistake: it is deeper.
    """
    level: list[_Node] = [weight]
    for _ in range(MAX_DEPTH):
        level = [part for node in level for part in _parts(node)]
        if not level:
            return
    raise SyntaxMistake([mistake("E116", weight.span, "compute it beforehand", limit=MAX_DEPTH)])


_Node: TypeAlias = tree.WeightExpression | tree.TermExpression | raw.Macro | raw.Apply | tree.Hole


def _parts(node: _Node) -> tuple[_Node, ...]:
    match node:
        case tree.Operation():
            return (node.left, node.right)
        case tree.Variable() | tree.Constant() | tree.Hole() | raw.Apply():
            return ()
        case raw.Macro():
            return ()
        case tree.Number() | tree.Size() | tree.NumberOf():
            return ()
        case tree.Call():
            return node.arguments
        case tree.Arithmetic():
            return (node.right,) if node.left is None else (node.left, node.right)
