"""Standard errors: equal to textbook ones where there are, and their intervals hold the truth as often as they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mlnlite as ml
from mlnlite.ground.ground import ground
from mlnlite.learn.objectives import exact as exact_likelihood
from mlnlite.learn.trust import simulate
from mlnlite.learn.trust.simulate import draw_worlds, with_facts
from mlnlite.learn.trust.uncertainty import uncertainty
from mlnlite.model.evidence import Facts

COINS = "S(p)\nS(x)\n"


def coins(n_true, n):
    people = ", ".join(f"P{i}" for i in range(n))
    model = ml.model_from_text(f"{COINS}p = {{{people}}}\n")
    return model, ml.evidence_from_text("\n".join(f"S(P{i})" for i in range(n_true)), model=model)


@pytest.mark.parametrize("method", ["information", "sandwich", "bootstrap"])
@pytest.mark.parametrize("objective", ["pseudo-likelihood", "likelihood"])
def test_a_coin(method, objective):
    """The log odds of a coin have standard error 1 / sqrt(n p (1 - p))."""
    model, data = coins(30, 100)
    learned = ml.learn(model, data, prior=None, objective=objective)
    found = uncertainty(learned, data, method=method, repetitions=100)
    assert found.sd == pytest.approx([1 / np.sqrt(100 * 0.3 * 0.7)], rel=0.25 if method == "bootstrap" else 0.01)
    assert found.low[0] < np.log(3 / 7) < found.high[0]


def friends(n_worlds, seed):
    """Databases of three friends, drawn from a model with known weights."""
    text = "S(p)\nC(p)\n*F(p, p)\np = {A, B, C}\n-0.4 S(x)\n0.9 S(x) => C(x)\n0.5 F(x, y) => (S(x) <=> S(y))\n"
    model = ml.model_from_text(text)
    one = ml.evidence_from_text("F(A, B)\nF(B, C)\nF(B, A)\nF(C, B)", model=model)
    targets = frozenset(["S", "C"])
    names = ml.evidence_from_text("S(A)\nC(A)", model=model)
    atoms = np.concatenate([np.arange(3) + one.first_atom()[n] for n in names.predicates if n in targets])
    network = ground(model, one, query=np.sort(atoms))
    worlds = draw_worlds(network, n_worlds, np.random.default_rng(seed))
    true = [network.atoms[w[network.variable] == network.value] for w in worlds]
    table = one.facts["F"]
    n = len(table.truth)
    many = Facts(
        np.repeat(np.arange(n_worlds, dtype=np.int32), n),
        np.tile(table.arguments, (n_worlds, 1)),
        np.ones(n * n_worlds, bool),
    )
    present = {name: np.repeat(p, n_worlds, axis=0) for name, p in one.present.items()}
    empty = replace(one, n_databases=n_worlds, names=("",) * n_worlds, present=present, facts={**one.facts, "F": many})
    return model, with_facts(empty, targets, true)


def coverage(repetitions, n_databases=60):
    """How often the intervals hold the weights that the data were drawn from."""
    hits = []
    for seed in range(repetitions):
        model, data = friends(n_databases, seed)
        truth = np.concatenate([t.weights for t in model.templates])
        learned = ml.learn(model, data, predict=["S", "C"], prior=None)
        found = uncertainty(learned, data)
        hits.append((found.low <= truth) & (truth <= found.high))
    return np.mean(hits, axis=0)


def test_intervals_hold_the_truth():
    """40 repetitions of 3 weights: 95 % of 120, give or take three standard deviations."""
    assert coverage(40).mean() == pytest.approx(0.95, abs=0.06)


def test_likelihood_recovers_weights():
    model, data = friends(200, 1)
    learned = ml.learn(model, data, predict=["S", "C"], objective="likelihood", prior=None)
    found = uncertainty(learned, data)
    truth = np.concatenate([t.weights for t in model.templates])
    assert (np.abs(learned.weights - truth) < 3.5 * found.sd).all()


def test_components_are_clusters():
    model, data = coins(30, 100)
    learned = ml.learn(model, data, prior=None)
    assert uncertainty(learned, data).n_clusters == 100


def test_one_cluster_is_refused():
    model = ml.model_from_text("S(p)\nS(x) ^ S(y)\np = {A, B, C}")
    data = ml.evidence_from_text("S(A)", model=model)
    learned = ml.learn(model, data)
    with pytest.raises(ml.QueryMistake, match="two independent clusters"):
        uncertainty(learned, data)


def test_wide_components_are_drawn_by_sampling(monkeypatch):
    """The bootstrap's errors are those of exact draws, give or take, and it says how it drew."""
    model, data = friends(30, 3)
    learned = ml.learn(model, data, predict=["S", "C"], objective="likelihood", prior=2.0)
    exact = uncertainty(learned, data, method="bootstrap", repetitions=60)
    assert exact.warnings == ()
    monkeypatch.setattr(simulate, "MOST_WORLDS", 1)
    sampled = uncertainty(learned, data, method="bootstrap", repetitions=60)
    assert sampled.sd == pytest.approx(exact.sd, rel=0.5)
    (warning,) = sampled.warnings
    assert "drawn by sampling" in warning


def test_the_bootstrap_hides_what_the_data_do_not_say():
    """Of a hundred coins fifty are seen: the errors are those of fifty."""
    model = ml.model_from_text("S(p)\nS(x)\n")
    seen = [f"S(P{i})" for i in range(20)] + [f"!S(P{i})" for i in range(20, 50)]
    hidden = [f"?S(P{i})" for i in range(50, 100)]
    people = ", ".join(f"P{i}" for i in range(100))
    expected = 1 / np.sqrt(50 * 0.4 * 0.6)
    for facts, options in (
        (seen + hidden, {}),
        ([f"p = {{{people}}}", *seen], {"open_predicates": ["S"]}),
    ):
        data = ml.evidence_from_text("\n".join(facts), model=model)
        learned = ml.learn(model, data, prior=None, **options)
        assert learned.weights == pytest.approx([np.log(20 / 30)], abs=1e-5)
        for method in ("information", "bootstrap"):
            found = uncertainty(learned, data, method=method, repetitions=60)
            assert found.sd == pytest.approx([expected], rel=0.35 if method == "bootstrap" else 0.01)


def test_errors_of_wide_databases(monkeypatch):
    """Kept as networks, databases say the same of the errors as listed ones."""
    model, data = friends(12, 4)
    options = {"predict": ["S", "C"], "objective": "likelihood", "prior": 2.0}
    learned = ml.learn(model, data, **options)
    listed = [uncertainty(learned, data, method=m) for m in ("information", "sandwich")]
    monkeypatch.setattr(exact_likelihood, "MOST_WORLDS", 0)
    wide = ml.learn(model, data, **options)
    for method, expected in zip(("information", "sandwich"), listed, strict=True):
        found = uncertainty(wide, data, method=method)
        assert found.sd == pytest.approx(expected.sd, rel=1e-3)
        assert found.n_clusters == expected.n_clusters


def test_margins_have_no_errors():
    model, data = coins(3, 10)
    learned = ml.learn(model, data, objective="max-margin")
    with pytest.raises(ml.QueryMistake, match="no likelihood"):
        uncertainty(learned, data, method="information")
