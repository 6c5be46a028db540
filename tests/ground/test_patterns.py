"""Counting factors keep every count; lazily found violations are those that listing finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.ground.lazy import violations, world_evidence
from mlnlite.ground.patterns import with_counts
from mlnlite.infer.score import counts


def counted(network, truth):
    """True groundings of the counting factors, by definition."""
    total = np.zeros(len(network.weights), np.int64)
    for block in network.counts:
        holds = (truth[np.abs(block.literals) - 1] == (block.literals > 0)).sum(axis=1)
        np.add.at(total, block.weight, block.true[holds] * block.count)
    return total


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(["!A(x, y) v !A(x, z)", "A(x, y) v A(x, z)", "A(x, y) ^ A(x, z)"]), st.integers(0, 99))
def test_pairs_become_counts(formula, seed):
    model = ml.model_from_text(
        f"A(s, p)\ns = {{S1, S2, S3}}\np = {{P1, P2, P3, P4, P5}}\n1.5 {formula} v y = z\n0.3 A(x, P1) v A(x, P2)"
        if "^" not in formula
        else f"A(s, p)\ns = {{S1, S2, S3}}\np = {{P1, P2, P3, P4, P5}}\n1.5 {formula} ^ y != z\n0.3 A(x, P1)"
    )
    network = ml.ground(model, ml.evidence_from_text("A(S1, P3)\n!A(S2, P1)", model=model))
    smaller = with_counts(network)
    assert len(smaller.counts) >= 1
    assert smaller.n_factors < network.n_factors
    assert smaller.n_open.tolist() == network.n_open.tolist()
    truth = np.random.default_rng(seed).random(network.n_atoms) < 0.5
    without = ml.Network(**{**{n: getattr(smaller, n) for n in smaller.__slots__}, "counts": ()})
    assert (counts(without, truth) + counted(smaller, truth)).tolist() == counts(network, truth).tolist()


def test_nothing_is_counted_where_no_pattern_is_complete():
    model = ml.model_from_text("A(p)\nF(p, p)\n1 F(x, y) ^ A(x) => A(y)")
    evidence = ml.closed(ml.evidence_from_text("F(A, B)\nF(B, C)\nF(C, D)", model=model), ["F"])
    network = ml.ground(model, evidence)
    assert with_counts(network).n_factors == network.n_factors
    assert with_counts(network).counts == ()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_violations_are_the_false_groundings(seed):
    model = ml.model_from_text("S(r, r)\nr = {A, B, C, D, E}\n2 S(x, y) ^ S(y, z) => S(x, z)\n-0.5 S(x, y)")
    network = ml.ground(model, ml.evidence_from_text("S(A, B)\n!S(B, C)", model=model))
    truth = np.random.default_rng(seed).random(network.n_atoms) < 0.5
    found = violations(network, world_evidence(network, truth), 0)
    n_false = int((network.n_groundings - counts(network, truth))[0])
    assert sum(len(piece.row) for piece in found) == n_false


def test_violations_stop_at_the_most():
    model = ml.model_from_text("S(r, r)\nr = {A, B, C, D, E}\n2 S(x, y) => S(y, x)")
    network = ml.ground(model, ml.no_evidence(model))
    truth = np.zeros(network.n_atoms, bool)
    truth[:8] = True
    world = world_evidence(network, truth)
    assert sum(len(p.row) for p in violations(network, world, 0, most=2)) == 2
    with pytest.raises(IndexError):
        violations(network, world, 7)
