"""Soft evidence is a factor on its atom: against enumeration, with the factor written as a formula."""

from __future__ import annotations

import pytest

import mlnlite as ml
from tests import brute

MODEL = """
Smokes(person)
Cancer(person)
Age(person, years!)
years = {Young, Old}
0.7 Smokes(x) => Cancer(x)
0.4 Age(x, Old) => Smokes(x)
"""
FACTS = "0.8 Smokes(Anna)\n0.3 !Cancer(Bob)\n0.6 Age(Bob, Old)\n?Cancer(Anna)\n"
FORMULAS = "logit(0.8) Smokes(Anna)\nlogit(0.7) Cancer(Bob)\nlogit(0.6) Age(Bob, Old)\n"


def expected(text):
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text("person = {Anna, Bob}", model=model)
    probabilities = brute.marginals(model, evidence)
    return {named(evidence, n, a): p for (n, a), p in probabilities.items()}


def named(evidence, name, arguments):
    types = evidence.predicates[name].types
    constants = [evidence.types[t].constants[a] for t, a in zip(types, arguments, strict=True)]
    return f"{name}({', '.join(constants)})"


def test_marginals():
    model = ml.model_from_text(MODEL)
    evidence = ml.evidence_from_text(FACTS, model=model)
    answer = ml.marginal(model, evidence)
    for name, probability in expected(MODEL + FORMULAS).items():
        assert answer[name] == pytest.approx(probability, abs=1e-12)


def test_alone_it_is_the_probability():
    model = ml.model_from_text("P(a)")
    evidence = ml.evidence_from_text("0.7 P(A)\n0.7 P(B)\n0.7 P(B)", model=model)
    answer = ml.marginal(model, evidence)
    assert answer["P(A)"] == pytest.approx(0.7)
    assert answer["P(B)"] == pytest.approx(0.49 / (0.49 + 0.09))


def test_map():
    model = ml.model_from_text(MODEL)
    evidence = ml.evidence_from_text(FACTS, model=model)
    assert ml.map_state(model, evidence)["Smokes(Anna)"]


def test_each_database_has_its_own():
    model = ml.model_from_text("P(a)")
    evidence = ml.evidence_from_text("0.7 P(A)\n---\n0.2 P(A)", model=model)
    answers = [ml.marginal(model, ml.one_database(evidence, i))["P(A)"] for i in (0, 1)]
    assert answers == pytest.approx([0.7, 0.2])


@pytest.mark.parametrize(
    ("model", "facts", "code"),
    [
        ("P(a)", "P(A)\n0.3 P(A)", "E313"),
        ("*P(a)", "?P(A)", "E315"),
        ("P(a)", "0.3 Q(A)", "E302"),
        ("P(a)", "?P(A, B)", "E303"),
        ("P(a)", "?!P(A)", "E145"),
        ("P(a)", "1.3 P(A)", "E148"),
    ],
)
def test_mistakes(model, facts, code):
    with pytest.raises(ml.MlnError) as caught:
        ml.evidence_from_text(facts, model=ml.model_from_text(model))
    assert [d.code for d in caught.value.diagnostics] == [code]


def test_a_world_with_open_facts_is_not_closed():
    model = ml.model_from_text("P(a)")
    evidence = ml.evidence_from_text("0.3 P(A)", model=model)
    with pytest.raises(ml.EvidenceMistake, match="cannot be closed"):
        ml.closed(evidence, ["P"])
