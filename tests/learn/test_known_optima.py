"""Weights whose best values are known: from other programs, in closed form, from scikit-learn."""

from __future__ import annotations

from collections import Counter
from itertools import product

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import expit
from sklearn.linear_model import LogisticRegression

import mlnlite as ml
from tests.learn.data import folder, handover_model, instances

PARTS = ("hasShape", "isA", "hasAffordance", "graspRegion", "handover", "armMobility")


def smokers():
    path = folder("pracmln", "smokers")
    model = ml.read_model(path / "mlns" / "smoking.mln")
    return model, ml.read_evidence(path / "dbs" / "smoking-train.db", model=model)


@pytest.mark.parametrize(
    ("prior_sd", "predict", "expected"),
    [
        (None, None, (0.646696, 1.519900)),
        (5.0, None, (0.628576, 1.508115)),
        (1.0, None, (0.380768, 1.291365)),
        (None, ["Smokes", "Cancer"], (0.519501, 0.663355)),
    ],
)
def test_smokers(prior_sd, predict, expected):
    learned = ml.learn(*smokers(), prior=prior_sd, predict=predict)
    assert learned.weights == pytest.approx(expected, abs=1e-5)
    assert learned.status == "converged"


def cells():
    """For each cell of the authors' formula: in how many databases it is true, and in how many one atom short of it.

    With one conjunction per cell, and one value (or none) of each part in a database, an atom changes at most one
    cell: one of the six atoms of a true cell makes it false (6 n1 choices with odds e^w), and the one atom that a cell
    lacks makes it true (n0 choices with odds e^-w). So the pseudo-log-likelihood is a sum over cells of
    6 n1 log s(w) + n0 log s(-w), and w = log(6 n1 / n0).
    """
    values = [sorted({a[-1] for atoms in instances() for a in atoms if a[0] == part}) for part in PARTS]
    true, short = Counter(), Counter()
    for atoms in instances():
        have = dict.fromkeys(PARTS) | {a[0]: a[-1] for a in atoms}
        assert len(atoms) == sum(v is not None for v in have.values())
        row = tuple(have[p] for p in PARTS)
        missing = [i for i, v in enumerate(row) if v is None]
        true[row] += not missing
        for i in range(len(PARTS)) if not missing else missing if len(missing) == 1 else []:
            short.update((*row[:i], v, *row[i + 1 :]) for v in values[i] if v != row[i])
    return {cell: (true[cell], short[cell]) for cell in product(*values)}


def best(n_true, n_short, prior_sd):
    """Zero of the slope `6 n1 - (6 n1 + n0) s(w) - w / sd^2`."""
    if prior_sd is None:
        with np.errstate(divide="ignore"):
            return float(np.log(6 * n_true) - np.log(n_short)) if n_true + n_short else 0.0
    precision = prior_sd**-2
    slope = lambda w: 6 * n_true - (6 * n_true + n_short) * expit(w) - precision * w  # noqa: E731
    return brentq(slope, -100, 100, xtol=1e-12)


@pytest.mark.parametrize("prior_sd", [None, 5.0, 1.0])
def test_authors_data_in_closed_form(prior_sd):
    model = handover_model()
    data = ml.read_evidence(folder("handover") / "dataset.db", model=model)
    learned = ml.learn(model, data, prior=prior_sd)
    (template,) = learned.model.templates
    types = [data.types[template.formula.variables[k].type].constants for k in template.keys]
    names = [tuple(t[i] for t, i in zip(types, row, strict=True)) for row in template.rows.tolist()]
    counted = cells()
    solved = {pair: best(*pair, prior_sd) for pair in set(counted.values())}
    expected = np.array([solved[counted[name]] for name in names])
    finite = np.isfinite(expected)
    assert len(names) == 97_500
    assert learned.weights[finite] == pytest.approx(expected[finite], abs=1e-6)
    if prior_sd is None:
        assert (learned.unbounded == np.where(finite, 0, np.sign(expected))).all()
    assert learned.weights[~finite] == pytest.approx(np.sign(expected[~finite]) * learned.bound)
    assert learned.gradient <= 1e-8 * 1.01


def votes(model, name):
    path = folder("mln", "voting") / name
    data = ml.read_evidence(path, model=model)
    reps = data.types["rep"].constants
    table = np.zeros((len(reps), len(model.predicates)))
    for j, predicate in enumerate(model.predicates):
        facts = data.facts[predicate]
        table[facts.arguments[facts.truth, 0], j] = 1
    return data, table


@pytest.mark.parametrize("sd", [1.0, 5.0])
def test_voting_equals_logistic_regression(sd):
    model = ml.read_model(folder("mln", "voting") / "voting.mln")
    data, table = votes(model, "voting-train.db")
    learned = ml.learn(model, data, predict=["Democrat"], prior=sd)
    inputs = np.column_stack([np.ones(len(table)), table[:, 1:]])
    fit = LogisticRegression(C=sd**2, fit_intercept=False, tol=1e-10, max_iter=10_000).fit(inputs, table[:, 0])
    assert learned.weights == pytest.approx(fit.coef_[0], abs=1e-4)
    assert learned.status == "converged"


@pytest.mark.parametrize("sd", [0.5, 1.0, 5.0])
def test_voting_held_out_no_worse_than_logistic_regression(sd):
    """Five folds of the representatives whose party is known."""
    model = ml.read_model(folder("mln", "voting") / "voting.mln")
    _, table = votes(model, "voting-train.db")
    names = [*model.predicates]
    fold = np.random.default_rng(0).permutation(len(table)) % 5
    hits, losses = np.zeros(2), np.zeros(2)
    for f in range(5):
        train, test = table[fold != f], table[fold == f]
        lines = [f"{n}(R{i})" for i, row in enumerate(train) for n, v in zip(names, row, strict=True) if v]
        people = ", ".join(f"R{i}" for i in range(len(train)))
        data = ml.evidence_from_text("\n".join([f"rep = {{{people}}}", *lines]), model=model)
        learned = ml.learn(model, data, predict=["Democrat"], prior=sd).model
        lines = [f"{n}(T{i})" for i, row in enumerate(test) for n, v in zip(names[1:], row[1:], strict=True) if v]
        people = ", ".join(f"T{i}" for i in range(len(test)))
        asked = ml.evidence_from_text("\n".join([f"rep = {{{people}}}", *lines]), model=learned)
        answer = ml.marginal(learned, asked, ["Democrat"], closed_world=names[1:])
        fit = LogisticRegression(C=sd**2, fit_intercept=False, tol=1e-10, max_iter=10_000)
        inputs = [np.column_stack([np.ones(len(t)), t[:, 1:]]) for t in (train, test)]
        theirs = fit.fit(inputs[0], train[:, 0]).predict_proba(inputs[1])[:, 1]
        ours = np.array([answer[f"Democrat(T{i})"] for i in range(len(test))])
        for k, p in enumerate((ours, theirs)):
            hits[k] += ((p > 0.5) == test[:, 0]).sum()
            losses[k] -= np.log(np.where(test[:, 0] > 0, p, 1 - p)).sum()
    assert hits[0] >= hits[1]
    assert losses[0] <= losses[1] * (1 + 1e-3)
    assert hits[0] / len(table) > 0.9
