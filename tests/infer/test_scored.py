"""A world's score by counting joins equals enumeration, and the network's own count."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.ground.count import count_true
from tests import brute
from tests.models import evidence_texts, model_texts

DATA = Path(__file__).parents[3] / "shared" / "data"


def text_of(model, evidence, world):
    lines = []
    for (name, arguments), truth in world.items():
        types = model.predicates[name].types
        constants = [evidence.types[t].constants[c] for t, c in zip(types, arguments, strict=True)]
        lines.append(f"{'' if truth else '!'}{name}({', '.join(constants)})")
    return "\n".join(lines)


@settings(max_examples=80, deadline=None)
@given(model_texts(), evidence_texts(), st.integers(0, 10_000))
def test_counts_equal_enumeration(text, facts, pick):
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text(facts, model=model)
    expanded = replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))
    world = next(itertools.islice(brute.worlds(model, evidence), pick % 97, None), None)
    if world is None:
        return
    world_evidence = ml.evidence_from_text(text_of(model, evidence, world), model=model)
    true, total = brute.counts(expanded, evidence, world)
    assert count_true(expanded, world_evidence).tolist() == true.tolist()
    try:
        score = ml.score(model, evidence, world_evidence)
    except ml.Contradiction:
        return
    assert score.log_weight == pytest.approx(brute.log_weight(expanded, evidence, world), abs=1e-9)
    weights = np.concatenate([t.weights for t in expanded.templates])
    soft = np.isfinite(weights)
    paid = np.where(weights[soft] > 0, weights[soft] * (total - true)[soft], -weights[soft] * true[soft])
    assert score.cost == pytest.approx(float(paid.sum()), abs=1e-9)
    assert 0 <= score.open_cost <= score.cost + 1e-9


def test_the_best_world_of_the_relational_classification():
    folder = DATA / "mln" / "class"
    if not folder.exists():
        pytest.skip("needs the shared data")
    model = ml.read_model(folder / "prog.mln")
    evidence = ml.read_evidence(folder / "evidence.db", model=model)
    best = ml.map_state(model, evidence, "category")
    assert best.status == "optimal"
    known = ml.Model(evidence.types, model.predicates, (), model.dialect)
    world = ml.evidence_from_text("\n".join(best.true_atoms), model=known)
    score = ml.score(model, evidence, world)
    assert score.cost == pytest.approx(25935.14, abs=1e-6)
    assert score.open_cost == pytest.approx(5141.24, abs=1e-6)
    assert score.log_weight == pytest.approx(best.log_weight, rel=1e-12)


def test_a_world_against_the_evidence_is_refused():
    model = ml.model_from_text("S(p)\n1 S(x)")
    evidence = ml.evidence_from_text("S(Anna)", model=model)
    with pytest.raises(ml.EvidenceMistake, match=r"contradicts the evidence about S\(Anna\)"):
        ml.score(model, evidence, ml.evidence_from_text("!S(Anna)", model=model))
    with pytest.raises(ml.EvidenceMistake, match="the world has other constants of the type p: Bob"):
        ml.score(model, evidence, ml.evidence_from_text("S(Bob)", model=model))
