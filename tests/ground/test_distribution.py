"""The same worlds with the same log-weights on every engine, with each simplification, all of them, and none."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.engines.choose import BySize
from mlnlite.engines.duckdb import DuckDBEngine
from mlnlite.engines.numpy import NumpyEngine
from mlnlite.ground.patterns import with_counts, without_counts
from mlnlite.ground.simplify import propagated
from mlnlite.infer.score import log_weight
from mlnlite.model.soft import soft_templates
from tests import brute
from tests.models import evidence_texts, model_texts
from tests.reference_engine import ReferenceEngine

ENGINES = [NumpyEngine(), BySize(), DuckDBEngine(), ReferenceEngine()]
SIMPLIFICATIONS = {
    "none": [],
    "hard units propagated": [propagated],
    "patterns counted": [with_counts],
    "counts as tables": [without_counts],
    "all": [propagated, with_counts, without_counts],
}
EXTRA = [
    "0.9 count(R(x, z) | z) >= 1",
    "-1.3 count(R(x, z) | z) = 1",
    "P(x) => count(R(x, z) | z) <= 1.",
    "0.6 Q(x) <=> EXIST z R(x, z)",
    "-0.8 EXIST x, z (R(x, z) ^ P(x))",
    "0.5 P(x) ^ P(y) ^ x != y => Q(x)",
    "-0.7 F(x, u) ^ G(x, u)",
    "1.2 !F(x, u) v !F(y, u)",
]
SOFT = [("0.8", "P(A1)"), ("0.3", "!R(A1, B2)"), ("0.6", "G(A2, C1)"), ("?", "Q(A2)")]


@st.composite
def worlds_and_models(draw):
    text = draw(model_texts()) + "\n".join(draw(st.lists(st.sampled_from(EXTRA), max_size=2)))
    facts = draw(evidence_texts())
    certain = {line.removeprefix("!") for line in facts.split("\n")}
    soft = [f"{p} {a}".replace("? ", "?") for p, a in draw(st.sets(st.sampled_from(SOFT)))]
    soft = [line for line in soft if line.split(" ", 1)[-1].lstrip("!?") not in certain]
    mentioned = {line.lstrip("?!.0123456789 ")[0] for line in soft}
    closed = draw(st.sets(st.sampled_from("PQRG"))) - mentioned
    model = ml.model_from_text(text)
    return model, ml.closed(ml.evidence_from_text("\n".join([facts, *soft]), model=model), closed)


@pytest.mark.parametrize("engine", ENGINES, ids=["numpy", "by size", "duckdb", "reference"])
@settings(max_examples=25, deadline=None)
@given(worlds_and_models())
def test_log_weights_equal_the_definition(engine, given_):
    model, evidence = given_
    templates = (*model.templates, *soft_templates(evidence))
    naive = replace(model, templates=tuple(t.expanded(evidence.types) for t in templates))
    every = list(itertools.islice(brute.worlds(model, evidence), 0, 4096, 61))
    assume(every)
    expected = [brute.log_weight(naive, evidence, world) for world in every]
    try:
        network = ml.ground(model, evidence, engine=engine)
    except ml.Contradiction:
        assert max(expected) == -np.inf
        return
    for passes in SIMPLIFICATIONS.values():
        assert [after(network, passes, world) for world in every] == pytest.approx(expected, abs=1e-9)


def after(network, passes, world):
    """The log-weight of a world in the network that some simplifications leave."""
    try:
        for simplify in passes:
            network = simplify(network)
    except ml.Contradiction:
        return -np.inf
    known = brute.facts(network.evidence)
    if any(world[atom] != truth for atom, truth in known.items()):
        return -np.inf
    return log_weight(network, np.array([world[network.evidence.atom_at(int(a))] for a in network.atoms], bool))
