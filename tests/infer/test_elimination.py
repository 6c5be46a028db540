"""Elimination on components that are too large to list: against other programs, and against itself."""

import json
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlnlite.errors import LimitReached, MissingPart
from mlnlite.infer.exact.elimination import best_world, log_sum
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.exact.order import TooWide, Tree, plan
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.score import log_weight
from tests.networks import network

HARD = np.inf


def random_cells(rng, cardinality, n_cells, arity=3):
    by_arity = {}
    n = len(cardinality)
    for _ in range(n_cells):
        at = rng.integers(0, n)
        scope = np.unique(np.clip(at + rng.integers(-2, 3, arity), 0, n - 1))
        by_arity.setdefault(len(scope), []).append((scope, rng.integers(0, cardinality[scope]), rng.normal()))
    return [Cells(*(np.array(part) for part in zip(*rows, strict=True))) for rows in by_arity.values()]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_asking_for_some_variables_gives_what_asking_for_all_gives(seed):
    rng = np.random.default_rng(seed)
    cardinality = rng.integers(2, 5, 40).astype(np.int32)
    cells = random_cells(rng, cardinality, 150)
    tree = plan(cardinality, [c.scope for c in cells], 1 << 20)
    assert isinstance(tree, Tree)
    log_z, every = log_sum(tree, cardinality, cells, np.ones(40, bool))
    wanted = rng.random(40) < 0.1
    same_log_z, some = log_sum(tree, cardinality, cells, wanted)
    assert same_log_z == pytest.approx(log_z)
    assert sorted(some) == np.flatnonzero(wanted).tolist()
    for v, distribution in some.items():
        np.testing.assert_allclose(distribution, every[v], atol=1e-12)
    value, world = best_world(tree, cardinality, cells)
    assert value == pytest.approx(sum(c.amount[(world[c.scope] == c.value).all(axis=1)].sum() for c in cells))
    assert value <= log_z


PYAGRUM = """
import json, sys
import pyagrum as gum
cardinality, tables = json.load(sys.stdin)
graph = gum.MarkovRandomField()
for v, k in enumerate(cardinality):
    graph.add(gum.RangeVariable(f"v{v}", "", 0, k - 1))
for scope, values in tables:
    graph.addFactor([f"v{v}" for v in scope]).fillWith(values)
engine = gum.ShaferShenoyMRFInference(graph)
engine.makeInference()
print(json.dumps([engine.posterior(f"v{v}").tolist() for v in range(len(cardinality))]))
"""


@pytest.mark.skipif(not find_spec("pyagrum"), reason="an oracle that is not installed")
def test_pyagrum_finds_the_same_marginals():
    rng = np.random.default_rng(3)
    cardinality = rng.integers(2, 4, 60).astype(np.int32)
    cells = random_cells(rng, cardinality, 250)
    tables = {}
    for c in cells:
        for scope, value, amount in zip(c.scope.tolist(), c.value.tolist(), c.amount.tolist(), strict=True):
            tables.setdefault(tuple(scope), np.zeros(cardinality[scope]))[tuple(value)] += amount
    problem = [cardinality.tolist(), [[s, np.exp(t).ravel(order="F").tolist()] for s, t in tables.items()]]
    run = subprocess.run(
        [sys.executable, "-c", PYAGRUM], input=json.dumps(problem), capture_output=True, text=True, check=True
    )
    tree = plan(cardinality, [c.scope for c in cells], 1 << 20)
    _, found = log_sum(tree, cardinality, cells, np.ones(60, bool))
    for v, expected in enumerate(json.loads(run.stdout)):
        np.testing.assert_allclose(found[v], expected, atol=1e-9)


def mid_size(seed, n=45):
    rng = np.random.default_rng(seed)
    blocks = [(str(m), 1 if not m else int(rng.integers(2, 4))) for m in rng.choice(["", "!", "?"], n)]
    first = np.cumsum([0] + [k for _, k in blocks])
    rows = []
    for _ in range(130):
        at = rng.integers(0, n)
        vs = np.unique(np.clip(at + rng.integers(-3, 4, 3), 0, n - 1))
        literals = [int(rng.integers(first[v], first[v + 1]) + 1) * int(rng.choice([-1, 1])) for v in vs]
        rows.append((literals, int(rng.integers(8)), 1))
    by_length = {k: [r for r in rows if len(r[0]) == k] for k in {len(r[0]) for r in rows}}
    weights = [*rng.normal(0, 1, 7).round(3), HARD]
    return network(blocks, [(r, False) for r in by_length.values()], weights=weights)


@pytest.mark.parametrize("method", ["wcsp", "ilp"])
@pytest.mark.parametrize("seed", range(4))
def test_solvers_find_worlds_of_the_same_weight(seed, method):
    net = mid_size(seed)
    by_elimination, by_solver = map_of(net, method="ve"), map_of(net, method=method)
    assert by_solver.methods[method] > 0
    assert by_solver.log_weight == pytest.approx(by_elimination.log_weight, abs=1e-6)
    assert by_solver.status == by_elimination.status == "optimal"
    assert log_weight(net, by_solver.truth) == by_solver.log_weight


def test_wide_clauses_become_chains():
    n = 60
    some_true = network([("", 1)] * n, [([(list(range(1, n + 1)), 0, 1)], False)], weights=[HARD])
    answer = marginals_of(some_true)
    worlds = 2.0**n - 1
    assert answer.log_z == pytest.approx(np.log(worlds), rel=1e-12)
    np.testing.assert_allclose(answer.probability, 2.0 ** (n - 1) / worlds)
    assert answer.largest_table <= 64
    soft = network([("", 1)] * n, [([([-a for a in range(1, n + 1)], 0, 1)], True)], weights=[50.0])
    assert marginals_of(soft).log_z == pytest.approx(np.log(worlds + np.exp(50.0)), rel=1e-12)
    assert map_of(soft).truth.all()


