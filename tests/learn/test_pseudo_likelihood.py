"""Pseudo-likelihood equals its definition, its gradient finite differences, and known weights come out."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.engines.duckdb import DuckDBEngine
from mlnlite.engines.numpy import NumpyEngine
from mlnlite.learn.data.merge import merged
from mlnlite.learn.objectives import choose
from mlnlite.learn.objectives.choose import pseudo_listed
from mlnlite.learn.optimise import likelihood
from tests import brute
from tests.models import evidence_texts, model_texts

QUANTIFIED = [
    "EXIST y A(x, y)", "FORALL y A(x, y)", "S(x) => EXIST y A(x, y)", "EXIST y (A(x, y) ^ S(y))", "A(x, +y) v S(x)",
    "EXIST x, y A(x, y)", "FORALL y (A(x, y) => S(y))", "count(A(x, y) | y) >= 2", "S(x) <=> EXIST y (A(x, y) ^ S(y))",
]  # fmt: skip
DATA = Path(__file__).parents[3] / "shared" / "data"


def with_weights(model, evidence, weights):
    templates = [t.expanded(evidence.types) for t in model.templates]
    parts = np.split(weights, np.cumsum([len(t.weights) for t in templates])[:-1])
    return replace(model, templates=tuple(replace(t, weights=w) for t, w in zip(templates, parts, strict=True)))


def choices_of(text, databases, engine=None):
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text("\n---\n".join(databases), model=model)
    expanded = replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))
    found = pseudo_listed(expanded, evidence, frozenset(model.predicates), engine or NumpyEngine())
    return expanded, evidence, merged(found, sum(len(t.weights) for t in expanded.templates))


@settings(max_examples=50, deadline=None)
@given(model_texts(hard=False), evidence_texts(complete=True), evidence_texts(complete=True))
def test_flips_and_joins_count_the_same(text, first, second):
    """Every formula, also those without quantifiers and about blocks, by each of the two ways."""
    values = []
    for way in (False, True):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(choose, "ranges_widely", lambda template, databases, way=way: way)
            model, _, found = choices_of(text, [first, second])
        weights = np.random.default_rng(0).normal(size=sum(len(t.weights) for t in model.templates))
        values.append(likelihood.at(found, weights).value)
    assert values[0] == pytest.approx(values[1], abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(model_texts(hard=False), evidence_texts(complete=True), evidence_texts(complete=True))
def test_value_and_gradient(text, first, second):
    model, evidence, found = choices_of(text, [first, second])
    n = sum(len(t.weights) for t in model.templates)
    weights = np.random.default_rng(0).normal(size=n)
    point = likelihood.at(found, weights)
    assert point.value == pytest.approx(
        brute.pseudo_log_likelihood(with_weights(model, evidence, weights), evidence), abs=1e-9
    )
    step = 1e-6
    for i in range(n):
        shift = step * np.eye(n)[i]
        slope = (likelihood.at(found, weights + shift).value - likelihood.at(found, weights - shift).value) / 2 / step
        assert point.gradient[i] == pytest.approx(slope, abs=1e-5)
        bend = (likelihood.at(found, weights + shift).gradient - likelihood.at(found, weights - shift).gradient) / -2
        assert likelihood.curvature(found, point)(np.eye(n)[i]) == pytest.approx(bend / step, abs=1e-5)


def own_facts(names):
    """Facts about constants of one database only."""
    atoms = [f"{p}({', '.join(a)})" for p, n in (("S", 1), ("A", 2)) for a in itertools.product(names, repeat=n)]
    return st.sets(st.sampled_from(atoms), min_size=1).map(lambda chosen: "\n".join(sorted(chosen)))


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.sampled_from(QUANTIFIED), min_size=1, max_size=2, unique=True),
    st.tuples(own_facts("JK"), own_facts("LMNO"), own_facts("J")),
)
def test_quantifiers_range_over_the_constants_of_their_database(formulas, databases):
    model, evidence, found = choices_of("S(p)\nA(p, p)\n" + "".join(f"1 {f}\n" for f in formulas), databases)
    weights = np.random.default_rng(0).normal(size=sum(len(t.weights) for t in model.templates))
    value = brute.pseudo_log_likelihood(with_weights(model, evidence, weights), evidence)
    assert likelihood.at(found, weights).value == pytest.approx(value, abs=1e-9)


@pytest.mark.parametrize(
    ("n", "formula"),
    [
        (14, "S(x) => EXIST y (A(x, y) ^ S(y))"),
        (14, "EXIST y (A(x, y) ^ A(y, x))"),
        (7, "EXIST y, z (A(x, y) ^ A(y, z) ^ (x != z v S(y)))"),
        (9, "S(x) => count(A(x, y) ^ A(y, x) | y) <= 1"),
        (9, "FORALL y (A(x, y) => A(y, x)) <=> S(x)"),
    ],
)
def test_quantifiers_over_many_constants(n, formula):
    """Written out, the first would be 2^14 cases; in the others, one atom changes several cases of several bindings."""
    rng = np.random.default_rng(0)
    facts = [f"S(P{i})" for i in range(0, n, 2)] + [f"A(P{i}, P{j})" for i, j in enumerate(rng.integers(0, n, n))]
    model, evidence, found = choices_of(f"S(p)\nA(p, p)\n1 {formula}", ["\n".join(facts)])
    value = brute.pseudo_log_likelihood(with_weights(model, evidence, np.array([0.7])), evidence)
    assert likelihood.at(found, np.array([0.7])).value == pytest.approx(value, abs=1e-9)


def test_weights_without_bound_that_outgrow_each_other():
    """The larger both weights the better, as long as the first is much larger than the second."""
    model = ml.model_from_text("*B(p)\nA(p)\nB(x) => !A(x)\nA(x)")
    data = ml.evidence_from_text("B(I)\n!A(I)\nA(K)", model=model)
    learned = ml.learn(model, data, predict=["A"], prior=None)
    assert learned.value == pytest.approx(0.0, abs=1e-5)
    assert learned.unbounded.tolist() == [1, 1]


@settings(max_examples=25, deadline=None)
@given(model_texts(hard=False), evidence_texts(complete=True))
def test_engines_agree(text, facts):
    values = []
    for engine in (NumpyEngine(), DuckDBEngine()):
        model, _, found = choices_of(text, [facts], engine)
        values.append(likelihood.at(found, np.linspace(-1, 1, sum(len(t.weights) for t in model.templates))).value)
    assert values[0] == pytest.approx(values[1], abs=1e-12)


def test_joins_follow_the_facts_not_the_weights():
    """Each database has one value of each part: the 10,000 rows of the template come last, and once."""
    parts = "abcd"
    model = ml.model_from_text(
        "\n".join(f"{p.upper()}({p})" for p in parts) + "\n" + " ^ ".join(f"{p.upper()}(+{p})" for p in parts)
    )
    worlds = ["\n".join(f"{p.upper()}({p}{(7 * i + k) % 10})" for k, p in enumerate(parts)) for i in range(40)]
    data = ml.evidence_from_text("\n---\n".join(worlds), model=model)
    assert ml.learn(model, data, engine=NumpyEngine(2_000)).status == "converged"
