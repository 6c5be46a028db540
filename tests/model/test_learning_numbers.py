"""Comparisons are no data: learning does not predict them."""

from __future__ import annotations

import pytest

import mlnlite as ml

BY_HAND = "*Less(time, time)\nP(time)\ntime = {1, 2, 3}\nP(t) ^ P(u) ^ Less(t, u)\nP(t)\n"
FACTS = "P(1)\nP(3)\n"


def test_the_same_as_with_facts():
    numbers = ml.model_from_text("P(time)\ntime = {1, 2, 3}\nP(t) ^ P(u) ^ t < u\nP(t)\n")
    found = ml.learn(numbers, ml.evidence_from_text(FACTS, model=numbers))
    model = ml.model_from_text(BY_HAND)
    facts = FACTS + "Less(1, 2)\nLess(1, 3)\nLess(2, 3)\n"
    expected = ml.learn(model, ml.evidence_from_text(facts, model=model), predict=["P"])
    weights = [float(t.weights[0]) for m in (found, expected) for t in m.model.templates]
    assert weights[:2] == pytest.approx(weights[2:], abs=1e-5)
