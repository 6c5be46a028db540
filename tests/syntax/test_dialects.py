"""Which language a text is taken for, and what is the same in it and in the text that `convert` writes."""

from __future__ import annotations

import pytest

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source
from mlnlite.syntax.layout import formatted
from mlnlite.syntax.parse import parse_model
from mlnlite.syntax.write import write_model

EXAMPLES = {
    "prac": "P(t)\nQ(t)\n1 P(?x) ^ Q(?x)\n#unique{+?a,+?b}\n1 P(+?a) ^ Q(+?b)\n1 P|Q(?x)\n",
    "alchemy": (
        'person = {Ann, "B C"}\ntime = {1,...,3}\nperson motherOf(person)\nP(person)\nAt(person, time!)\nRain\n'
        "1.5 P(motherOf(x)) => P(x)\n1 *P(x) ^ Rain\nEXIST x,y motherOf(x) = y ^ P(y).\n"
        "1 At(x, t) ^ t < 3 => At(x, t + 1)\n2 At(x, +t)\n1 P(x) => Rain => P(x)\n1 At(x, t) v At(x, succ(t))\n"
    ),
    "tuffy": (
        "*wrote(person, paper)\n*year(paper, int_)\ncat(paper, label!)\nrel(paper p, paper q)\n"
        "1 wrote(x, p), wrote(x, q), cat(p, c) => cat(q, c)\nrel(p, q) :- wrote(x, p), wrote(x, q), p != q.\n"
        "@2 !cat(p, A) v rel(p, p)\n0.5 year(p, a), year(q, b), a + 1 <= b => !rel(p, q)\n"
        '1 cat(p, c), [c <> "A" AND p = q] => rel(p, q)\nEXIST c cat(p, c).\n'
    ),
    "rockit": '*conf(thing, float_)\nred(thing)\nc: !conf(X, c) v red(X)\n|x| red(x) >= 1\n1.5 red("Ann")\n',
    "lomrf": (
        "HappensAt(event, time)\nInit(fluent, time)\nHolds(fluent, time)\nfluent start(event)\n"
        "Init(f, t) :- HappensAt(e, t) ^ f = start(e)\n1.5 Holds(f, t) ^ Init(f, t) => Holds(f, t++)\n"
    ),
    "standard": (
        "P(t)\nt = {1, ..., 3}\n1 P(x) ^ x < 2\ncount(P(x) | x) <= 2.\n"
        "p=0.8: P(x) => P(x)\n@test query P(1) = 0.5 +- 0.1\n"
    ),
}


@pytest.mark.parametrize("dialect", EXAMPLES)
def test_found_out_and_forced(dialect):
    found = parse_model([Source("m.mln", EXAMPLES[dialect])])
    assert found.origin.dialect == dialect
    assert found.origin.reasons
    forced = parse_model([Source("m.mln", EXAMPLES[dialect])], dialect)
    assert forced == found
    assert forced.origin.reasons == ()


@pytest.mark.parametrize("dialect", EXAMPLES)
def test_written_in_our_dialect_it_is_the_same(dialect):
    program = parse_model([Source("m.mln", EXAMPLES[dialect])])
    again = parse_model([Source("again.mln", write_model(program))], program.dialect)
    assert again == program


@pytest.mark.parametrize("dialect", EXAMPLES)
def test_style_keeps_the_tree(dialect):
    text = EXAMPLES[dialect]
    new = formatted(text)
    assert formatted(new) == new
    assert parse_model([Source("m.mln", new)], dialect) == parse_model([Source("m.mln", text)], dialect)


def test_style_keeps_comments():
    text = "P( t )// a\n/* b\n   c */\n\n\n\n1   P(x)  ^P(y)  =>\n  P( z ) /* d */\n"
    assert formatted(text) == "P(t)  // a\n/* b\n   c */\n\n1 P(x) ^ P(y) =>\n    P(z) /* d */\n"


def test_variables_of_rockit_may_start_upper_case():
    (statement,) = parse_model([Source("m.mln", 'r(t)\n1 r(X) v r("X")')], "rockit").statements[1:]
    left, right = statement.formula.operands
    assert (type(left.arguments[0]).__name__, type(right.arguments[0]).__name__) == ("Variable", "Constant")


def test_comma_is_no_conjunction_in_alchemy():
    with pytest.raises(SyntaxMistake, match="conjunction is written"):
        parse_model([Source("m.mln", "P(t)\n1 P(x), P(y) => P(x)")], "alchemy")


def test_no_chain_of_implications_outside_alchemy():
    with pytest.raises(SyntaxMistake, match="E106"):
        parse_model([Source("m.mln", "P(t)\n1 P(x) => P(y) => P(x)")], "lomrf")


@pytest.mark.parametrize(
    ("dialect", "text", "code"),
    [
        ("alchemy", 'P(t)\n#include "f.cpp"\n1 P(x)', "E110"),
        ("alchemy", "t = {a, b}\nP(t)\n1 P(a)", "E120"),
        ("tuffy", "P(t)\nQ(t)\nP(x) :- Q(x).\nQ(x) :- P(x).", "E110"),
    ],
)
def test_not_read_as_something_else(dialect, text, code):
    with pytest.raises(SyntaxMistake) as caught:
        parse_model([Source("m.mln", text)], dialect)
    assert {d.code for d in caught.value.diagnostics} == {code}


def test_lines_of_pracmln_without_meaning():
    program = parse_model([Source("m.mln", "P(t)\n#AdaptiveMLNDependency:P:t\n#group\n1 P(?x)\n")])
    assert len(program.statements) == 2
