"""Groups of atoms that exclude each other, hard or nearly so, against listing all worlds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.ground.patterns import with_counts
from mlnlite.infer.approach import BOUNDED, Approach
from mlnlite.infer.exact.bounded import bounded_marginals
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.marginal.ladder import solve
from mlnlite.infer.reduce.exclusion import exclusion
from mlnlite.model.formulas import All, AtomRef
from tests.networks import network, world_weight, worlds

NO_LIMIT = (1 << 20, None)


@st.composite
def grouped(draw):
    """Groups of atoms, hard or soft, among other atoms and formulas of all kinds."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    sizes = [int(s) for s in rng.integers(2, 5, rng.integers(1, 4))]
    n = sum(sizes) + int(rng.integers(0, 3))
    weights = [6.5, np.inf, 0.7, *rng.normal(0, 1.5, 4).round(2).tolist()]
    counts, first = [], 1
    for size in sizes:
        j, sign = np.arange(size + 1), int(rng.choice([-1, 1]))
        worth = (-j * (j - 1) // 2 + size * (size - 1) // 2)[::sign]
        hard = int(rng.integers(2))
        counts.append((worth, [([sign * a for a in range(first, first + size)], hard, int(rng.integers(1, 3)))]))
        first += size
    clauses = []
    for _ in range(rng.integers(2, 8)):
        k, w = int(rng.integers(1, 4)), int(rng.choice([1, *range(2, len(weights))], p=[0.1, *[0.9 / 5] * 5]))
        atoms = rng.choice(n, min(k, n), replace=False) + 1
        literals = [int(a) * int(rng.choice([-1, 1])) for a in atoms]
        clauses.append(([(literals, w, int(rng.integers(1, 3)))], bool(w != 1 and rng.random() < 0.3)))
    if rng.random() < 0.5:
        clauses.append(([(list(range(1, sizes[0] + 1)), int(rng.integers(1, 3)), 1)], False))
    tables = [(rng.random((2, 2)) < 0.5, [([int(a) for a in rng.choice(n, 2, replace=False)], 3, 1)])]
    return network([("", 1)] * n, clauses, tables, weights, counts=counts)


@settings(max_examples=150, deadline=None)
@given(grouped())
def test_the_truth_is_within_the_bound(net):
    every = worlds(net)
    logs = np.array([world_weight(net, w) for w in every])
    found = bounded_marginals(net, None, np.ones(net.n_atoms, bool), 1.0, NO_LIMIT)
    if found is None or np.isneginf(logs).all():
        return
    log_z = np.logaddexp.reduce(logs)
    truth = np.exp(logs - log_z) @ every
    answer = found[1]
    p, slack = answer.probability, answer.slack
    assert (p * (1 - slack) - 1e-9 <= truth).all()
    assert (truth <= p * (1 - slack) + slack + 1e-9).all()
    if (slack == 0).all():
        assert answer.log_z == pytest.approx(log_z, abs=1e-9)


def ring(weight, n=5, m=4):
    """Papers in a ring, each with topics that exclude each other; neighbours tend to agree."""
    topics = np.arange(n * m).reshape(n, m) + 1
    pairs = [([-a, -b], 0, 1) for row in topics.tolist() for i, a in enumerate(row) for b in row[:i]]
    same = [([-int(a), int(b)], 1, 1) for i in range(n) for a, b in zip(topics[i], topics[i - 1], strict=True)]
    units = [([int(a)], 2, 1) for a in topics[:, 0]]
    return network([("", 1)] * (n * m), [(pairs, False), (same, False), (units, False)], weights=[weight, 1.2, 0.8])


@pytest.mark.parametrize("weight", [12.0, np.inf])
def test_components_that_are_too_wide_are_answered(weight):
    net = ring(weight)
    exact = marginals_of(net)
    approach = Approach("exact" if weight == np.inf else "auto", width_limit=1 << 8)
    both = All((AtomRef(0), AtomRef(5)))
    solution = solve(net, np.arange(net.n_atoms), [both], approach)
    expected = solve(net, np.arange(net.n_atoms), [both], Approach("exact")).columns.probability
    np.testing.assert_array_less(np.abs(solution.columns.probability - expected), solution.columns.error + 1e-9)
    assert (solution.columns.low <= expected + 1e-9).all()
    assert (solution.columns.high >= expected - 1e-9).all()
    if weight == np.inf:
        assert solution.columns.exact.all()
        assert solution.log_z == pytest.approx(exact.log_z, abs=1e-9)
    else:
        assert set(solution.methods) == {BOUNDED}
        assert 0 < solution.columns.error.max() < 5e-4
        assert np.isnan(solution.log_z)


def test_worlds_with_two_are_not_left_out_if_they_matter():
    net = ring(3.2)
    found = solve(net, np.arange(net.n_atoms), [], Approach(width_limit=1 << 9, time_limit=1.0))
    assert BOUNDED not in found.methods


def test_groups_that_must_have_two_stay_as_they_are():
    pairs = [([-1, -2], 0, 1), ([-1, -3], 0, 1), ([-2, -3], 0, 1)]
    both = [([1], 1, 1), ([2], 1, 1)]
    net = network([("", 1)] * 3, [(pairs, False), (both, False)], weights=[9, np.inf])
    assert exclusion(with_counts(net), np.ones(3, bool)) is None


def test_a_result_says_how_much_may_be_left_out():
    model = ml.model_from_text(
        "topic = {" + ", ".join(f"T{i}" for i in range(9)) + "}\nAbout(paper, topic)\n*Cites(paper, paper)\n"
        "12 !About(p, s) v !About(p, t) v s = t\n1.5 Cites(p, q) ^ About(p, t) => About(q, t)\n0.5 About(p, T1)\n"
    )
    cites = "\n".join(f"Cites(P{i}, P{j})" for i in range(6) for j in range(i))
    result = ml.marginal(model, ml.evidence_from_text(cites, model=model), "About(P0, t)", width_limit=1 << 21)
    assert result.status.startswith("exact to within ")
    assert set(result.methods) == {BOUNDED}
    assert " within " in result.to_text()
    assert ((result.low < result.probabilities) & (result.probabilities < result.high)).all()
    for row in result.to_dict()["marginals"]:
        assert 0 <= row["low"] < row["probability"] < row["high"] <= row["low"] + 2 * row["error"]
        assert "r_hat" not in row


def test_one_atom_alone_is_answered_within_the_same_bound():
    net = with_counts(ring(7.0))
    everything = np.ones(net.n_atoms, bool)
    _, whole = bounded_marginals(net, None, everything, 1.0, NO_LIMIT)
    for atom in range(net.n_atoms):
        _, found = bounded_marginals(net, np.array([atom]), everything, 1.0, NO_LIMIT)
        assert found.probability[atom] == pytest.approx(whole.probability[atom])
        assert found.slack[atom] == pytest.approx(whole.slack[atom])
    _, narrow = bounded_marginals(net, None, everything, 1.0, (125, None))  # enough for the sum, not for the bound
    assert narrow.wide
    assert np.isnan(narrow.probability).all()
