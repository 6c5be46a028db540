"""A session answers as a new question with the same facts does."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from tests.models import evidence_texts, model_texts

DATA = Path(__file__).parents[3] / "shared" / "data"
QUERY = ["P", "F", "G", "P(A1) ^ R(A1, B2)"]


@settings(max_examples=60, deadline=None)
@given(model_texts(), evidence_texts(), st.sets(st.sampled_from("PQR")))
def test_equals_a_new_question(text, facts, closed):
    model = ml.model_from_text(text)
    evidence = ml.closed(ml.evidence_from_text(facts, model=model), closed)
    try:
        expected = ml.marginal(model, evidence, QUERY)
    except ml.Contradiction:
        with pytest.raises(ml.Contradiction):
            ml.compile(model, query=QUERY, evidence_predicates=closed).query(facts)
        return
    session = ml.compile(model, query=QUERY, evidence_predicates=closed)
    found = session.query(facts)
    assert found.probabilities == pytest.approx(expected.probabilities, abs=1e-9)


def test_facts_as_tuples_and_text_agree():
    model = ml.model_from_text("S(p)\nC(p)\n1.5 S(x) => C(x)")
    session = ml.compile(model, query="C", evidence_predicates=["S"], constants={"p": ["Anna", "Bob"]})
    assert session.query([("S", "Anna")])["C(Anna)"] == session.query("S(Anna)")["C(Anna)"]
    assert session.query("")["C(Anna)"] == pytest.approx(0.5)


def test_new_constants_are_named():
    model = ml.model_from_text("S(p)\nC(p)\n1.5 S(x) => C(x)")
    session = ml.compile(model, query="C", constants={"p": ["Anna"]})
    for facts in ("S(Bob)", [("S", "Bob")]):
        with pytest.raises(ml.EvidenceMistake, match="Bob is not a constant of the type p in this session"):
            session.query(facts)


def test_the_authors_model():
    path = DATA / "handover" / "learnt.mln"
    if not path.exists():
        pytest.skip("needs the shared data")
    model = ml.read_model(path)
    facts = "hasShape(x,cylinder)\nisA(x,crockery)\nhasAffordance(x,to_pour)\nhandover(midway)\narmMobility(level_1)"
    told = ["hasShape", "isA", "hasAffordance", "handover", "armMobility"]
    session = ml.compile(model, query="graspRegion", evidence_predicates=told, constants={"cluster": ["x"]})
    evidence = ml.evidence_from_text(facts, model=model)
    expected = ml.marginal(model, evidence, "graspRegion", closed_world="all")
    assert session.query(facts).probabilities == pytest.approx(expected.probabilities, abs=1e-12)
