"""The text of a model means what the model means."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.model.compare import differences
from tests import brute
from tests.models import model_texts


@st.composite
def repeated(draw):
    """A model some formulas of which stand there again, with other weights or other names of variables."""
    text = draw(model_texts())
    lines = [line for line in text.splitlines() if line and line[0] in "-0123456789"]
    for line in draw(st.lists(st.sampled_from(lines), max_size=2)) if lines else ():
        weight = draw(st.sampled_from(["-1", "0.5", "2"]))
        text += f"{weight} {line.split(' ', 1)[1]}\n"
    return text


def worth(model, world):
    """Log-weight of a world by the definition."""
    evidence = ml.no_evidence(model)
    expanded = replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))
    every = [(p, a, evidence.atom_number(p, np.array([a], np.int32))) for p, a in brute.atoms(model, evidence)]
    return brute.log_weight(expanded, evidence, {(p, a): world(evidence.atom_text(int(n[0]))) for p, a, n in every})


@settings(max_examples=60, deadline=None)
@given(text=repeated(), seed=st.integers(0, 1000))
def test_reading_what_is_written_changes_no_weight(text, seed):
    model = ml.model_from_text(text)
    again = ml.model_from_text(ml.model_text(model))
    chosen: dict[str, bool] = {}
    rng = np.random.default_rng(seed)

    def world(name):
        return chosen.setdefault(name, bool(rng.random() < 0.5))

    assert worth(again, world) == pytest.approx(worth(model, world), abs=1e-9)
    assert differences(model, again, tolerance=1e-12) == []


def test_differences_see_through_names_and_repetition():
    declared = "P(a, b)\nQ(a)\nb = {B1, B2}\n"
    model = ml.model_from_text(declared + "1 P(z, B1) ^ Q(z)\n1 P(z, B2) ^ Q(z)\n2 Q(x)\n-1 Q(x)\n2 Q(z)\n")
    other = ml.model_from_text(declared + "1 P(w, B1) ^ Q(w)\n3 Q(y)\n1 P(x, B2) ^ Q(x)\n")
    assert differences(model, other) == []
    (one,) = differences(model, ml.model_from_text(declared + "1 P(w, B1) ^ Q(w)\n3 Q(y)\n2 P(x, B2) ^ Q(x)\n"))
    assert (one.text, one.left, one.right) == ("P(x1, B2) ^ Q(x1)", 1.0, 2.0)
