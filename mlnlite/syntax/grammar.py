"""One statement of text to one node of the tree, by the grammars in `grammars/`.

No type of the parser library leaves this module. It is imported when the first statement is parsed: that takes as long
as all else that a short command does.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from mlnlite.errors import SyntaxMistake
from mlnlite.syntax.build import BUILDERS
from mlnlite.syntax.explain import Failure, explain
from mlnlite.syntax.nesting import refuse_deep_nesting
from mlnlite.syntax.place import Language, Place

if TYPE_CHECKING:
    from lark import Lark, Token, Tree
    from lark.exceptions import UnexpectedInput

_STARTS: dict[Language, tuple[str, ...]] = {
    "standard": ("standard_statement", "standard_formula", "declaration", "type_declaration", "weight"),
    "prac": ("prac_statement", "prac_formula", "declaration", "type_declaration", "weight"),
    "evidence": ("fact", "value", "type_declaration"),
}


@cache
def _parser(language: Language) -> Lark:
    from lark import Lark

    return Lark.open_from_package(
        "mlnlite.grammars",
        "evidence.lark" if language == "evidence" else "mln.lark",
        start=list(_STARTS[language]),
        parser="lalr",
        propagate_positions=True,
        maybe_placeholders=False,
    )


def parse_node(rule: str, text: str, place: Place, language: Language) -> Any:  # noqa: ANN401
    """The node that `rule` of a language makes of `text`, which stands at `place`.

    Returns:
        What the builder of the rule makes: a formula, a statement, a declaration, an expression, a fact.

    Raises:
        SyntaxMistake: the text does not follow the rule; one diagnostic.
    """
    from lark.exceptions import UnexpectedInput

    refuse_deep_nesting(text, place)
    try:
        tree = _parser(language).parse(text, start=rule)
    except UnexpectedInput as error:
        at, expected = _where(error, len(text))
        raise SyntaxMistake([explain(Failure(place, text, at, frozenset(expected), language, rule))]) from None
    return _build(tree, place)


def _where(error: UnexpectedInput, end: int) -> tuple[int, set[str]]:
    from lark.exceptions import UnexpectedCharacters, UnexpectedToken

    state: Any = error.interactive_parser
    accepted = set(state.accepts()) or {"$END"}
    if isinstance(error, UnexpectedToken):
        return (end if error.token.type == "$END" else int(error.token.start_pos or 0)), accepted
    assert isinstance(error, UnexpectedCharacters)
    return error.pos_in_stream or 0, accepted


def _build(tree: Tree[Token], place: Place) -> Any:  # noqa: ANN401
    """Bottom up and without recursion, so that depth costs no stack."""
    from lark import Tree

    built: dict[int, Any] = {}
    for node in tree.iter_subtrees():
        children = [built[id(child)] if isinstance(child, Tree) else child for child in node.children]
        span = place.span(node.meta.start_pos, node.meta.end_pos)
        built[id(node)] = BUILDERS[node.data](place, span, children)
    return built[id(tree)]
