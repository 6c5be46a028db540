"""Counts and quantifiers over many atoms: never clauses by the dozen or tables, and always what enumeration says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.engines.duckdb import DuckDBEngine
from mlnlite.engines.numpy import NumpyEngine
from mlnlite.ground.condition import condition
from mlnlite.ground.count import count_true
from mlnlite.ground.lazy import world_evidence
from mlnlite.ground.patterns import without_counts
from mlnlite.infer.score import counts, log_weight
from tests import brute

DECLARATIONS = """P(a)
Q(a, b)
S(b)
F(a, b!)
a = {A1, A2}
b = {B1, B2, B3, B4, B5}
"""
BODIES = (
    "Q(x, y)", "!Q(x, y)", "(Q(x, y) ^ S(y))", "(Q(x, y) v S(y))", "(Q(x, y) ^ y != z)", "F(x, y)", "(S(y) <=> Q(x, y))"
)  # fmt: skip


@st.composite
def counted(draw):
    body = draw(st.sampled_from(BODIES))
    if draw(st.booleans()):
        return f"{draw(st.sampled_from(['EXIST', 'FORALL']))} y {body}"
    sign = draw(st.sampled_from(["<=", ">=", "=", "!=", "<", ">"]))
    return f"count({body} | y) {sign} {draw(st.integers(0, 5))}"


@st.composite
def formulas(draw):
    a, b = draw(counted()), draw(counted())
    return draw(
        st.sampled_from(
            [a, f"P(x) => {a}", f"P(x) <=> ({a})", f"P(x) ^ ({a})", f"({a}) v ({b})", f"({a}) <=> ({b})",
             f"Q(x, B1) => {a}", f"S(z) ^ Q(x, z) => {a}"]
        )
    )  # fmt: skip


@st.composite
def texts(draw):
    lines = [DECLARATIONS]
    for _ in range(draw(st.integers(1, 2))):
        formula, weight = draw(formulas()), draw(st.sampled_from([-1.5, 0.7]))
        lines.append(f"({formula})." if draw(st.integers(0, 4)) == 0 else f"{weight} {formula}")
    return "\n".join(lines) + "\n"


@st.composite
def facts(draw):
    lines = [f"{draw(st.sampled_from(['', '!']))}S(B{i})" for i in range(1, 6) if draw(st.booleans())]
    lines += [
        f"{draw(st.sampled_from(['', '!']))}Q(A{i}, B{j})"
        for i in (1, 2) for j in range(1, 6) if draw(st.booleans())
    ]  # fmt: skip
    return "\n".join([*lines, *(["P(A1)"] if draw(st.booleans()) else [])])


def grounded(model, evidence, **options):
    """The network; gives the example up if there is none (cases that connect too many atoms, or a contradiction)."""
    try:
        return ml.ground(model, evidence, **options)
    except (ml.Contradiction, ml.LimitReached):
        assume(False)


def truths(network, n=12):
    rng = np.random.default_rng(0)
    return rng.random((n, network.n_atoms)) < rng.choice([0.1, 0.5, 0.9], (n, 1))


def world_of(network, truth):
    """A world as `brute` wants it."""
    evidence = world_evidence(network, truth)
    known = brute.facts(evidence)
    return {a: known.get(a, False) for a in brute.atoms(network.model, evidence)}


@settings(max_examples=60, deadline=None)
@given(texts(), facts(), st.booleans(), st.sampled_from([NumpyEngine] * 5 + [DuckDBEngine]))
def test_counts_equal_enumeration(text, known, closes, engine):
    model = ml.model_from_text(text)
    evidence = ml.closed(ml.evidence_from_text(known, model=model), ["S"] if closes else [])
    network = grounded(model, evidence, engine=engine())
    naive = replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))
    for truth in truths(network):
        world = world_of(network, _with_values(network, truth))
        true, total = brute.counts(naive, evidence, world)
        found = counts(network, _with_values(network, truth))
        assert found.tolist() == true.tolist()
        assert network.n_groundings.tolist() == total.tolist()
        assert (found <= network.decided_true + network.n_open).all()


def _with_values(network, truth):
    """The truth values with one value for each block."""
    truth = truth.copy()
    for v in np.flatnonzero(network.block):
        members = np.flatnonzero(network.variable == v)
        truth[members] = np.arange(len(members)) == truth[members].sum() % len(members)
    return truth


@settings(max_examples=40, deadline=None)
@given(texts(), facts(), st.integers(0, 1000))
def test_conditioning_and_tables_keep_log_weights(text, known, seed):
    model = ml.model_from_text(text)
    network = grounded(model, ml.evidence_from_text(known, model=model))
    rng = np.random.default_rng(seed)
    truth = _with_values(network, rng.random(network.n_atoms) < 0.5)
    given_ = np.where(rng.random(network.n_atoms) < 0.5, truth, -1).astype(np.int8)
    smaller = condition(network, given_)
    left = np.isin(network.atoms, smaller.atoms)
    assert counts(smaller, truth[left]).tolist() == counts(network, truth).tolist()
    plain = without_counts(network)
    assert plain.counts == ()
    assert plain.n_open.tolist() == network.n_open.tolist()
    assert log_weight(plain, truth) == pytest.approx(log_weight(network, truth))


@settings(max_examples=40, deadline=None)
@given(texts(), st.integers(0, 1000))
def test_scoring_counts_the_same(text, seed):
    model = ml.model_from_text(text)
    network = grounded(model, ml.no_evidence(model))
    truth = _with_values(network, np.random.default_rng(seed).random(network.n_atoms) < 0.5)
    assert count_true(network.model, world_evidence(network, truth)).tolist() == counts(network, truth).tolist()


WIDE = "P(a)\nQ(a, b)\na = {A1, A2, A3}\nb = {" + ", ".join(f"B{i}" for i in range(60)) + "}\n"


@pytest.mark.parametrize(
    ("formula", "n_factors", "kinds"),
    [
        ("EXIST y Q(x, y)", 3, "clauses"),
        ("P(x) => EXIST y Q(x, y)", 3, "clauses"),
        ("P(x) <=> EXIST y Q(x, y)", 3, "counts"),
        ("count(Q(x, y) | y) = 30", 3, "counts"),
        ("P(x) => count(Q(x, y) | y) >= 25", 3, "counts"),
        ("FORALL y !Q(x, y)", 3, "clauses"),
    ],
)
def test_sixty_atoms_are_one_factor(formula, n_factors, kinds):
    model = ml.model_from_text(f"{WIDE}1.5 {formula}\n")
    network = ml.ground(model, ml.no_evidence(model))
    assert network.n_factors == n_factors
    assert sum(len(f.weight) for f in getattr(network, kinds)) == n_factors
    world = np.zeros(network.n_atoms, bool)
    assert counts(network, world).tolist() == count_true(network.model, world_evidence(network, world)).tolist()
    known = np.full(network.n_atoms, -1, np.int8)
    known[-30:] = 0
    assert condition(network, known).n_factors == n_factors


def test_a_count_over_connected_atoms_names_its_place():
    model = ml.model_from_text(f"{WIDE}R(b)\n1.5 count(Q(x, y) ^ R(y) | y) >= 20\n")
    with pytest.raises(ml.LimitReached, match=r"formula 1 cannot be grounded"):
        ml.ground(model, ml.no_evidence(model))
    closed = ml.closed(ml.evidence_from_text("\n".join(f"R(B{i})" for i in range(40)), model=model), ["R"])
    (block,) = ml.ground(model, closed).counts
    assert block.literals.shape == (3, 40)


def test_a_hard_count_against_evidence_names_the_binding():
    model = ml.model_from_text(f"{WIDE}1 count(Q(x, y) | y) <= 3\nP(x) => count(Q(x, y) | y) <= 3.\n")
    evidence = ml.evidence_from_text("P(A2)\n" + "\n".join(f"Q(A2, B{i})" for i in range(5)), model=model)
    with pytest.raises(ml.Contradiction, match=r"formula 2 .* \(x = A2\)"):
        ml.ground(model, evidence)
