"""Exact, conditional and observed likelihoods equal enumeration; what is unknown never lowers the likelihood."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

import mlnlite as ml
from mlnlite.learn.learned import How
from mlnlite.learn.objectives import exact
from mlnlite.learn.objectives.choose import task_of
from mlnlite.learn.optimise.problem import log_likelihood
from tests import brute
from tests.models import evidence_texts, model_texts


def problem_of(text, databases, targets, unknown=(), objective="likelihood"):
    model = ml.model_from_text(text.replace("F(a, c!)\n", ""))
    evidence = ml.evidence_from_text("\n---\n".join(databases), model=model)
    model = replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))
    how = How(objective, None, tuple(unknown))
    return model, evidence, task_of(model, evidence, how, frozenset(targets), None).problem


def with_weights(model, problem, x):
    every = problem.weights.copy()
    every[problem.free] = x
    parts = np.split(every, np.cumsum([len(t.weights) for t in model.templates])[:-1])
    return replace(model, templates=tuple(replace(t, weights=w) for t, w in zip(model.templates, parts, strict=True)))


def log_sum(values):
    values = np.array(list(values))
    return values.max() + math.log(np.exp(values - values.max()).sum())


def expected(model, evidence, targets, unknown=()):
    """log P(known targets | the rest), by listing worlds."""
    total = 0.0
    for i in range(evidence.n_databases):
        one = ml.one_database(evidence, i)
        conditions = exact.without(one, frozenset(targets))
        rest = set(one.predicates) - set(targets) - set(unknown)
        every = log_sum(brute.log_weight(model, one, w) for w in brute.worlds(model, conditions, closed=rest))
        complete = set(one.predicates) - set(unknown)
        known = log_sum(brute.log_weight(model, one, w) for w in brute.worlds(model, one, closed=complete))
        total += known - every
    return total


@pytest.fixture(params=["list", "eliminate"])
def way(request, monkeypatch):
    """Both ways: with all components listed, and none."""
    if request.param == "eliminate":
        monkeypatch.setattr(exact, "MOST_WORLDS", 0)
    return request.param


def check(text, facts, targets, unknown=()):
    model, evidence, problem = problem_of(text, facts, targets, unknown)
    x = np.random.default_rng(0).normal(size=len(problem.free))
    value, gradient = log_likelihood(problem, x)
    filled = with_weights(model, problem, x)
    assert value == pytest.approx(expected(filled, evidence, targets, unknown), abs=1e-8)
    for i in range(len(x)):
        step = 1e-5 * np.eye(len(x))[i]
        slope = (log_likelihood(problem, x + step)[0] - log_likelihood(problem, x - step)[0]) / 2e-5
        assert gradient[i] == pytest.approx(slope, abs=1e-5)


PQ = "P(a)\nQ(a)\na = {A1, A2}\n"
LIST = settings(max_examples=20, deadline=None)


@LIST
@given(model_texts("PQG", hard=False), evidence_texts("PQG", complete=True), evidence_texts("PQG", complete=True))
def test_likelihood_by_listing(text, first, second):
    check(text, [first, second], ["P", "Q", "G"])


@settings(max_examples=25, deadline=None)
@given(model_texts("PQR", hard=False), evidence_texts("PQR", complete=True))
def test_conditional_likelihood_by_listing(text, facts):
    check(text, [facts], ["P", "Q"])


@settings(max_examples=25, deadline=None)
@given(model_texts("PQG", hard=False), evidence_texts("PQG"))
def test_observed_likelihood_by_listing(text, facts):
    check(text, [facts], ["P", "Q"], ["Q", "G"])


EXAMPLES = [
    ("P(x) v Q(x)\n0.3 P(x) <=> Q(y)\nP(+x) ^ G(x, +u)", "P(A1)\nQ(A2)\nG(A1, C1)", ()),
    ("P(x) => Q(x)\nG(x, +u) ^ Q(x)", "P(A1)\nG(A2, C3)\n!Q(A1)", ("Q", "G")),
]


@pytest.mark.parametrize(("formulas", "facts", "unknown"), EXAMPLES)
def test_both_ways(way, formulas, facts, unknown):
    text = f"{PQ}G(a, c?)\nc = {{C1, C2, C3}}\n" + "\n".join(formulas.split("\n"))
    check(text, [facts], ["P", "Q", "G"], unknown)


def test_composite_of_two_atoms_is_the_likelihood():
    text = "P(a)\nQ(a)\nP(x) ^ Q(x)\nP(x)\n"
    facts = ["P(A)\nQ(A)\nP(B)", "Q(C)\nP(D)"]
    values = []
    for objective in ("composite", "likelihood"):
        _, _, problem = problem_of(text, facts, ["P", "Q"], objective=objective)
        values.append(log_likelihood(problem, np.array([0.4, -0.2]))[0])
    assert values[0] == pytest.approx(values[1], abs=1e-10)


@settings(max_examples=20, deadline=None)
@given(model_texts("PQG", hard=False), evidence_texts("PQG"), evidence_texts("PQG"))
def test_unknown_atoms_never_lower_the_likelihood(text, first, second):
    model = ml.model_from_text(text)
    data = ml.evidence_from_text(f"{first}\n---\n{second}", model=model)
    learned = ml.learn(model, data, objective="likelihood", predict=["P", "Q"], open_predicates=["Q", "G"], prior=2.0)
    assert (np.diff(learned.history) >= -1e-9 * np.maximum(1.0, np.abs(learned.history[1:]))).all()
    assert learned.status == "converged"


def test_the_best_weight_of_one_formula():
    """Each person smokes with odds e^w: 3 of 4 do, so w = log 3."""
    model = ml.model_from_text("S(p)\nS(x)\np = {A, B, C, D}")
    data = ml.evidence_from_text("S(A)\nS(B)\nS(C)", model=model)
    assert ml.learn(model, data, objective="likelihood", prior=None).weights == pytest.approx([math.log(3)], abs=1e-6)
    unknown = ml.evidence_from_text("S(A)\nS(B)\nS(C)\n!S(D)", model=model)
    learned = ml.learn(model, unknown, objective="likelihood", open_predicates=["S"], prior=None)
    assert learned.weights == pytest.approx([math.log(3)], abs=1e-6)
