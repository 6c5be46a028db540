"""What comparisons, counts, functions and other languages' constructs mean, against enumeration."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import mlnlite as ml
from tests import brute

NUMBERS = "time = {1, ..., 4}\nP(time)\nQ(time)\n0.3 P(t)\n-0.2 Q(t)\n"


def named(evidence, atom):
    types = evidence.predicates[atom[0]].types
    constants = [evidence.types[t].constants[a] for t, a in zip(types, atom[1], strict=True)]
    return f"{atom[0]}({', '.join(constants)})" if constants else atom[0]


def agrees(model, facts=""):
    """Marginals of all open atoms and the weight of the best world, as enumeration says."""
    evidence = ml.evidence_from_text(facts, model=model)
    expanded = ml.ground(model, evidence).model
    expected = brute.marginals(expanded, evidence)
    answer = ml.marginal(model, evidence)
    names = {named(evidence, a): p for a, p in expected.items() if not evidence.predicates[a[0]].comparison}
    for name in answer.names:
        assert answer[name] == pytest.approx(names[name], abs=1e-9)
    return {name: p for name, p in names.items() if name in set(answer.names)}


@pytest.mark.parametrize(
    "formula",
    [
        "1.5 P(t) ^ t < 3 => Q(t)",
        "1.5 P(t) ^ Q(u) ^ t + 1 = u",
        "1.5 P(t) => Q(t + 1)",
        "P(t) => Q(t + 1).",
        "1.5 P(t) ^ Q(u) ^ t * 2 >= u + 1",
        "1.5 P(t) ^ !(t % 2 = 1)",
        "1.5 EXIST t (P(t) ^ Q(t + 2))",
        "1.5 FORALL t (P(t) => Q(t + 1))",
        "1.5 P(+t) ^ t != 2",
        "1.5 count(P(t) | t) <= 2",
        "1.5 count(P(t) ^ Q(t) | t) = 1",
        "count(P(t) | t) <= 1.",
        "count(P(t) | t) < 3.",
        "Q(s) => count(P(t) | t) <= 1.",
        "count(P(t) v Q(t) | t) >= 3.",
        "0.7 count(P(t) ^ Q(u) | t, u) != 2",
        "1.5 *P(t) ^ *Q(t)",
        "1.5 P|Q(t)",
        "p=0.8: P(t) => Q(t)",
    ],
)
def test_formulas(formula):
    agrees(ml.model_from_text(NUMBERS + formula), "P(2)\n!Q(4)")


def test_comparison_is_what_it_says():
    """Written as facts of a closed predicate, an order gives the same."""
    by_hand = "*Less(time, time)\n" + NUMBERS + "1.5 P(t) ^ Q(u) ^ Less(t, u)"
    facts = "".join(f"Less({a}, {b})\n" for a, b in itertools.product(range(1, 5), repeat=2) if a < b)
    expected = agrees(ml.model_from_text(by_hand), facts)
    found = agrees(ml.model_from_text(NUMBERS + "1.5 P(t) ^ Q(u) ^ t < u"))
    assert found == pytest.approx(expected)


def test_hard_count_is_the_pairs():
    model = ml.model_from_text(NUMBERS + "count(P(t) | t) <= 1.")
    pairs = ml.model_from_text(NUMBERS + "t != u => !P(t) v !P(u).")
    assert agrees(model) == pytest.approx(agrees(pairs))


def test_probability_weight():
    model = ml.model_from_text("A\nB\np=0.8: A => B")
    evidence = ml.evidence_from_text("A", model=model)
    assert ml.marginal(model, evidence)["B"] == pytest.approx(0.8)


def test_weight_from_an_argument():
    model = ml.model_from_text("*conf(thing, value)\nred(thing)\nc: conf(x, c) => red(x)")
    evidence = ml.evidence_from_text("conf(A, 0.7)\nconf(B, -1.5)\nconf(A, 0.2)", model=model)
    answer = ml.marginal(model, evidence, ["red"])
    assert answer["red(A)"] == pytest.approx(1 / (1 + math.exp(-0.9)))
    assert answer["red(B)"] == pytest.approx(1 / (1 + math.exp(1.5)))
    with pytest.raises(ml.EvidenceMistake, match="E314"):
        ml.evidence_from_text("conf(A, high)", model=model)


def test_functions():
    text = "person motherOf(person)\nPale(person)\nSad(person)\nperson = {A, B}\n1.2 Pale(motherOf(x)) => Sad(x)\n"
    model = ml.model_from_text(text)
    found = agrees(model, "A = motherOf(B)\n")
    assert model.origin.dialect == "alchemy"
    # by hand: motherOf(A) is A or B, motherOf(B) is A
    weights = {}
    for mother, pa, pb, sa, sb in itertools.product("AB", *[(0, 1)] * 4):
        pale = {"A": pa, "B": pb}
        weights[mother, pa, pb, sa, sb] = math.exp(1.2 * ((not pale[mother] or sa) + (not pale["A"] or sb)))
    total = sum(weights.values())
    assert found["Sad(A)"] == pytest.approx(sum(w for k, w in weights.items() if k[3]) / total)
    hard = ml.model_from_text(text + "Pale(motherOf(motherOf(x))) => Sad(x).\n")
    agrees(hard, "A = motherOf(B)\n")


def test_precedence_of_alchemy():
    text = "P(t)\nQ(t)\nR(t)\nt = {A, B}\n1.5 P(x) ^ Q(x) v R(x)\n"
    alchemy = agrees(ml.model_from_text(text, dialect="alchemy"))
    assert alchemy == pytest.approx(agrees(ml.model_from_text(text.replace("P(x) ^ Q(x)", "(P(x) ^ Q(x))"))))
    standard = agrees(ml.model_from_text(text, dialect="standard"))
    assert standard == pytest.approx(agrees(ml.model_from_text(text.replace("Q(x) v R(x)", "(Q(x) v R(x))"))))
    assert alchemy != pytest.approx(standard)


def test_chain_of_implications_in_alchemy():
    text = "A\nB\nC\n1.5 A => B => C"
    found = agrees(ml.model_from_text(text, dialect="alchemy"))
    assert found == pytest.approx(agrees(ml.model_from_text("A\nB\nC\n1.5 (A => B) => C")))


def test_completion():
    text = "*E(n, n)\nP(n, n)\nP(x, y) :- E(x, z), E(z, y), x != y.\n"
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text("E(A, B)\nE(B, C)\nE(C, A)", model=model)
    answer = ml.map_state(model, evidence)
    true = {n for n in answer.names if n.startswith("P(") and answer[n]}
    assert true == {"P(A, C)", "P(B, A)", "P(C, B)"}
    weighted = ml.model_from_text(
        "H(t)\nA(t)\nB(t, t)\nt = {A, B}\n1.5 H(x) :- A(x)\nH(A) :- B(x, y)\n", dialect="lomrf"
    )
    agrees(weighted)


def test_count_of_rockit():
    text = "*person(p)\nred(p)\n|x| person(x) ^ red(x) >= 2\n0.5: red(x)\n".replace("0.5: red(x)", "-0.5 red(x)")
    model = ml.model_from_text(text, dialect="rockit")
    found = agrees(model, "person(A)\nperson(B)\nperson(C)")
    odds = np.array([math.exp(-1.0) * 3, math.exp(-1.5)])
    assert found["red(A)"] == pytest.approx(float(odds @ [2 / 3, 1]) / odds.sum())


def test_size_of_a_type():
    model = ml.model_from_text("P(t)\nt = {A, B, C}\n$w = log(domSize(t))\n$w P(x)")
    assert model.templates[0].weights == pytest.approx([math.log(3)])
    with pytest.raises(ml.EvidenceMistake, match="E316"):
        ml.evidence_from_text("P(D)", model=model)


@pytest.mark.parametrize(
    "formula",
    [
        "1 P(t) ^ t < 3",
        "c: Conf(t, c) => P(t)",
        "1 count(P(t) | t) = 2",
        "1 count(P(t) | t) < 0 v Rain",
        "1 count(P(t) ^ Rain | t) >= 2",
        "1 P(+t) ^ t > 2",
    ],
)
def test_text_of_a_model(formula):
    text = "time = {1, ..., 3}\nP(time)\nRain\nConf(time, num)\nnum = {0.5, 1.5}\n" + formula
    model = ml.model_from_text(text)
    assert ml.model_text(ml.model_from_text(ml.model_text(model))) == ml.model_text(model)
    again = ml.model_from_text(ml.model_text(model))
    assert agrees(again, "!Conf(1, 0.5)") == pytest.approx(agrees(model, "!Conf(1, 0.5)"))


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("P(t)\n1 P(x) ^ x < A", "E210"),
        ("P(t)\nt = {A}\n1 P(x) ^ x < 3", "E314"),
        ("P(t)\n1 P(x) ^ y < 3", "E205"),
        ("P(t)\ny: P(x)", "E211"),
        ("P(t)\ndomSize(t) P(x)", "E222"),
        ("P(t)\n$w P(x)", "E153"),
        ("P(t)\np=1.5: P(x)", "E129"),
        ("t = {1, ..., A}\nP(t)", "E151"),
        ("P(t)\n@test P(A)", "E112"),
        ("P(t)\n1 " + " v ".join(["*P(x)"] * 9), "E152"),
    ],
)
def test_mistakes(text, code):
    with pytest.raises(ml.MlnError) as caught:
        ml.no_evidence(ml.model_from_text(text))
    assert [d.code for d in caught.value.diagnostics] == [code]


@pytest.mark.parametrize(
    ("dialect", "line"),
    [
        ("tuffy", "FD: a -> b"),
        ("tuffy", "P(x) := Q(x)."),
        ("tuffy", "1 P(x), [lower(x) = x] => Q(x)"),
        ("alchemy", "1 (P(x)) * (Q(x) = 3.0)"),
        ("alchemy", "1 P(concat(x, x))"),
        ("alchemy", "P(x) :- Q(x)"),
        ("rockit", "P(x) :- Q(x)"),
    ],
)
def test_refusals_name_the_construct(dialect, line):
    with pytest.raises(ml.SyntaxMistake) as caught:
        ml.model_from_text(f"P(t)\nQ(t)\n{line}", dialect=dialect)
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.code == "E110"
    assert diagnostic.hint
    assert diagnostic.span.line == 3
