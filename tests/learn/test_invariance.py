"""What must not matter to learning: names of constants, order of databases, databases seen twice."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings

import mlnlite as ml
from tests.models import evidence_texts, model_texts


def learnt(text, databases):
    model = ml.model_from_text(text)
    learned = ml.learn(model, ml.evidence_from_text("\n---\n".join(databases), model=model), prior=2.0)
    return learned.value, np.sort(learned.weights)


def renamed(text):
    """The constants of each type in the opposite order."""
    return re.sub(r"\b([A-C])([1-3])\b", lambda m: f"{m[1]}{9 - int(m[2])}", text)


@settings(max_examples=25, deadline=None)
@given(model_texts(hard=False), evidence_texts(complete=True), evidence_texts(complete=True))
def test_names_and_order(text, first, second):
    value, weights = learnt(text, [first, second])
    for other_text, databases in ((text, [second, first]), (renamed(text), [renamed(first), renamed(second)])):
        other_value, other_weights = learnt(other_text, databases)
        assert other_value == pytest.approx(value, abs=1e-7)
        assert other_weights == pytest.approx(weights, abs=1e-6)


@settings(max_examples=15, deadline=None)
@given(model_texts(hard=False), evidence_texts(complete=True))
def test_seen_twice(text, facts):
    model = ml.model_from_text(text)
    once, twice = (ml.evidence_from_text("\n---\n".join([facts] * n), model=model) for n in (1, 2))
    first, second = ml.learn(model, once, prior=2.0), ml.learn(model, twice, prior=np.sqrt(2.0))
    assert second.weights == pytest.approx(first.weights, abs=1e-6)
    assert second.value == pytest.approx(2 * first.value, abs=1e-6)
