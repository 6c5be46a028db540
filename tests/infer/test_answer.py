"""The whole way, from text to answer, equals enumeration of all worlds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from tests import brute
from tests.models import evidence_texts, model_texts


def asked(text, facts, closed):
    model = ml.model_from_text(text)
    evidence = ml.closed(ml.evidence_from_text(facts, model=model), closed)
    return model, evidence, replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))


def count_open(model, evidence):
    return sum(1 for _ in brute.worlds(model, evidence))


@settings(max_examples=60, deadline=None)
@given(model_texts(), evidence_texts(), st.sets(st.sampled_from("PQR")))
def test_marginals_and_log_z(text, facts, closed):
    model, evidence, naive = asked(text, facts, closed)
    if count_open(model, evidence) > 1500:
        closed = {"P", "Q", "R"}
        model, evidence, naive = asked(text, facts, closed)
    worlds, probability, log_z = brute.distribution(naive, evidence)
    query = ["P", "Q", "R", "F", "G", "P(A1) ^ Q(A2)", "EXIST z (R(A1, z))", "P(x) <=> Q(x)"]
    if log_z == -np.inf:
        with pytest.raises(ml.Contradiction):
            ml.marginal(model, evidence, query)
        return
    result = ml.marginal(model, evidence, query)
    assert result.log_z == pytest.approx(log_z, abs=1e-9)
    truth = {
        "P(A1) ^ Q(A2)": lambda w: w["P", (0,)] and w["Q", (1,)],
        "EXIST z (R(A1, z))": lambda w: w["R", (0, 0)] or w["R", (0, 1)],
        "P(A1) <=> Q(A1)": lambda w: w["P", (0,)] == w["Q", (0,)],
        "P(A2) <=> Q(A2)": lambda w: w["P", (1,)] == w["Q", (1,)],
    }
    for name, holds in truth.items():
        expected = sum(p for w, p in zip(worlds, probability, strict=True) if holds(w))
        assert result[name] == pytest.approx(expected, abs=1e-9)
    exact = brute.marginals(naive, evidence)
    for (name, arguments), p in exact.items():
        types = model.predicates[name].types
        constants = [evidence.types[t].constants[c] for t, c in zip(types, arguments, strict=True)]
        assert result[f"{name}({', '.join(constants)})"] == pytest.approx(p, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(model_texts(), evidence_texts(), st.sets(st.sampled_from("PQR")))
def test_map_state(text, facts, closed):
    model, evidence, naive = asked(text, facts, closed)
    if count_open(model, evidence) > 1500:
        model, evidence, naive = asked(text, facts, {"P", "Q", "R"})
    best = max(brute.log_weight(naive, evidence, w) for w in brute.worlds(model, evidence))
    if best == -np.inf:
        with pytest.raises(ml.Contradiction):
            ml.map_state(model, evidence)
        return
    result = ml.map_state(model, evidence, ["P", "Q", "R", "F", "G"])
    assert result.status == "optimal"
    assert result.log_weight == pytest.approx(best, abs=1e-9)
    world = {}
    for name, truth in result.state.items():
        predicate, rest = name[:-1].split("(")
        types = model.predicates[predicate].types
        arguments = zip(types, rest.split(", "), strict=True)
        world[predicate, tuple(evidence.types[t].index[c] for t, c in arguments)] = truth
    assert brute.log_weight(naive, evidence, world) == pytest.approx(best, abs=1e-9)
