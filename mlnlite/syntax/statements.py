"""One statement: is it a type declaration, a predicate declaration or a formula, and which."""

from __future__ import annotations

import re
from collections.abc import Mapping

from mlnlite.syntax import tree
from mlnlite.syntax.grammar import parse_node
from mlnlite.syntax.place import Place

_TYPE = re.compile(r"[^\W\d][\w'-]*\s*=\s*\{")
# An atom whose arguments are plain words, with or without markers: a declaration or a formula without weight.
_PLAIN_ATOM = re.compile(
    r"([^\W\d][\w'-]*)\s*(?:\(\s*([^\W\d][\w'-]*\s*[!?]?(?:\s*,\s*[^\W\d][\w'-]*\s*[!?]?)*)\s*\))?"
)
# Marks that only a declaration has: a star in front, `!` or `?` after an argument.
_DECLARATION_MARK = re.compile(r"\*\s*\w|[^\W\d][\w'-]*\s*\([^()]*[\w']\s*[!?]\s*[!?,)]")


def read_statement(
    text: str, place: Place, dialect: tree.Dialect, declared: Mapping[str, tree.PredicateDeclaration]
) -> tree.TypeDeclaration | tree.PredicateDeclaration | tree.FormulaStatement:
    """The statement `text`, which stands at `place`.

    A bare atom with plain words as arguments declares its predicate the first time, and again if it is the same; after
    that `P(x)` with other words is a formula without weight.

    Raises:
        SyntaxMistake: it is no statement of the dialect.
    """
    rule = f"{dialect}_statement"
    if _TYPE.match(text):
        rule = "type_declaration"
    elif _DECLARATION_MARK.match(text) or declares(text, declared):
        rule = "declaration"
    node: tree.TypeDeclaration | tree.PredicateDeclaration | tree.FormulaStatement
    node = parse_node(rule, text, place, dialect)
    return node


def declares(text: str, declared: Mapping[str, tree.PredicateDeclaration]) -> bool:
    """Whether a statement without weight, dot and marks is a declaration after those in `declared`."""
    match = _PLAIN_ATOM.fullmatch(text)
    if match is None:
        return False
    known = declared.get(match[1])
    if known is None:
        return True
    words = tuple(re.sub(r"\s", "", word) for word in match[2].split(",")) if match[2] else ()
    return words == tuple(argument.type + argument.marker for argument in known.arguments)
