"""Types with plain constants are read as the grammar reads them, without it."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source
from mlnlite.syntax import grammar
from mlnlite.syntax.grammar import parse_node
from mlnlite.syntax.place import Place

words = st.sampled_from(
    ["Anna", "x1", "42", "été", "_a", "v", "inf", "EXIST", "-3", "3-2", '"a b"', "glass.n.06", "...", ""]
)


@settings(max_examples=300, deadline=None)
@given(st.lists(words, max_size=5), st.sampled_from([",", " , ", ",\n "]), st.sampled_from(["p", "p'", "a_b", "5"]))
@pytest.mark.parametrize("language", ["standard", "prac", "evidence"])
def test_the_same_as_by_the_grammar(language, names, comma, type_name):
    text = f"{type_name} = {{{comma.join(names)}}}"
    place = Place(Source("types.mln", "\n" + text), 1)

    def read():
        try:
            node = parse_node("type_declaration", text, place, language)
        except SyntaxMistake as mistake:
            return str(mistake)
        return node.name, node.constants, node.span, [c.span for c in node.constants]

    quickly, usual = read(), grammar._PLAIN_TYPE
    grammar._PLAIN_TYPE = re.compile("(?!)")
    try:
        assert quickly == read()
    finally:
        grammar._PLAIN_TYPE = usual
