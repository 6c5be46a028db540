"""Model counting equals listing all worlds; belief propagation is exact on trees and says what it is elsewhere."""

from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings

import mlnlite as ml
from mlnlite.errors import Contradiction
from mlnlite.infer.deadline import Deadline, in_seconds
from mlnlite.infer.exact import marginal, wmc
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.marginal.bp import LOOPY, propagate_beliefs
from mlnlite.infer.reduce import parts
from mlnlite.infer.reduce.parts import divide
from mlnlite.infer.reduce.potentials import potentials_of
from tests.networks import network, networks, world_weight, worlds

counter = pytest.mark.skipif(not find_spec("pyganak"), reason="the extra wmc is not installed")
FRIENDS = "S(p)\nF(p, p)\n1.5 S(x) ^ F(x, y) => S(y)\n0.4 S(x)\n-1 F(x, y)\n"
PEOPLE = "p = {A, B, C, D}\n"


@counter
@settings(max_examples=15, deadline=None)
@given(net=networks(7))
def test_model_counting_equals_enumeration(net):
    weight = np.array([world_weight(net, w) for w in worlds(net)])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(marginal, "divide", lambda p: divide(p, 1))
        ask = {"width_limit": 1, "rung": lambda part, wanted: wmc.count_models(part, wanted, Deadline())}
        if np.isneginf(weight).all():
            with pytest.raises(Contradiction):
                marginals_of(net, **ask)
            return
        found = marginals_of(net, **ask)
    p = np.exp(weight - weight.max())
    assert found.log_z == pytest.approx(weight.max() + np.log(p.sum()), abs=1e-9)
    np.testing.assert_allclose(found.probability, (p / p.sum()) @ worlds(net), atol=1e-9)
    assert found.exact.all()


@counter
def test_model_counting_by_name():
    model = ml.model_from_text(FRIENDS)
    evidence = ml.evidence_from_text(PEOPLE + "F(A, B)\n", model=model)
    question = ["S(B)", "S(A) ^ S(B)", "EXIST x F(x, C)"]
    found = ml.marginal(model, evidence, question, method="wmc")
    exact = ml.marginal(model, evidence, question, method="exact")
    assert set(found.methods) == {"model counting"}
    assert found.status == "exact"
    whole = [ml.marginal(model, evidence, method=m).log_z for m in ("wmc", "exact")]
    assert whole[0] == pytest.approx(whole[1], abs=1e-9)
    np.testing.assert_allclose(found.probabilities, exact.probabilities, atol=1e-9)


def latin(n):
    """Latin squares with a mild wish: forbidden pairs everywhere, few worlds."""
    cell = np.arange(n * n).reshape(n, n)
    pairs = [(cell[i, a], cell[i, b]) for i in range(n) for a in range(n) for b in range(a)]
    pairs += [(cell[a, i], cell[b, i]) for i in range(n) for a in range(n) for b in range(a)]
    rows = [([-(int(u) * n + k + 1), -(int(v) * n + k + 1)], 0, 1) for u, v in pairs for k in range(n)]
    wish = [([1], 1, 1)]
    return network([("!", n)] * n * n, [(rows, False), (wish, False)], weights=[np.inf, 1.0])


@counter
def test_what_is_mostly_hard_and_wide_is_counted(monkeypatch):
    from mlnlite.infer.approach import Approach
    from mlnlite.infer.marginal.ladder import solve

    net = latin(3)
    monkeypatch.setattr(marginal, "divide", lambda p: divide(p, 1))
    found = solve(net, np.arange(net.n_atoms), (), Approach(width_limit=8))
    assert set(found.methods) == {"model counting"}
    assert found.log_z == pytest.approx(np.log(4 * np.exp(1.0) + 8))


@counter
def test_weights_too_small_for_the_counter_are_no_contradiction():
    net = network([("", 1)] * 2, [([([1, 2], 0, 1)], False), ([([1], 1, 1)], True)], weights=[-900.0, 0.5])
    (part,) = parts.parts(divide(potentials_of(net), 1), np.ones(1, bool))
    found = wmc.count_models(part, np.ones(2, bool), Deadline())
    assert found.log_z + potentials_of(net).constant == pytest.approx(marginals_of(net).log_z)


@counter
def test_model_counting_stops():
    part = next(parts.parts(divide(potentials_of(latin(7))), np.ones(1, bool)))
    assert wmc.count_models(part, np.ones(len(part.variables), bool), in_seconds(0.1)) is None


def test_without_ganak_it_is_refused_by_name(monkeypatch):
    monkeypatch.setattr(wmc, "find_spec", lambda _: None)
    model = ml.model_from_text(FRIENDS)
    with pytest.raises(ml.MissingPart, match=r"mlnlite\[wmc\]"):
        ml.marginal(model, ml.evidence_from_text(PEOPLE, model=model), "S", method="wmc")


def test_belief_propagation_is_exact_on_trees():
    rng = np.random.default_rng(0)
    blocks = [("!", int(rng.integers(2, 5))) for _ in range(40)]
    first = np.cumsum([0, *(k for _, k in blocks)])
    rows = [
        ([int(-first[v] - 1 - rng.integers(blocks[v][1])), int(first[u] + 1 + rng.integers(blocks[u][1]))], v % 5, 1)
        for v in range(1, 40)
        for u in (int(rng.integers(v)),)
    ]
    net = network(blocks, [(rows, False), ([([1], 0, 1)], False)], weights=[1.0, -2.0, 0.5, np.inf, 3.0])
    found = marginals_of(net, width_limit=1, rung=propagate_beliefs)
    np.testing.assert_allclose(found.probability, marginals_of(net).probability, atol=1e-5)
    assert LOOPY in found.method
    assert not found.exact[np.array(found.method) == LOOPY].any()


def test_belief_propagation_says_what_it_is():
    model = ml.model_from_text(FRIENDS)
    evidence = ml.evidence_from_text(PEOPLE, model=model)
    found = ml.marginal(model, evidence, ["S", "F(A, B)"], method="bp")
    exact = ml.marginal(model, evidence, ["S", "F(A, B)"], method="exact")
    assert found.status == "approximate: loopy belief propagation, errors not known"
    assert np.isnan(found.error).all()
    assert not found.exact.any()
    assert "about 0." in str(found)
    assert np.abs(found.probabilities - exact.probabilities).max() < 0.1
    with pytest.raises(ml.QueryMistake, match="atoms only"):
        ml.marginal(model, evidence, "S(A) ^ S(B)", method="bp")


def test_messages_that_go_round_in_circles_are_named():
    """Five atoms that all want to differ strongly: no damping settles that at once."""
    n, rng = 12, np.random.default_rng(1)
    rows = [([-(a + 1), b + 1], int(rng.integers(6)), 1) for a in range(n) for b in range(n) if a != b]
    net = network([("", 1)] * n, [(rows, False)], weights=[9.0, -9.0, 7.0, -8.0, 6.0, -6.0])
    found = marginals_of(net, width_limit=1, rung=propagate_beliefs)
    assert set(found.method) <= {LOOPY, f"{LOOPY}, not settled"}
