"""The proof that no elimination order is narrow enough, against all orders."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.infer.exact.width import is_tangled, unavoidable_table
from mlnlite.infer.reduce.potentials import potentials_of


@st.composite
def graphs(draw):
    n = draw(st.integers(1, 6))
    pairs = [(a, b) for a in range(n) for b in range(a)]
    edges = draw(st.lists(st.sampled_from(pairs), unique=True)) if pairs else []
    return n, edges, draw(st.lists(st.sampled_from([1.0, 1.5, 2.0, 3.0]), min_size=n, max_size=n))


def neighbours(n, edges):
    return [{b if a == v else a for a, b in edges if v in (a, b)} for v in range(n)]


def largest_table(order, near, bits):
    """log2 size of the largest table that an order of elimination makes."""
    near, largest = [set(vs) for vs in near], 0.0
    for v in order:
        largest = max(largest, bits[v] + sum(bits[u] for u in near[v]))
        for u in near[v]:
            near[u] = (near[u] | near[v]) - {u, v}
    return largest


@settings(max_examples=150, deadline=None)
@given(graph=graphs(), limit=st.sampled_from([1.0, 2.0, 3.0, 4.5, 6.0]))
def test_what_is_unavoidable_is_in_every_order(graph, limit):
    n, edges, bits = graph
    narrowest = min(largest_table(order, neighbours(n, edges), bits) for order in permutations(range(n)))
    found = unavoidable_table(neighbours(n, edges), list(bits), limit)
    if found is not None:
        assert limit < found[1] <= narrowest


def test_cliques_and_dense_minors_are_seen():
    clique = [set(range(8)) - {v} for v in range(8)]
    assert unavoidable_table(clique, [1.0] * 8, 7.0) == (8, 8.0)
    pairs = [(a, b) for a in range(8) for b in range(a)]
    subdivided = neighbours(36, [e for v, (a, b) in enumerate(pairs, 8) for e in ((v, a), (v, b))])
    assert unavoidable_table(subdivided, [1.0] * 36, 7.0) == (8, 8.0)


def test_a_forest_is_narrow():
    path = [{v - 1, v + 1} - {-1, 100} for v in range(100)]
    assert unavoidable_table(path, [1.0] * 100, 2.0) is None


def test_counts_over_rows_and_columns_are_a_tangle():
    k = 12
    names = ", ".join(f"C{i}" for i in range(k))
    text = f"A(r, s)\nr = {{{names}}}\ns = {{{names}}}\n"
    model = ml.model_from_text(text + "0.7 count(A(x, y) | y) <= 3\n-0.4 count(A(x, y) | x) >= 5\n0.1 A(x, y)\n")
    network = ml.ground(model, ml.no_evidence(model))
    potentials = potentials_of(network, chained=True)
    everything = np.ones(len(potentials.cardinality), np.bool_)
    assert is_tangled(potentials, everything, 2**10)
    assert not is_tangled(potentials, everything, 2**14)
    nothing = np.zeros(len(potentials.cardinality), np.bool_)
    assert not is_tangled(potentials, nothing, 2**10)
