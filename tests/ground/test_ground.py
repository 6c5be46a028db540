"""Grounding equals naive enumeration: the same number of true groundings of every formula in every world."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.engines.duckdb import DuckDBEngine
from mlnlite.engines.numpy import NumpyEngine
from mlnlite.infer.score import counts
from tests import brute
from tests.models import evidence_texts, model_texts


def expanded(model, evidence):
    return replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))


def ground_or_none(model, evidence, engine):
    try:
        return ml.ground(model, evidence, engine=engine)
    except ml.Contradiction:
        return None


def truth_of(network, world):
    return np.array([world[network.evidence.atom_at(int(a))] for a in network.atoms], bool)


@settings(max_examples=150, deadline=None)
@given(model_texts(), evidence_texts(), st.sets(st.sampled_from("PQR")))
def test_counts_equal_enumeration(text, facts, closed):
    model = ml.model_from_text(text)
    evidence = ml.closed(ml.evidence_from_text(facts, model=model), closed)
    network = ground_or_none(model, evidence, NumpyEngine())
    naive = expanded(model, evidence)
    weights = np.concatenate([t.weights for t in naive.templates])
    for world in itertools.islice(brute.worlds(model, evidence), 0, 4096, 37):
        true, total = brute.counts(naive, evidence, world)
        if network is None:
            hard = np.isinf(weights)
            assert (true[hard] < total[hard]).any()
        else:
            assert counts(network, truth_of(network, world)).tolist() == true.tolist()
            assert network.n_groundings.tolist() == total.tolist()


@settings(max_examples=60, deadline=None)
@given(model_texts(), evidence_texts(), st.sets(st.sampled_from("PQR")))
def test_engines_give_the_same_network(text, facts, closed):
    model = ml.model_from_text(text)
    evidence = ml.closed(ml.evidence_from_text(facts, model=model), closed)
    a, b = (ground_or_none(model, evidence, engine) for engine in (NumpyEngine(), DuckDBEngine()))
    assert (a is None) == (b is None)
    if a is not None:
        for name in ("atoms", "variable", "value", "cardinality", "decided_true", "n_groundings"):
            assert np.array_equal(getattr(a, name), getattr(b, name))
        assert len(a.clauses) == len(b.clauses)
        for left, right in zip(a.clauses, b.clauses, strict=True):
            assert np.array_equal(left.literals, right.literals)
            assert np.array_equal(left.count, right.count)


def test_hard_formula_against_evidence_names_the_formula():
    model = ml.model_from_text("S(p)\nC(p)\nS(x) => C(x).")
    evidence = ml.evidence_from_text("S(A)\n!C(A)", model=model)
    with pytest.raises(ml.Contradiction, match="formula 1"):
        ml.ground(model, evidence)


def test_missing_weight_is_an_error():
    model = ml.model_from_text("S(p)\nC(p)\nS(x) => C(x)")
    with pytest.raises(ml.QueryMistake, match="has no weight"):
        ml.ground(model, ml.no_evidence(model))


def test_a_functional_predicate_is_one_variable():
    model = ml.model_from_text("F(a, c!)\nc = {C1, C2, C3}\na = {A1, A2}\n1 F(x, C1)\n2 F(x, C2)")
    network = ml.ground(model, ml.no_evidence(model))
    assert network.cardinality.tolist() == [3, 3]
    assert network.block.all()
