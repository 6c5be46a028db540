"""What formulas mean as trees: precedence, scope, terms, weights."""

from __future__ import annotations

import math

import pytest

from mlnlite.source import Source
from mlnlite.syntax.parse import parse_atom_query, parse_model
from mlnlite.syntax.tree import (
    And,
    Arithmetic,
    Atom,
    Call,
    Constant,
    Equality,
    FormulaStatement,
    Iff,
    Implies,
    Not,
    Number,
    Or,
    Quantified,
    Variable,
)

A, B, C = Atom("A", ()), Atom("B", ()), Atom("C", ())
x, y = Variable("x"), Variable("y")


def standard(text):
    return parse_atom_query(text, "standard")


def prac(text):
    return parse_atom_query(text, "prac")


def statement(text, dialect=None):
    (only,) = parse_model([Source("m.mln", text)], dialect).statements
    return only


def test_or_binds_tighter_in_the_standard_dialect_and_and_in_prac():
    assert standard("A ^ B v C") == And((A, Or((B, C))))
    assert prac("A ^ B v C") == Or((And((A, B)), C))
    assert standard("A v B ^ C") == And((Or((A, B)), C))
    assert prac("A v B ^ C") == Or((A, And((B, C))))


@pytest.mark.parametrize("read", [standard, prac])
def test_precedence_that_both_share(read):
    assert read("!A v B") == Or((Not(A), B))
    assert read("A v B => C") == Implies(Or((A, B)), C)
    assert read("A => B <=> C") == Iff(Implies(A, B), C)
    assert read("!!A") == Not(Not(A))
    assert read("(A ^ B) ^ C") == And((And((A, B)), C))
    assert read("A ^ B ^ C") == And((A, B, C))


@pytest.mark.parametrize("word", ["EXIST", "Exist", "EXISTS", "exists", "exist"])
def test_quantifiers_in_any_case(word):
    assert standard(f"{word} x (P(x))") == Quantified("exist", ("x",), Atom("P", (x,)))
    assert prac(f"{word} ?x (P(?x))") == Quantified("exist", ("x",), Atom("P", (x,)))


def test_scope_of_quantifiers():
    px, qx = Atom("P", (x,)), Atom("Q", (x,))
    assert standard("EXIST x (P(x)) v Q(x)") == Or((Quantified("exist", ("x",), px), qx))
    assert standard("EXIST x P(x) v Q(x)") == Quantified("exist", ("x",), Or((px, qx)))
    assert standard("A ^ FORALL x P(x) => Q(x)") == And((A, Quantified("forall", ("x",), Implies(px, qx))))
    assert standard("(A ^ Forall x P(x)) => B") == Implies(And((A, Quantified("forall", ("x",), px))), B)
    assert standard("EXIST x, y (P(x))") == Quantified("exist", ("x", "y"), px)
    assert prac("EXIST ?x,?y (P(?x))") == Quantified("exist", ("x", "y"), px)


def test_words_that_look_like_keywords():
    assert standard("v(x) v v(y)") == Or((Atom("v", (x,)), Atom("v", (y,))))
    assert standard("P(v) v v = x") == Or((Atom("P", (Variable("v"),)), Equality(Variable("v"), x)))
    assert standard("Exists(x)") == Atom("Exists", (x,))
    assert standard("log(x) ^ Q") == And((Atom("log", (x,)), Atom("Q", ())))
    assert statement("2 log(x) ^ log(3)").formula == And((Atom("log", (x,)), Atom("log", (Constant("3"),))))


def test_standard_terms():
    formula = standard('P(x, Anna, 3-2, -1, "any text", +y, 42, B2, Glass.n.06)')
    names = ["Anna", "3-2", "-1", "any text"]
    more = [Constant(n) for n in ("42", "B2", "Glass.n.06")]
    assert formula.arguments == (x, *map(Constant, names), Variable("y", True), *more)


def test_prac_terms():
    formula = prac('P(?x, anna, 3-2, -1, "a \\"b\\" \\\\ c", +?y, to_pour, Über, it\'s, glass.n.06, a:b)')
    names = ["anna", "3-2", "-1", 'a "b" \\ c']
    more = [Constant(n) for n in ("to_pour", "Über", "it's", "glass.n.06", "a:b")]
    assert formula.arguments == (x, *map(Constant, names), Variable("y", True), *more)


def test_equality():
    assert standard("x = y") == Equality(x, y)
    assert standard("x != y") == standard("x =/= y") == standard("!(x = y)") == Not(Equality(x, y))
    assert prac("?x=/=?y") == prac("?x!=?y") == Not(Equality(x, y))
    assert standard('"3" = x') == Equality(Constant("3"), x)
    assert standard("(+x = y)") == Equality(Variable("x", True), y)


@pytest.mark.parametrize(
    ("text", "value"),
    [("1", 1), ("-0.5", -0.5), (".5", 0.5), ("1e-3", 0.001), ("2.5E0", 2.5), ("inf", math.inf), ("+2", 2), ("5.", 5)],
)
def test_numbers(text, value):
    assert statement(f"{text} P(x)") == FormulaStatement(Atom("P", (x,)), Number(value))
    assert statement(f"{text}\tP(x)").weight == Number(value)


def test_weight_expressions():
    two, three = Number(2), Number(3)
    assert statement("2+3*2 A").weight == Arithmetic("+", two, Arithmetic("*", three, two))
    assert statement("(2 + 3) * 2 A").weight == Arithmetic("*", Arithmetic("+", two, three), two)
    assert statement("2^3^2 A").weight == Arithmetic("^", two, Arithmetic("^", three, two))
    assert statement("-2^3 A").weight == Arithmetic("-", None, Arithmetic("^", two, three))
    assert statement("2 - -3 A").weight == Arithmetic("-", two, Number(-3))
    assert statement("logx(0.9) A").weight == Call("logx", (Number(0.9),))
    assert statement("log(2/3) + 1 (A)").weight == Arithmetic(
        "+", Call("log", (Arithmetic("/", two, three),)), Number(1)
    )


def test_hard_soft_fixed_and_unweighted():
    assert statement("A v B.") == FormulaStatement(Or((A, B)), None, hard=True)
    assert statement("A v B") == FormulaStatement(Or((A, B)), None)
    assert statement("@5 A") == FormulaStatement(A, Number(5), fixed=True)
    assert statement("#fixweight\n5 A") == FormulaStatement(A, Number(5), fixed=True)
    unique = statement("#unique{+?a,+?b}\n0 P(+?a) ^ P(+?b)")
    assert unique.unique == (("a", "b"),)
    assert statement("x = 3-2.").formula == Equality(x, Constant("3-2"))


def test_spans_point_into_the_source():
    formula = statement("\n 1.5  P(x, Anna) =>\n  Q(x)").formula
    assert formula.span.place == "m.mln:2:7"
    assert formula.body.arguments[1].span.text == "Anna"
    assert formula.head.span.text == "Q(x)"
