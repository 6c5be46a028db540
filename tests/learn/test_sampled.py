"""Where the likelihood is too wide, sampling finds the weights that summing finds, within the errors it states."""

from __future__ import annotations

import numpy as np
import pytest

import mlnlite as ml
from mlnlite.errors import LimitReached
from mlnlite.learn.objectives import exact, sampled
from mlnlite.learn.optimise import problem

MODEL = """S(p)
C(p)
*F(p, p)
S(x)
S(x) => C(x)
F(x, y) => (S(x) <=> S(y))
"""
FRIENDS = "\n".join(f"F(P{i}, P{(i + k) % 10})" for i in range(10) for k in (1, 2))
DATA = [
    "\n".join([FRIENDS, *(f"S(P{i})" for i in (0, 1, 2, 3, 7)), *(f"C(P{i})" for i in (0, 1, 2, 5))]),
    "\n".join([FRIENDS, *(f"S(P{i})" for i in (4, 5, 9)), *(f"C(P{i})" for i in (4, 5, 8, 1))]),
]


def too_wide(*_):
    raise LimitReached("too wide")


def both(monkeypatch, databases, model=MODEL, **options):
    """What is learnt by elimination, and by sampling."""
    model = ml.model_from_text(model)
    data = ml.evidence_from_text("\n---\n".join(databases), model=model)
    monkeypatch.setattr(exact, "MOST_WORLDS", 0)
    certain = ml.learn(model, data, objective="likelihood", **options)
    monkeypatch.setattr(problem, "wide_value", too_wide)
    monkeypatch.setattr(sampled, "N_CHAINS", 4)
    monkeypatch.setattr(sampled, "STEPS", 150)
    return certain, ml.learn(model, data, objective="likelihood", seed=1, **options)


def check(certain, found):
    assert certain.status == "converged"
    assert found.status == "sampled"
    assert (found.monte_carlo > 0).all()
    assert (found.monte_carlo < 0.2).all()
    assert (np.abs(found.weights - certain.weights) < 5 * found.monte_carlo).all()


def test_sampling_equals_summing(monkeypatch):
    certain, found = both(monkeypatch, DATA, predict=["S", "C"], prior=2.0)
    check(certain, found)
    assert np.isnan(found.value)
    assert found.to_dict()["value"] is None
    assert "standard errors of sampling up to" in str(found)


def test_sampling_with_unknown_atoms(monkeypatch):
    """The expectation step is sampled as well."""
    hidden = [DATA[0] + "\n?C(P3)\n?C(P4)\n?S(P8)", DATA[1] + "\n?S(P0)\n?S(P1)\n?C(P6)"]
    check(*both(monkeypatch, hidden, predict=["S", "C"], prior=2.0))


def test_sampling_with_nearly_hard_formulas(monkeypatch):
    model = (
        MODEL.replace("S(x) => C(x)", "@6 S(x) => C(x)")
        .replace("F(x, y) => (S", "F(x, y) => (C")
        .replace("S(y)", "C(y)")
    )
    data = [FRIENDS + "\n" + "\n".join(f"S(P{i})\nC(P{i})" for i in (0, 1, 4)) + "\nC(P6)\nC(P7)"] * 2
    certain, found = both(monkeypatch, data, model, predict=["S", "C"], prior=1.0)
    learnt = found.monte_carlo > 0
    assert learnt.tolist() == [True, False, True]
    assert (np.abs(found.weights - certain.weights) <= 5 * found.monte_carlo).all()


def test_laplace_is_not_sampled(monkeypatch):
    with pytest.raises(ml.QueryMistake, match="too wide; it can be sampled"):
        both(monkeypatch, DATA, predict=["S", "C"], prior=ml.Laplace())
