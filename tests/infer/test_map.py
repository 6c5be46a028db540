"""Best worlds against listing all worlds, and one method against another."""

import numpy as np
import pytest
from hypothesis import given, settings

import mlnlite as ml
from benchmarks.generators import smokers
from mlnlite.errors import Contradiction
from mlnlite.infer.map import ladder as map_module
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.map.rungs import METHODS
from mlnlite.infer.reduce import parts, peel
from tests.networks import attracting_networks, network, networks, world_weight, worlds


def best_weight(net):
    return max(world_weight(net, t) for t in worlds(net))


@pytest.mark.parametrize(("small", "fewest"), [(1, 1), (1, 64), (1024, 1), (1024, 64)])
@settings(max_examples=150, deadline=None)
@given(net=networks())
def test_best_world_equals_enumeration(net, small, fewest):
    expected = best_weight(net)
    divide = parts.divide
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(map_module, "divide", lambda p, small_=0, **_: divide(p, small))
        patch.setattr(map_module, "peel", lambda p, maximise: peel.peel(p, maximise=maximise, fewest=fewest))
        if np.isneginf(expected):
            with pytest.raises(Contradiction):
                map_of(net)
            return
        answer = map_of(net)
    assert answer.log_weight == pytest.approx(expected, abs=1e-9)
    assert answer.log_weight == pytest.approx(world_weight(net, answer.truth), abs=1e-9)
    assert answer.bound == pytest.approx(answer.log_weight, abs=1e-5)
    assert answer.status == "optimal"


SEARCHES = ("annealing", "maxwalksat")


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=20, deadline=None)
@given(net=networks(max_atoms=14))
def test_every_rung_equals_enumeration(net, method):
    """Minimum cuts answer what they can and refuse the rest; searches find the best worlds, but seldom prove it."""
    expected = best_weight(net)
    try:
        answer = map_of(net, method=method)
    except Contradiction:
        assert np.isneginf(expected)
        return
    except ml.QueryMistake:
        assert method == "mincut"
        return
    assert answer.log_weight == pytest.approx(expected, abs=1e-6)
    assert answer.log_weight == pytest.approx(world_weight(net, answer.truth), abs=1e-9)
    assert answer.bound >= expected - 1e-9
    assert answer.status == "optimal" or method in SEARCHES
    assert answer.status == "feasible" or 0 <= answer.gap < 1e-5


@pytest.mark.parametrize("seed", range(2))
def test_every_rung_agrees_with_the_others_on_networks_of_a_middle_size(seed):
    """Attractive pairs, so that minimum cuts can take part, and a frustrated network with counts for all others."""
    rng = np.random.default_rng(seed)
    pairs = rng.integers(0, 60, (90, 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]] + 1
    weights = [round(float(w), 2) for w in rng.exponential(1, len(pairs))] + [0.9, -0.8, -1.1]
    clauses = [([([int(-a), int(b)], i, 1)], False) for i, (a, b) in enumerate(pairs)]
    units = [([([int(a) * int(rng.choice([-1, 1]))], int(len(pairs) + a % 2), 1)], False) for a in range(1, 61)]
    circles = [([int(x) + 1 for x in rng.choice(60, 8, replace=False)], len(pairs) + 2, 1) for _ in range(6)]
    attractive = network([("", 1)] * 60, clauses + units, (), weights)
    frustrated = network([("", 1)] * 60, clauses + units, (), weights, counts=[(np.arange(9) ** 2 % 5, circles)])
    for net, methods in ((attractive, METHODS), (frustrated, [m for m in METHODS if m != "mincut"])):
        answers = {m: map_of(net, method=m, time_limit=30) for m in methods}
        best, bound = max(a.log_weight for a in answers.values()), min(a.bound for a in answers.values())
        assert best <= bound + 1e-5
        for name, answer in answers.items():
            assert best <= answer.bound + 1e-5, name
            assert answer.log_weight >= best - answer.gap - 1e-5, name
            assert answer.status == "feasible" or answer.log_weight == pytest.approx(best, abs=1e-5), name
        assert answers["annealing"].log_weight == pytest.approx(best, abs=1e-5)


@pytest.mark.parametrize("at_once", [0, 10**9])
@pytest.mark.parametrize("method", ["auto", "mincut"])
@settings(max_examples=30, deadline=None)
@given(net=attracting_networks())
def test_minimum_cuts_equal_enumeration(net, method, at_once):
    expected = best_weight(net)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(map_module, "_AT_ONCE", at_once)
        if np.isneginf(expected):
            with pytest.raises(Contradiction):
                map_of(net, method=method)
            return
        answer = map_of(net, method=method)
    assert answer.log_weight == pytest.approx(expected, abs=1e-9)
    assert answer.bound == pytest.approx(expected, abs=1e-6)
    assert answer.status == "optimal"
    assert len(answer.component_gap) == len(np.unique(answer.component))


def test_an_interrupted_cut_has_a_bound(monkeypatch):
    model, evidence = smokers(2000)
    net = ml.ground(model, evidence)
    monkeypatch.setattr(map_module, "_AT_ONCE", 0)
    best = map_of(net)
    monkeypatch.setattr("mlnlite.infer.map.mincut._PATHS", 1)
    early = map_of(net, time_limit=1e-9)
    assert best.methods == {"mincut": len(best.component_status)}
    assert early.status == "feasible"
    assert early.log_weight <= best.log_weight <= early.bound + 1e-6


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"method": "mincuts"}, "no method mincuts.*\n.*mincut"),
        ({"method": "gibbs"}, "no method gibbs"),
        ({"gap": -0.1}, "gap of -0.1"),
        ({"gap": float("nan")}, "gap of nan"),
        ({"time_limit": 0}, "time limit of 0 s"),
        ({"time_limit": float("nan")}, "time limit of nan s"),
        ({"seed": -1}, "-1 is no seed"),
        ({"seed": 2**31}, "is no seed"),
    ],
)
def test_options_that_mean_nothing_are_refused_however_easy_the_question(option, message):
    model = ml.model_from_text("P(a)\na = {A, B}\n1 P(x)\n")
    evidence = ml.evidence_from_text("P(A)\n", model=model)
    with pytest.raises(ml.QueryMistake, match=message):
        ml.map_state(model, evidence, **option)
    if "time_limit" in option or "seed" in option:
        with pytest.raises(ml.QueryMistake, match=message):
            ml.map_states(model, evidence, **option)


def test_different_worlds_need_a_penalty_that_is_a_number():
    model = ml.model_from_text("P(a)\na = {A, B}\n1 P(x)\n")
    evidence = ml.evidence_from_text("P(A)\n", model=model)
    for penalty in (-1.0, float("nan"), float("inf")):
        with pytest.raises(ml.QueryMistake, match="no log-weight to lose"):
            ml.map_states(model, evidence, k=2, diverse=penalty)
