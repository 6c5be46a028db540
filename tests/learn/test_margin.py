"""Max-margin weights equal those that listing every world gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

import mlnlite as ml
from tests import brute

EXAMPLES = [
    ("P(a)\nQ(a)\nP(x) => Q(x)\nQ(x)\nP(x) ^ P(y)\n", ["P(A)\nQ(A)\nP(B)", "Q(A)\nQ(B)"], ["P", "Q"]),
    ("P(a)\nG(a, c!)\nc = {C1, C2, C3}\nP(x) ^ G(x, +k)\n", ["P(A)\nG(A, C2)\nG(B, C1)", "G(A, C3)\nG(B, C3)"], ["G"]),
    ("P(a)\nG(a, c?)\nc = {C1, C2}\nP(x) => G(x, C1)\nG(x, +k)\n", ["P(A)\nG(A, C1)\nP(B)"], ["P", "G"]),
]


def every_cut(model, data, targets):
    """For each database and world: the loss, and counts in the data less counts in the world."""
    found = []
    for i in range(data.n_databases):
        one = ml.one_database(data, i)
        names = set(one.predicates)
        (labels,) = brute.worlds(model, one, closed=names)
        true = brute.counts(model, one, labels)[0]
        hidden = replace(one, facts={n: f if n not in targets else _none(f) for n, f in one.facts.items()})
        units = [m for _, m in brute.blocks(model, list(labels)) if m[0][0] in targets]
        units += [[a] for a in labels if a[0] in targets and model.predicates[a[0]].value is None]
        cuts = []
        for world in brute.worlds(model, hidden, closed=names - set(targets)):
            loss = sum(any(world[a] != labels[a] for a in unit) for unit in units)
            cuts.append((loss, true - brute.counts(model, one, world)[0]))
        found.append(cuts)
    return found


def _none(facts):
    return replace(facts, database=facts.database[:0], arguments=facts.arguments[:0], truth=facts.truth[:0])


@pytest.mark.parametrize(("text", "databases", "targets"), EXAMPLES)
def test_margin_equals_listing(text, databases, targets):
    model = ml.model_from_text(text)
    data = ml.evidence_from_text("\n---\n".join(databases), model=model)
    learned = ml.learn(model, data, objective="max-margin", predict=targets, prior=2.0)
    cuts = every_cut(learned.model, data, targets)

    def value(w):
        return w @ w / 8 + sum(max(loss - change @ w for loss, change in one) for one in cuts)

    n = len(learned.weights)
    slacks = [
        {"type": "ineq", "fun": lambda z, i=i, loss=loss, change=change: z[n + i] - loss + change @ z[:n]}
        for i, one in enumerate(cuts)
        for loss, change in one
    ]
    start = np.concatenate([np.zeros(n), [value(np.zeros(n))] * len(cuts)])
    best = minimize(lambda z: z[:n] @ z[:n] / 8 + z[n:].sum(), start, constraints=slacks, method="SLSQP")
    assert best.success
    assert learned.status == "converged"
    assert value(learned.weights) == pytest.approx(best.fun, abs=1e-5)
    assert learned.weights == pytest.approx(best.x[:n], abs=1e-2)
    assert learned.value == pytest.approx(learned.weights @ learned.weights / 8 - value(learned.weights), abs=1e-5)


def test_margin_beside_fixed_weights():
    text = "P(a)\nQ(a)\n#fixweight\n2.5 P(x) => Q(x)\n#fixweight\n-1 Q(x)\nP(x)\nP(x) ^ Q(x)\n"
    model = ml.model_from_text(text)
    data = ml.evidence_from_text("P(A)\nQ(B)\nP(D)\nQ(D)\n---\nP(A)", model=model)
    learned = ml.learn(model, data, objective="max-margin", prior=2.0)
    cuts = every_cut(learned.model, data, ["P", "Q"])

    def value(free):
        w = np.array([2.5, -1.0, *free])
        return free @ free / 8 + sum(max(loss - change @ w for loss, change in one) for one in cuts)

    grid = np.linspace(-3, 3, 61)
    lowest = min(value(np.array([a, b])) for a in grid for b in grid)
    assert learned.status == "converged"
    assert value(learned.weights[2:]) <= lowest + 1e-5


def test_margin_needs_a_gaussian_prior_and_complete_data():
    model = ml.model_from_text("P(a)\nP(x)\n")
    data = ml.evidence_from_text("P(A)", model=model)
    with pytest.raises(ml.QueryMistake, match="Gaussian prior"):
        ml.learn(model, data, objective="max-margin", prior=ml.Laplace())
    unknown = ml.evidence_from_text("P(A)\n?P(B)", model=model)
    with pytest.raises(ml.QueryMistake, match="need the likelihood"):
        ml.learn(model, unknown, objective="max-margin")


def test_margin_refuses_data_that_break_a_hard_formula():
    model = ml.model_from_text("P(a)\nQ(a)\nP(x) => Q(x).\nP(x)\n")
    with pytest.raises(ml.Contradiction):
        ml.learn(model, ml.evidence_from_text("P(A)", model=model), objective="max-margin")
