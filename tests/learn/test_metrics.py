"""Metrics equal scikit-learn's; folds keep groups together; baselines reach what others measured."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn import metrics as reference
from sklearn.linear_model import LogisticRegression

import mlnlite as ml
from mlnlite.learn import metrics
from mlnlite.learn.baselines import look_up, majority, naive_bayes, pairwise_logistic
from mlnlite.learn.crossvalidate import MODEL, Split, Training, crossvalidate
from mlnlite.learn.folds import folds, groups, select
from tests.learn.data import folder


def predictions(seed, n_values=2, n=60):
    random = np.random.default_rng(seed)
    p = np.round(random.dirichlet(np.ones(n_values), n), 1 if n_values == 2 else 8)
    p[:, -1] = 1 - p[:, :-1].sum(axis=1)
    return metrics.Predictions(p, random.integers(0, n_values, n), n_values == 2)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_binary_metrics(seed):
    found = predictions(seed)
    p, label = found.p[:, 1], found.label
    assert metrics.accuracy(found) == pytest.approx(np.mean(found.p.argmax(axis=1) == label))
    assert metrics.balanced_accuracy(found) == pytest.approx(
        reference.balanced_accuracy_score(label, found.p.argmax(axis=1))
    )
    assert metrics.brier(found) == pytest.approx(reference.brier_score_loss(label, p))
    assert metrics.auc_roc(found) == pytest.approx(reference.roc_auc_score(label, p))
    assert metrics.auc_pr(found) == pytest.approx(reference.average_precision_score(label, p))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_metrics_of_blocks(seed):
    found = predictions(seed, 4)
    assert metrics.log_loss(found) == pytest.approx(reference.log_loss(found.label, found.p, labels=range(4)))
    truth = np.eye(4)[found.label]
    assert metrics.auc_roc(found) == pytest.approx(reference.roc_auc_score(truth.ravel(), found.p.ravel()))
    assert metrics.auc_pr(found) == pytest.approx(reference.average_precision_score(truth.ravel(), found.p.ravel()))


def test_calibration():
    p = np.repeat([[0.75, 0.25]], 100, axis=0)
    right = metrics.calibration(metrics.Predictions(p, np.arange(100) % 4 // 3, binary=True))
    assert right.error == pytest.approx(0.0)
    wrong = metrics.calibration(metrics.Predictions(p, np.ones(100, np.int64), binary=True))
    assert wrong.error == pytest.approx(0.75)
    assert "0.250   1.000      100" in str(wrong)


def test_what_is_not_a_number_is_none():
    found = metrics.Predictions(np.array([[0.2, 0.8]]), np.array([1]), binary=True)
    assert np.isnan(metrics.auc_roc(found))
    model = ml.model_from_text("S(p)\n1 S(x)")
    evaluation = ml.evaluate(model, ml.evidence_from_text("S(A)", model=model), predicates=["S"])
    assert evaluation.to_dict()["scores"][0]["auc_roc"] is None
    assert "null" in evaluation.to_json()


def test_logistic_baseline_equals_scikit_learn():
    random = np.random.default_rng(0)
    rows = [tuple(random.choice(["a", "b", "c"], 2).tolist()) for _ in range(80)]
    labels = random.integers(0, 3, 80)
    found = pairwise_logistic(rows, labels, 3)(rows)
    names = sorted({n for r in rows for n in (f"0={r[0]}", f"1={r[1]}", f"0={r[0]}&1={r[1]}")})
    inputs = np.array([[n in (f"0={r[0]}", f"1={r[1]}", f"0={r[0]}&1={r[1]}") for n in names] for r in rows], float)
    expected = LogisticRegression(C=1.0, tol=1e-8, max_iter=5000).fit(inputs, labels).predict_proba(inputs)
    assert found == pytest.approx(expected, abs=1e-3)


def test_simple_baselines():
    rows, labels = [("a",), ("a",), ("a",), ("b",)], np.array([0, 0, 0, 1])
    for fit in (majority, look_up, naive_bayes, pairwise_logistic):
        p = fit(rows, labels, 2)([("a",), ("b",), ("new",)])
        assert p.sum(axis=1) == pytest.approx(np.ones(3))
        assert p[0, 0] > 0.5
    assert look_up(rows, labels, 2)([("b",)])[0, 1] > 0.5
    assert majority(rows, labels, 2)([("b",)])[0, 1] < 0.5


def test_folds_keep_groups_together():
    group = np.random.default_rng(0).integers(0, 30, 200)
    _, group = np.unique(group, return_inverse=True)
    fold = folds(group, 5, np.random.default_rng(1))
    assert all(len(set(fold[group == g])) == 1 for g in np.unique(group))
    assert np.bincount(fold).max() - np.bincount(fold).min() <= np.bincount(group).max()


def test_groups_and_selection():
    model = ml.model_from_text("S(p)\nC(p)\nS(x)")
    data = ml.evidence_from_text("S(A)\nC(A)\n---\nS(B)\n---\nS(A)\nC(A)\n---\nS(A)", model=model)
    assert groups(data, "cluster").tolist() == [0, 1, 0, 2]
    assert groups(data, "key", ["S"]).tolist() == [0, 1, 0, 0]
    part = select(data, np.array([1, 3]))
    assert part.n_databases == 2
    assert part.facts["S"].database.tolist() == [0, 1]
    assert len(part.facts["C"].truth) == 0


# --- the authors' instances

DECLARATIONS = """handover(cluster, preferences!)
armMobility(cluster, levels!)
hasShape(cluster, shape)
isA(cluster, category)
hasAffordance(cluster, affordance)
graspRegion(cluster, region!)
"""
KEY = ("hasShape", "isA", "hasAffordance")


def authors(formulas):
    """Instances with the method without the shape in it, and what reads "both regions" as one of them."""
    text = (folder("handover") / "dataset.db").read_text()
    text = re.sub(r"handover\(([a-z]+)_\w+\)", r"handover(x,\1)", text)
    text = text.replace("graspRegion(x,3-2)", "graspRegion(x,3)").replace("graspRegion(x,23)", "graspRegion(x,2)")
    model = ml.model_from_text(DECLARATIONS + formulas)
    return model, ml.evidence_from_text(text.replace("armMobility(", "armMobility(x,"), model=model)


def accuracies(found):
    return {row.method: 100 * row.accuracy for row in found.rows}


def test_region_baselines_with_held_out_keys():
    model, data = authors("graspRegion(c, +g)")
    split = Split("key", KEY)
    found = crossvalidate(model, data, predict=["graspRegion"], given=KEY, split=split, training=Training(prior=1.0))
    expected = {"majority": 49.9, "look-up table": 49.9, "naive Bayes": 41.1, "pairwise logistic": 49.3}
    measured = accuracies(found)
    assert {m: measured[m] for m in expected} == pytest.approx(expected, abs=3)
    assert measured[MODEL] == pytest.approx(49.9, abs=0.1)
    assert found.warnings == ()
    assert found.n_groups == 73


def test_random_split_says_that_it_flatters():
    model, data = authors("hasShape(c, +s) ^ isA(c, +k) ^ hasAffordance(c, +a) ^ graspRegion(c, +g)")
    found = crossvalidate(model, data, predict=["graspRegion"], given=KEY, training=Training(prior=1.0))
    measured = accuracies(found)
    assert measured["look-up table"] == pytest.approx(64.4, abs=3)
    assert measured[MODEL] == pytest.approx(measured["look-up table"], abs=1.5)
    (warning,) = found.warnings
    assert "copies" in warning


def test_method_baselines_with_held_out_keys():
    model, data = authors("handover(c, +h)")
    given = (*KEY, "armMobility")
    split = Split("key", KEY)
    found = crossvalidate(model, data, predict=["handover"], given=given, split=split, training=Training(prior=1.0))
    expected = {"majority": 62.0, "look-up table": 62.0, "naive Bayes": 55.9, "pairwise logistic": 66.7}
    measured = accuracies(found)
    assert {m: measured[m] for m in expected} == pytest.approx(expected, abs=5)
