"""Counts over many atoms, against sums that need no network."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.errors import Contradiction, LimitReached
from mlnlite.infer.exact.formula import formula_probability
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.reduce.counting import diagram
from mlnlite.infer.sample.sampling import Effort, sample
from mlnlite.infer.sample.worlds import can_differ, start_worlds
from mlnlite.model.formulas import All, AtomRef
from tests.networks import network, world_weight, worlds


def by_convolution(odds, worth):
    """Log Z and marginals of independent atoms with given log-odds whose count is worth something."""

    def ways(some):
        total = np.zeros(1)
        for o in some:
            total = np.logaddexp(np.append(total, -np.inf), np.append(-np.inf, total + o))
        return total

    log_z = np.logaddexp.reduce(ways(odds) + worth)
    rest = [np.append(-np.inf, ways(np.delete(odds, i)) + odds[i]) + worth for i in range(len(odds))]
    return log_z, np.exp([np.logaddexp.reduce(r) - log_z for r in rest])


@pytest.mark.parametrize("weight", [-0.1, 0.02, np.inf])
@pytest.mark.parametrize("shape", ["pairs", "at most", "odd"])
def test_a_count_over_many_atoms(shape, weight):
    m, rng = 120, np.random.default_rng(1)
    j = np.arange(m + 1)
    true = {"pairs": m * (m - 1) // 2 - j * (j - 1) // 2, "at most": (j <= 30) * 1, "odd": j % 2}[shape]
    odds = rng.normal(0, 1, m).round(3)
    units = [([a + 1], 1 + a, 1) for a in range(m)]
    net = network([("", 1)] * m, [(units, False)], weights=[weight, *odds], counts=[(true, [(range(1, m + 1), 0, 1)])])
    worth = np.where(true == true.max(), 0.0, -np.inf) if weight == np.inf else weight * true
    log_z, expected = by_convolution(odds, worth)
    found = marginals_of(net)
    assert found.log_z == pytest.approx(log_z, abs=1e-8)
    np.testing.assert_allclose(found.probability, expected, atol=1e-9)
    assert found.largest_table <= 4 * m
    both = formula_probability(net, All((AtomRef(0), AtomRef(1))))
    assert 0 <= both <= min(expected[:2])


@settings(max_examples=60, deadline=None)
@given(st.lists(st.sampled_from([-np.inf, 0.0, 1.0, 2.0]), min_size=2, max_size=9), st.data())
def test_a_diagram_finds_the_worth_of_every_count(worth, data):
    worth, steps = np.array(worth), [1] * (len(worth) - 1)
    for _ in range(data.draw(st.integers(0, len(steps) - 1))):
        steps[-2:] = [sum(steps[-2:])]
    plan = diagram(worth, np.array(steps))
    for bits in np.ndindex(*[2] * len(steps)):
        state = 0 if plan else -1
        for bit, states in zip(bits, plan.after if plan else (), strict=False):
            state = int(states[state, bit]) if state >= 0 else -1
        assert (plan.worth[state] if state >= 0 else -np.inf) == worth[np.dot(bits, steps)]


def test_states_that_do_not_matter_are_one():
    at_least_one = diagram(np.array([-np.inf] + [0.0] * 100), np.ones(100, int))
    assert max(len(states) for states in at_least_one.after) == 2


def hard_counts():
    """Exactly two, or four, of five; and a block among them."""
    true = np.array([0, 0, 1, 0, 1, 0])
    return network(
        [("", 1)] * 3 + [("!", 3)],
        [([([1], 1, 1), ([4], 1, 1)], False)],
        weights=[np.inf, 0.7],
        counts=[(true, [([1, 2, -3, 4, 5], 0, 1)])],
    )


def test_chains_start_and_stay_where_hard_counts_allow():
    net = hard_counts()
    for world in start_worlds(net, 20, np.random.default_rng(0)):
        assert np.isfinite(world_weight(net, world))
    possible = np.array([w for w in worlds(net) if np.isfinite(world_weight(net, w))])
    at = possible[0]
    assert can_differ(net, np.arange(net.n_atoms), at).tolist() == (possible != at).any(axis=0).tolist()
    found = sample(net, np.ones(net.n_variables, bool), (np.arange(net.n_atoms), ()), "mcsat", Effort(0.01, 30.0))
    assert (np.abs(found.columns.probability - marginals_of(net).probability) < 5 * found.columns.error + 1e-9).all()


def test_a_count_in_conflict_is_named():
    true = np.array([0, 0, 0, 1])
    units = [([1], 1, 1)]
    net = network([("", 1)] * 3, [(units, False)], weights=[np.inf] * 2, counts=[(true, [([-1, 2, 3], 0, 1)])])
    for ask in (marginals_of, map_of, lambda n: start_worlds(n, 2, np.random.default_rng(0))):
        with pytest.raises(Contradiction) as caught:
            ask(net)
        assert [d.message.partition(":")[0] for d in caught.value.diagnostics] == ["formula 1", "formula 2"]


def test_soft_exclusion_of_many_is_exact():
    names = ", ".join(f"C{i}" for i in range(40))
    model = ml.model_from_text(f"A(p, c)\nc = {{{names}}}\np = {{P}}\n2 !A(x, y) v !A(x, z) v y = z\n0.3 A(x, C7)\n")
    evidence = ml.evidence_from_text("", model=model)
    found = ml.marginal(model, evidence, "A")
    assert found.status == "exact"
    j = np.arange(41)
    odds = np.where(np.arange(40) == 7, 0.3, 0.0)
    _, expected = by_convolution(odds, 2.0 * (40 * 39 - j * (j - 1)))
    np.testing.assert_allclose(found.probabilities, expected, atol=1e-9)
    assert ml.marginal(model, evidence, "A", method="exact").log_z == pytest.approx(found.log_z)


def test_entangled_counts_are_refused_not_wrong():
    n = 60
    rng = np.random.default_rng(0)
    rows = [(sorted(rng.choice(np.arange(1, n + 1), 20, replace=False).tolist()), 0, 1) for _ in range(40)]
    net = network([("", 1)] * n, weights=[0.1], counts=[(np.arange(21) ** 2, rows)])
    with pytest.raises(LimitReached):
        marginals_of(net, width_limit=1 << 16)