def test_forced_values_cost_no_tables():
    n = 40
    pairs = [([-a, -b], 0, 1) for a in range(1, n + 1) for b in range(1, a)]
    net = network([("", 1)] * n, [(pairs, False), ([([1], 1, 1)], False)], weights=[HARD, HARD])
    answer = marginals_of(net, width_limit=4)
    np.testing.assert_array_equal(answer.probability, np.arange(n) == 0)


def dense(n=40):
    pairs = [([-a, b], 0, 1) for a in range(1, n + 1) for b in range(1, n + 1) if a != b]
    return network([("", 1)] * (n + 1), [(pairs, False), ([([n + 1], 0, 1)], False)], weights=[0.1])


def test_what_is_too_wide_is_refused_with_numbers_and_ways_out():
    with pytest.raises(LimitReached) as caught:
        marginals_of(dense())
    assert "40 unknown atoms" in str(caught.value)
    assert "40 variables (2^40.0 entries; the limit is 2^25)" in str(caught.value)
    assert "closed world" in str(caught.value)
    with pytest.raises(LimitReached):
        map_of(dense(), method="ve")


def test_what_is_too_wide_can_be_left_to_others():
    answer = marginals_of(dense(), too_wide="leave")
    assert np.isnan(answer.probability[:40]).all()
    assert answer.method == ("",) * 40 + ("closed form",)
    assert answer.exact.tolist() == [False] * 40 + [True]
    assert np.isnan(answer.log_z)


def test_only_the_components_asked_for_are_looked_at():
    answer = marginals_of(dense(), np.array([40]))
    assert answer.probability[40] == pytest.approx(1 / (1 + np.exp(-0.1)))
    assert np.isnan(answer.log_z)


def test_a_sweep_solves_long_grids():
    rows, columns = 8, 60
    at = np.arange(rows * columns).reshape(rows, columns)
    edges = np.concatenate(
        [np.stack([at[:, :-1], at[:, 1:]], -1).reshape(-1, 2), np.stack([at[:-1], at[1:]], -1).reshape(-1, 2)]
    )
    tree = plan(np.full(at.size, 2, np.int32), [edges.astype(np.int32)], 1 << 12)
    assert isinstance(tree, Tree)
    assert isinstance(plan(np.full(at.size, 2, np.int32), [edges.astype(np.int32)], 1 << 5), TooWide)


def test_without_toulbar2_there_are_other_ways(monkeypatch):
    monkeypatch.setattr("mlnlite.infer.map.toulbar2.is_available", lambda: False)
    answer = map_of(dense())
    assert "wcsp" not in answer.methods
    assert answer.status == "optimal"
    assert answer.log_weight == pytest.approx(0.1 * (40 * 39 + 1))
    with pytest.raises(MissingPart, match="pip install pytoulbar2"):
        map_of(dense(), method="wcsp")


def test_at_most_one_costs_one_count():
    n = 50
    pairs = [([-a, -b], 0, 1) for a in range(1, n + 1) for b in range(1, a)]
    wishes = [([a], 1, a) for a in range(1, n + 1)]
    net = network([("", 1)] * n, [(pairs, False), (wishes, False)], weights=[10.0, 1.0])
    answer = map_of(net, method="ilp")
    best = max(sum(range(n - k + 1, n + 1)) - 10 * k * (k - 1) / 2 for k in range(n))
    assert answer.log_weight == pytest.approx(best + 10 * len(pairs))
    assert answer.status == "optimal"


def test_time_limits_give_a_world_and_a_bound():
    rng = np.random.default_rng(0)
    n = 300
    rows = [(np.sort(rng.choice(n, 3, replace=False)) + 1, int(rng.integers(3)), 1) for _ in range(1400)]
    rows = [([int(a) * int(rng.choice([-1, 1])) for a in literals], w, c) for literals, w, c in rows]
    net = network([("", 1)] * n, [(rows, False)], weights=[-1.1, 0.7, -0.4])
    answer = map_of(net, time_limit=1)
    assert answer.status == "feasible"
    assert 0 < answer.gap < 400
    assert answer.log_weight == log_weight(net, answer.truth)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), limit=st.sampled_from([1 << 6, 1 << 20]))
def test_plans_are_clique_trees(seed, limit):
    rng = np.random.default_rng(seed)
    cardinality = rng.integers(2, 4, 25).astype(np.int32)
    cells = random_cells(rng, cardinality, 60)
    tree = plan(cardinality, [c.scope for c in cells], limit)
    if isinstance(tree, TooWide):
        return
    for scope in (row for c in cells for row in c.scope.tolist()):
        assert any(set(scope) <= set(clique) for clique in tree.scopes)
    eliminated = [v for scope, k in zip(tree.scopes, tree.n_eliminated, strict=True) for v in scope[:k]]
    assert sorted(eliminated) == list(range(25))
    for k, (scope, count, parent) in enumerate(zip(tree.scopes, tree.n_eliminated, tree.parents, strict=True)):
        assert list(scope) == sorted(scope, key=lambda v: tree.position[v])
        assert parent > k or (parent == -1 and count == len(scope))
        assert set(scope[count:]) <= set(tree.scopes[parent]) or parent == -1
        assert tree.sizes[k] == np.prod(cardinality[list(scope)]) <= limit
