"""What a user asks for: a predicate, a ground atom or any formula, several of them separated by commas."""

from __future__ import annotations

import re
from collections.abc import Iterator

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source, Span
from mlnlite.syntax.grammar import parse_node
from mlnlite.syntax.lower import without_functions
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.place import Place
from mlnlite.syntax.tree import Dialect, Formula

_PART = re.compile(r'"(?:[^"\\\n]|\\[^\n])*"|[(),]|[^(),"]+|"')
_QUANTIFIER_LIST = re.compile(r"(?i:\b(?:exists?|forall))\s+\??[\w']+(?:\s*,\s*\??[\w']+)*\s*$")


def parse_atom_query(text: str, dialect: Dialect) -> Formula:
    """The formula of one item of a query; the name of a predicate alone becomes an atom without arguments.

    Raises:
        SyntaxMistake: it is neither.

    >>> parse_atom_query("Smokes(Ann)", "standard").predicate
    'Smokes'
    """
    source = Source("<query>", text)
    if not text.strip():
        raise SyntaxMistake([mistake("E150", None, "name a predicate, an atom such as `Smokes(Ann)`, or a formula")])
    start = len(text) - len(text.lstrip())
    formula = parse_node(f"{dialect}_formula", text.strip(), Place(source, start), dialect)
    return without_functions(formula, hard=False)


def split_queries(text: str) -> list[str]:
    """The items of a comma-separated list.

    A comma inside parentheses, quotes or a list of quantified variables does not split.

    Raises:
        SyntaxMistake: an item is empty.

    >>> split_queries("Smokes, Friends(Ann, Bob), EXIST x, y (Friends(x, y))")
    ['Smokes', 'Friends(Ann, Bob)', 'EXIST x, y (Friends(x, y))']
    """
    items = []
    source = Source("<query>", text)
    for start, end in _items(text):
        item = text[start:end].strip()
        if not item:
            span = Span(source, min(start, max(0, len(text) - 1)), end)
            raise SyntaxMistake([mistake("E150", span, "separate the items by one comma each")])
        items.append(item)
    return items


def _items(text: str) -> Iterator[tuple[int, int]]:
    start = depth = 0
    for match in _PART.finditer(text):
        depth += (match[0] == "(") - (match[0] == ")")
        if match[0] == "," and depth <= 0 and not _QUANTIFIER_LIST.search(text, start, match.start()):
            yield start, match.start()
            start = match.end()
    yield start, len(text)
