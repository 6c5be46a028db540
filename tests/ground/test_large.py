"""Grounding by parts, in memory cut from long arrays, and with atoms beyond 32 bits: equal to what a few lines list."""

from __future__ import annotations

import numpy as np
import pytest

import mlnlite as ml
from mlnlite.ground.room import room
from mlnlite.model.evidence import Evidence, Facts

TEXT = """*Friends(person, person)
Smokes(person)
Cancer(person)
0.5 Smokes(x) => Cancer(x)
0.4 Friends(x, y) ^ Smokes(x) => Smokes(y)
-0.3 Smokes(x)
"""
N = 60_000


@pytest.fixture(scope="module")
def evidence():
    rng = np.random.default_rng(5)
    model = ml.model_from_text(TEXT)
    pairs = np.unique(rng.integers(0, N, (5 * N, 2)), axis=0).astype(np.int32)
    known = np.sort(rng.choice(N, N // 10, replace=False)).astype(np.int32)[:, None]
    facts = {
        "Friends": Facts(np.zeros(len(pairs), np.int32), pairs, np.ones(len(pairs), bool)),
        "Smokes": Facts(np.zeros(len(known), np.int32), known, rng.random(len(known)) < 0.5),
        "Cancer": Facts(np.zeros(0, np.int32), np.empty((0, 1), np.int32), np.empty(0, bool)),
    }
    people = ml.evidence_from_text("\n".join(f"Smokes(P{i})" for i in range(N)), model=model)
    return model, Evidence(people.types, dict(model.predicates), facts, people.present)


def test_clauses_are_those_of_the_facts(evidence):
    model, evidence = evidence
    network = ml.ground(model, evidence)
    smokes = np.full(N, -1)
    smokes[evidence.facts["Smokes"].arguments[:, 0]] = evidence.facts["Smokes"].truth
    x, y = evidence.facts["Friends"].arguments.astype(np.int64).T
    listed = (x != y) & (smokes[x] != 0) & (smokes[y] != 1)
    both = listed & (smokes[x] < 0) & (smokes[y] < 0)
    place = {int(a): i for i, a in enumerate(network.atoms)}
    first = evidence.first_atom()["Smokes"]
    assert first > 2**31
    (found,) = (c for c in network.clauses if c.literals.shape[1] == 2)
    rows = np.sort(found.literals[found.weight == 1], axis=1).tolist()
    expected = [[-place[first + a] - 1, place[first + b] + 1] for a, b in zip(x[both], y[both], strict=True)]
    assert sorted(rows) == sorted(expected)
    single = next(c for c in network.clauses if c.literals.shape[1] == 1 and not c.negated)
    assert single.count[single.weight == 1].sum() == (listed & ~both & ((smokes[x] < 0) | (smokes[y] < 0))).sum()
    assert network.n_open[1] == both.sum() + single.count[single.weight == 1].sum()


def test_arrays_that_are_cut_share_nothing():
    cut = room()
    arrays = [
        cut(n, kind) for n in (10, 20_000, 30_001, 3_000_000, 5_000_000) for kind in (np.int8, np.int32, np.int64)
    ]
    for i, array in enumerate(arrays):
        array[:] = i
    for i, array in enumerate(arrays):
        assert (array == i).all()
