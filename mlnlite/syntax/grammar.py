"""One statement of text to one node of the tree, by the grammars in `grammars/`.

No type of the parser library leaves this module. It is imported when the first statement is parsed: that takes as long
as all else that a short command does.
"""

from __future__ import annotations

import os
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mlnlite.errors import SyntaxMistake
from mlnlite.syntax.build import BUILDERS
from mlnlite.syntax.build_foreign import FOREIGN_BUILDERS
from mlnlite.syntax.explain import Failure, explain
from mlnlite.syntax.nesting import refuse_deep_nesting
from mlnlite.syntax.place import Language, Place
from mlnlite.syntax.tree import Constant, TypeDeclaration

if TYPE_CHECKING:
    from lark import Lark, Token, Tree
    from lark.exceptions import UnexpectedInput

_OURS = ("declaration", "type_declaration", "weight", "macro_definition")
_FOREIGN = ("statement", "formula", "declaration", "type_declaration", "function")
_STARTS: dict[Language, tuple[str, ...]] = {
    "standard": ("standard_statement", "standard_formula", *_OURS),
    "prac": ("prac_statement", "prac_formula", *_OURS),
    "alchemy": _FOREIGN,
    "tuffy": _FOREIGN,
    "rockit": _FOREIGN,
    "lomrf": _FOREIGN,
    "evidence": ("fact", "value", "type_declaration"),
}


_FILES = {"standard": "mln.lark", "prac": "mln.lark", "evidence": "evidence.lark"}


_PLAIN_TYPE = re.compile(r"\s*([^\W\d]\w*)\s*=\s*\{((?:\s*\w+\s*,)*\s*\w+\s*)(\})\s*")
_PLAIN_WORD = re.compile(r"\w+")


@cache
def _parser(language: Language) -> Lark:
    from lark import Lark

    return Lark.open_from_package(
        "mlnlite.grammars",
        _FILES.get(language, "foreign.lark"),
        start=list(_STARTS[language]),
        parser="lalr",
        propagate_positions=True,
        maybe_placeholders=False,
        cache=_tables(language),
    )


def _tables(language: Language) -> str | bool:
    """The file that keeps the tables of a grammar for the next command, or False; the library checks that it fits."""
    try:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mlnlite"
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # no home, or none to write to
        return False
    return str(folder / f"{language}.tables")


def parse_node(rule: str, text: str, place: Place, language: Language) -> Any:  # noqa: ANN401
    """The node that `rule` of a language makes of `text`, which stands at `place`.

    Returns:
        What the builder of the rule makes: a formula, a statement, a declaration, an expression, a fact.

    Raises:
        SyntaxMistake: the text does not follow the rule; one diagnostic.
    """
    from lark.exceptions import UnexpectedInput

    plain = _PLAIN_TYPE.fullmatch(text) if rule == "type_declaration" and language in _FILES else None
    if plain is not None:
        return _plain_type(plain, place)
    refuse_deep_nesting(text, place)
    try:
        tree = _parser(language).parse(text, start=rule)
    except UnexpectedInput as error:
        at, expected = _where(error, len(text))
        raise SyntaxMistake([explain(Failure(place, text, at, frozenset(expected), language, rule))]) from None
    return _build(tree, replace(place, language=language))


def _plain_type(match: re.Match[str], place: Place) -> TypeDeclaration:
    """A type whose constants are plain words, which may be very many: the same as the grammar makes of it."""
    begin, end = match.span(2)
    words = _PLAIN_WORD.finditer(match.string, begin, end)
    constants = tuple(Constant(word[0], place.span(word.start(), word.end())) for word in words)
    return TypeDeclaration(match[1], constants, place.span(match.start(1), match.end(3)))


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

    builders = BUILDERS if place.language in _FILES else BUILDERS | FOREIGN_BUILDERS
    built: dict[int, Any] = {}
    for node in tree.iter_subtrees():
        children = [built[id(child)] if isinstance(child, Tree) else child for child in node.children]
        span = place.span(node.meta.start_pos, node.meta.end_pos)
        built[id(node)] = builders[node.data](place, span, children)
    return built[id(tree)]
