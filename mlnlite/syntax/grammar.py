"""One statement of text to one node of the tree, by the grammars in `grammars/`. No parser-library type leaves this module."""

from __future__ import annotations

from functools import cache
from typing import Any

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source
from mlnlite.syntax.build import BUILDERS, Place
from mlnlite.syntax.explain import Failure, explain
from mlnlite.syntax.nesting import refuse_deep_nesting
from mlnlite.syntax.tree import Dialect

_STARTS = {
    "standard": ("standard_statement", "standard_formula", "declaration", "type_declaration", "weight"),
    "prac": ("prac_statement", "prac_formula", "declaration", "type_declaration", "weight"),
    "evidence": ("fact", "type_declaration"),
}


@cache
def _parser(language: str) -> Lark:
    file = "evidence.lark" if language == "evidence" else "mln.lark"
    starts = list(_STARTS[language])
    return Lark.open_from_package(
        "mlnlite.grammars", file, start=starts, parser="lalr", propagate_positions=True, maybe_placeholders=False
    )


def parse_node(rule: str, text: str, source: Source, offset: int, dialect: Dialect, *, evidence: bool = False) -> Any:  # noqa: ANN401
    """The node that `rule` makes of `text`, which stands at `offset` of the source.

    Returns:
        What the builder of the rule makes: a formula, a statement, a declaration, an expression, a fact.

    Raises:
        SyntaxMistake: the text does not follow the rule; one diagnostic.
    """
    place = Place(source, offset)
    refuse_deep_nesting(text, place)
    try:
        tree = _parser("evidence" if evidence else dialect).parse(text, start=rule)
    except UnexpectedInput as error:
        at, expected = _where(error, len(text))
        failure = Failure(place, text, at, frozenset(expected), dialect, rule)
        raise SyntaxMistake([explain(failure)]) from None
    return _build(tree, place)


def _where(error: UnexpectedInput, end: int) -> tuple[int, set[str]]:
    state: Any = error.interactive_parser  # type: ignore[attr-defined]
    accepted = set(state.accepts())
    if isinstance(error, UnexpectedToken):
        return (end if error.token.type == "$END" else int(error.token.start_pos or 0)), accepted
    assert isinstance(error, UnexpectedCharacters)
    return error.pos_in_stream or 0, accepted


def _build(tree: Tree[Token], place: Place) -> Any:  # noqa: ANN401
    """Bottom up and without recursion, so that depth costs no stack."""
    built: dict[int, Any] = {}
    for node in tree.iter_subtrees():
        children = [built[id(child)] if isinstance(child, Tree) else child for child in node.children]
        span = place.span(node.meta.start_pos, node.meta.end_pos)
        built[id(node)] = BUILDERS[node.data](place, span, children)
    return built[id(tree)]
