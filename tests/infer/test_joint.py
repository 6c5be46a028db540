"""Joint tables against listing all worlds."""

import itertools

import numpy as np
import pytest

import mlnlite as ml
from tests import brute

TEXT = "P(a)\nG(a, c!)\na = {A1, A2}\nc = {C1, C2}\n0.7 P(x) => G(x, C1)\n1.2 G(x, u) ^ G(y, u) ^ P(y)\n-0.4 P(x)\n"
ASKED = ["P(A1)", "G(A2, C1)", "EXIST x P(x)"]


@pytest.fixture(scope="module")
def asked():
    model = ml.model_from_text(TEXT)
    return model, ml.evidence_from_text("", model=model)


def by_listing(model, evidence):
    every, probability, _ = brute.distribution(model, evidence)
    total = dict.fromkeys(itertools.product((True, False), repeat=3), 0.0)
    for world, p in zip(every, probability, strict=True):
        total[world["P", (0,)], world["G", (1, 0)], any(world["P", (i,)] for i in (0, 1))] += p
    return np.array(list(total.values()))


def test_a_table_of_atoms_and_a_formula(asked):
    found = ml.joint(*asked, ASKED)
    assert found.names[1] == "P(A1) ^ G(A2, C1) ^ !(EXIST x (P(x)))"
    assert found.status == "exact"
    np.testing.assert_allclose(found.probabilities, by_listing(*asked), atol=1e-9)


def test_a_sampled_table(asked):
    found = ml.joint(*asked, ASKED, method="gibbs", precision=0.01)
    assert (np.abs(found.probabilities - by_listing(*asked)) < 5 * found.error + 1e-6).all()
    assert found.probabilities.sum() == pytest.approx(1.0)


def test_known_atoms_and_too_many(asked):
    model, _ = asked
    known = ml.evidence_from_text("P(A1)\n", model=model)
    assert ml.joint(model, known, "P(A1), P(A2)").probabilities[2:].tolist() == [0.0, 0.0]
    with pytest.raises(ml.QueryMistake, match="1 to 8 atoms or formulas, not 9"):
        ml.joint(model, known, ["P(A1)"] * 9)
