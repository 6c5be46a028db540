"""Facts found by bisection, arrays cut and joined, atoms numbered anew: each equal to the plain way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.ground import patch
from mlnlite.model import change

indices = st.lists(st.integers(0, 9), unique=True, max_size=8).map(sorted)


@settings(max_examples=100, deadline=None)
@given(indices, st.lists(st.integers(0, 20), max_size=6).map(sorted), st.sampled_from([0, 1000]))
def test_an_array_is_spliced(gone, at, most):
    array = np.arange(20).reshape(10, 2)
    at = np.minimum(np.array(at, np.int64), 10 - len(gone))
    new = 100 + np.arange(2 * len(at)).reshape(-1, 2)
    gone = np.array(gone, np.int64)
    expected = np.insert(np.delete(array, gone, axis=0), at, new, axis=0)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(change, "MOST_PARTS", most)
        assert change.spliced(array, gone, at, new).tolist() == expected.tolist()


@settings(max_examples=100, deadline=None)
@given(indices, indices)
def test_literals_are_numbered_anew(before, after):
    before, after = np.array(before, np.int64), np.array(after, np.int64)
    kept = [a for a in before.tolist() if a in after]
    literals = np.array([s * (before.tolist().index(a) + 1) for a in kept for s in (1, -1)], np.int32).reshape(-1, 2)
    expected = [[s * (after.tolist().index(a) + 1) for s in (1, -1)] for a in kept]
    for few in (0, 100):
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(patch, "FEW", few)
            renumber = patch._renumbering(before, after)
        if renumber is None:
            assert before.tolist() == after.tolist()
            continue
        assert renumber(literals, np.empty_like(literals)).tolist() == expected


def test_facts_are_found_by_bisection(monkeypatch):
    model = ml.model_from_text("P(a, b)\na = {A0, A1, A2, A3, A4}\nb = {B0, B1, B2, B3, B4, B5}")
    rng = np.random.default_rng(2)
    facts = "\n".join(f"P(A{i // 6}, B{i % 6})" for i in rng.choice(30, 18, replace=False))
    every = np.arange(30)
    for text in (facts, "P(A2, B3)"):
        evidence = ml.evidence_from_text(text, model=model)
        expected = change.find(evidence.atom_number("P", evidence.facts["P"].arguments), every)
        monkeypatch.setattr(change, "MANY", 0)
        found = [change.places_of(evidence, "P", every[i : i + 1]) for i in every]
        assert [int(place[0]) for place, _ in found] == expected[0].tolist()
        assert [bool(there[0]) for _, there in found] == expected[1].tolist()
