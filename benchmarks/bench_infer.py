"""Exact inference on networks of the sizes that users have; run with `pytest benchmarks/bench_infer.py`."""

from dataclasses import replace

import numpy as np
import pytest

from mlnlite.ground.network import Clauses
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.map.ladder import map_of
from tests.networks import network


def with_clauses(blocks, blocks_of_clauses, weights):
    """A network with clauses given as arrays: (literals, weight of each, negated)."""
    empty = network(blocks, weights=weights)
    clauses = tuple(
        Clauses(np.asarray(literals, np.int32), np.asarray(w, np.int32), np.ones(len(literals), np.int64), negated)
        for literals, w, negated in blocks_of_clauses
    )
    total = np.zeros(len(weights), np.int64)
    for c in clauses:
        np.add.at(total, c.weight, c.count)
    return replace(empty, clauses=clauses, n_groundings=total)


def handover(seed=0, sizes=(4, 4, 12, 6, 2, 3), n_formulas=4430):
    """31 atoms in groups; conjunctions of at most one atom of each group."""
    rng = np.random.default_rng(seed)
    first = np.concatenate([[0], np.cumsum(sizes)])
    found = set()
    while len(found) < n_formulas:
        groups = rng.choice(len(sizes), rng.integers(1, len(sizes) + 1), replace=False)
        found.add(tuple(sorted(-int(first[g] + rng.integers(sizes[g]) + 1) for g in groups)))
    weights = rng.normal(size=n_formulas)
    clauses = []
    for k in range(1, len(sizes) + 1):
        rows = [(w, f) for w, f in enumerate(sorted(found)) if len(f) == k]
        clauses.append((np.sort([f for _, f in rows], axis=1)[:, ::-1], [w for w, _ in rows], True))
    return with_clauses([("", 1)] * int(first[-1]), clauses, weights)


def smokers(n, n_friends, seed=0):
    """Smoking spreads among friends, causes cancer; `n_friends` pairs of known friends."""
    rng = np.random.default_rng(seed)
    people = np.arange(1, n + 1)
    a, b = rng.integers(1, n + 1, (2, n_friends))
    a, b = np.minimum(a, b)[a != b], np.maximum(a, b)[a != b]
    one, two = np.zeros(len(a)), np.zeros(n)
    clauses = [
        (np.stack([-a, b], 1), one + 1, False),
        (np.stack([a, -b], 1), one + 1, False),
        (np.stack([-people, people + n], 1), two, False),
        (people[:, None], two + 2, False),
    ]
    return with_clauses([("", 1)] * (2 * n), clauses, [1.5, 1.1, -0.7])


def citations(n=5000, n_classes=10, n_references=2250, seed=0):
    """Papers with one class each; references tend to stay within a class."""
    rng = np.random.default_rng(seed)
    a, b = rng.integers(0, n, (2, n_references))
    a, b = a[a != b], b[a != b]
    classes = np.arange(n_classes)
    same = np.stack([-(a[:, None] * n_classes + classes + 1), b[:, None] * n_classes + classes + 1], -1).reshape(-1, 2)
    same = np.take_along_axis(same, np.argsort(np.abs(same), axis=1), axis=1)
    words = rng.integers(1, n * n_classes + 1, (3 * n, 1))
    return with_clauses(
        [("!", n_classes)] * n,
        [(same, np.zeros(len(same)), False), (words, np.ones(len(words)), False)],
        [1.5, 0.7],
    )


NETWORKS = {
    "handover, 31 atoms": handover,
    "smokers, 50,000 people": lambda: smokers(50_000, 25_000),
    "chain of 20,000": lambda: with_clauses(
        [("", 1)] * 20_000,
        [(np.stack([-np.arange(1, 20_000), np.arange(2, 20_001)], 1), np.zeros(19_999), False)],
        [1.2],
    ),
    "citations, 5,000 papers": citations,
}


@pytest.mark.parametrize("name", NETWORKS)
def test_marginals(benchmark, name):
    net = NETWORKS[name]()
    answer = benchmark.pedantic(marginals_of, (net,), rounds=3)
    assert answer.exact.all()


def test_marginals_of_the_six_regions(benchmark):
    net = handover()
    answer = benchmark.pedantic(marginals_of, (net, np.arange(20, 26)), rounds=3)
    assert answer.exact[20:26].all()


@pytest.mark.parametrize("name", NETWORKS)
def test_best_world(benchmark, name):
    net = NETWORKS[name]()
    answer = benchmark.pedantic(map_of, (net,), rounds=3)
    assert answer.status == "optimal"
