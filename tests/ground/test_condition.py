"""Conditioning a network equals grounding with the same facts; propagation keeps every world's weight."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.ground.condition import condition
from mlnlite.ground.simplify import propagated
from mlnlite.infer.score import counts, log_weight
from tests import brute
from tests.models import evidence_texts, model_texts


def truth_of(network, world):
    return np.array([world[network.evidence.atom_at(int(a))] for a in network.atoms], bool)


@settings(max_examples=80, deadline=None)
@given(model_texts(), evidence_texts(), st.integers(0, 1000))
def test_condition_keeps_counts(text, facts, seed):
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text(facts, model=model)
    try:
        network = ml.ground(model, evidence)
    except ml.Contradiction:
        return
    naive = replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))
    rng = np.random.default_rng(seed)
    for world in itertools.islice(brute.worlds(model, evidence), 0, 4096, 531):
        truth = truth_of(network, world)
        known = np.where(rng.random(network.n_atoms) < 0.5, truth, -1).astype(np.int8)
        smaller = condition(network, known)
        assert counts(smaller, truth_of(smaller, world)).tolist() == brute.counts(naive, evidence, world)[0].tolist()
        assert smaller.n_atoms <= int((known == -1).sum())
        assert (smaller.n_open + smaller.decided_true <= smaller.n_groundings).all()


@settings(max_examples=80, deadline=None)
@given(model_texts(), evidence_texts())
def test_propagation_keeps_the_distribution(text, facts):
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text(facts, model=model)
    try:
        network = ml.ground(model, evidence)
        smaller = propagated(network)
    except ml.Contradiction:
        return
    for world in itertools.islice(brute.worlds(model, evidence), 0, 4096, 173):
        before = log_weight(network, truth_of(network, world))
        if before > -np.inf:
            forced = set(network.atoms) - set(smaller.atoms)
            facts_now = brute.facts(smaller.evidence)
            assert all(
                world[network.evidence.atom_at(int(a))] == facts_now[smaller.evidence.atom_at(int(a))] for a in forced
            )
            assert log_weight(smaller, truth_of(smaller, world)) == before
