"""Whatever the text, reading it gives a tree or a `SyntaxMistake` with places, never anything else."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.messages import MESSAGES
from mlnlite.syntax.parse import parse_model
from mlnlite.syntax.queries import parse_atom_query, split_queries

WORDS = r"""
P( Smokes( x y ?x +x +?x Anna "a " , ) ( ! ^ v => <=> = != =/= . 0.5 -1 1e-3 inf @ @5 * + - / | & -> :- < > ~ not
EXIST FORALL exists person = {A, } { #unique{+a} #fixweight #group #include #x // /* */ --- ---- ?P log( logx(0.5)
$w domSize( count( and ¬ ∧ ' ; ... \ "a.b"
"""
PIECES = [*re.findall(r"\S+", WORDS), "\u00a0", '"any text"']

texts = st.lists(st.sampled_from(PIECES) | st.sampled_from([" ", "\n"]), max_size=15).map(" ".join) | st.text(
    max_size=20
)


@pytest.mark.parametrize("dialect", ["standard", "prac", None])
@settings(max_examples=120, deadline=None)
@given(text=texts)
def test_model(dialect, text):
    check(lambda: parse_model([Source("m.mln", text)], dialect), text)


@settings(max_examples=120, deadline=None)
@given(text=texts)
def test_evidence(text):
    check(lambda: parse_evidence(Source("e.db", text)), text)


@settings(max_examples=60, deadline=None)
@given(text=texts)
def test_query(text):
    check(lambda: [parse_atom_query(item, "prac") for item in split_queries(text)], text)


def check(read, text):
    try:
        read()
    except SyntaxMistake as error:
        for diagnostic in error.diagnostics:
            assert diagnostic.code in MESSAGES
            assert diagnostic.span is None or diagnostic.span.start <= len(text)
            assert "None" not in str(diagnostic).replace(text, "")


@pytest.mark.parametrize("dialect", ["standard", "prac"])
@pytest.mark.parametrize(
    "text",
    [
        "1 " + "(" * 5000 + "P(A)" + ")" * 5000,
        "1 " + "!" * 5000 + "P(A)",
        "1 " + "(" * 5000,
        "1 " + "EXIST x " * 3000 + "P(A)",
        "1" + "+1" * 5000 + " P(A)",
        "1" + "^2" * 5000 + " P(A)",
        "-" * 5000 + "1 P(A)",
        "1 " + "!(" * 5000 + "P(A)" + ")" * 5000,
    ],
    ids=lambda text: text[:12],
)
def test_deep_nesting_is_refused(text, dialect):
    with pytest.raises(SyntaxMistake) as caught:
        parse_model([Source("m.mln", text)], dialect)
    assert [d.code for d in caught.value.diagnostics] in (["E116"], ["E101"])


@pytest.mark.parametrize("sign", ["^", "v"])
def test_long_formulas_are_not_deep(sign):
    text = "1 " + f" {sign} ".join(["P(A)"] * 3000)
    (statement,) = parse_model([Source("m.mln", text)]).statements
    assert len(statement.formula.operands) == 3000


def test_200_levels_are_read():
    text = "1 " + "!(" * 99 + "P(A)" + ")" * 99
    (statement,) = parse_model([Source("m.mln", text)]).statements
    depth, formula = 0, statement.formula
    while hasattr(formula, "operand"):
        depth, formula = depth + 1, formula.operand
    assert depth == 99


def test_many_mistakes_stop_the_reading():
    with pytest.raises(SyntaxMistake) as caught:
        parse_model([Source("m.mln", "1 P(\n" * 5000)])
    assert len(caught.value.diagnostics) == 101
    assert caught.value.diagnostics[-1].code == "E199"
    with pytest.raises(SyntaxMistake) as caught:
        parse_evidence(Source("e.db", "P(\n" * 5000))
    assert len(caught.value.diagnostics) == 101
