"""Lifted inference equals elimination and enumeration, and does what neither can."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml

SMOKERS = """Smokes(person)
Cancer(person)
Friends(person, person)
1.5 Smokes(x) => Cancer(x)
0.3 Friends(x, y) ^ Smokes(x) => Smokes(y)
-0.5 Smokes(x)
-0.7 Friends(x, y)
"""
ATOMS = ("P(x)", "Q(x)", "Q(y)", "R(x, y)", "R(y, x)", "R(x, x)", "S(x, y)", "x = y")


def people(n):
    return "person = {" + ", ".join(f"P{i}" for i in range(n)) + "}\n"


@st.composite
def models(draw):
    lines = ["P(t)", "Q(t)", "R(t, t)", "S(t, t)"]
    for _ in range(draw(st.integers(1, 4))):
        parts = draw(st.lists(st.sampled_from(ATOMS), min_size=1, max_size=3))
        parts = [*parts, "R(x, y)"] if "x = y" in parts else parts
        connective = draw(st.sampled_from([" v ", " ^ ", " <=> "]))
        if connective == " <=> ":
            parts = parts[-2:]
        formula = connective.join(f"({draw(st.sampled_from(['', '!']))}({part}))" for part in parts)
        weight = draw(st.sampled_from([-1.5, -0.3, 0.4, 1.0, 2.0]))
        hard = draw(st.integers(0, 5)) == 0
        lines.append(f"{formula}." if hard else f"{weight} {formula}")
    return "\n".join(lines) + "\n"


@settings(max_examples=25, deadline=None)
@given(models(), st.lists(st.sampled_from(["P(A)", "!P(B)", "Q(A)", "!Q(C)", "Q(B)"]), max_size=3, unique=True))
def test_equals_elimination(text, facts):
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text("t = {A, B, C}\n" + "\n".join(facts) + "\n", model=model)
    used = [n for n in "PQRS" if any(n in line for line in text.split("\n")[4:])]
    if not used:
        return
    try:
        exact = ml.marginal(model, evidence, used, method="exact")
    except ml.Contradiction:
        with pytest.raises(ml.Contradiction):
            ml.marginal(model, evidence, used, method="lifted")
        return
    lifted = ml.marginal(model, evidence, used, method="lifted")
    assert lifted.names == exact.names
    assert np.abs(lifted.probabilities - exact.probabilities).max() < 1e-9


def test_log_z_equals_elimination():
    model = ml.model_from_text(SMOKERS)
    evidence = ml.evidence_from_text(people(4) + "Cancer(P1)\n!Smokes(P2)\n", model=model)
    exact, lifted = (
        ml.marginal(model, evidence, ["Smokes", "Cancer", "Friends"], method=m) for m in ("exact", "lifted")
    )
    assert lifted.log_z == pytest.approx(exact.log_z, abs=1e-9)
    assert set(lifted.methods) == {"lifted", "evidence"}


def test_a_thousand_people():
    model = ml.model_from_text(SMOKERS.replace("0.3", "0.003"))
    start = time.process_time()
    result = ml.marginal(
        model, ml.evidence_from_text(people(1000), model=model), ["Smokes", "Cancer", "Friends(P1, x)"]
    )
    assert time.process_time() - start < 5.0
    assert set(result.methods) == {"lifted"}
    assert result.exact.all()
    assert np.ptp([result[f"Smokes(P{i})"] for i in range(1000)]) == 0.0
    assert 0.1 < result["Smokes(P0)"] < 0.3


@pytest.mark.parametrize(
    ("text", "facts", "reason"),
    [
        (SMOKERS, "Friends(P0, P1)\n", "one argument only, not Friends"),
        (SMOKERS + "1 Friends(x, y) ^ Friends(y, z) => Friends(x, z)\n", "", "one or two variables"),
        (SMOKERS + "1 Smokes(x) => EXIST y Friends(x, y)\n", "", "no quantifier"),
        (SMOKERS + "1 Smokes(P0)\n", "", "variable|constant"),
    ],
)
def test_says_why_not(text, facts, reason):
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text(people(3) + facts, model=model)
    with pytest.raises(ml.QueryMistake, match=reason):
        ml.marginal(model, evidence, ["Smokes"], method="lifted")


def test_formulas_in_conflict_are_named():
    """Some friends must smoke, none may; that all have cancer is beside the point."""
    text = """Smokes(person)
Cancer(person)
Friends(person, person)
Friends(x, y) ^ Smokes(x) => Smokes(y).
Friends(x, x) v Smokes(x).
!Smokes(x).
!Friends(x, y) v x != y.
Cancer(x).
-0.3 Friends(x, y)
"""
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text(people(30), model=model)
    with pytest.raises(ml.Contradiction) as caught:
        ml.marginal(model, evidence, "Cancer", method="lifted")
    named = [d.message.partition(":")[0] for d in caught.value.diagnostics]
    assert named == ["formula 2", "formula 3", "formula 4"]
    with pytest.raises(ml.Contradiction, match="these 3 hard formulas"):
        ml.marginal(model, evidence, "Cancer", method="exact")
