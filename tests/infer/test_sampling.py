"""Samplers against exact answers: their errors are as large as they say, and their kernels do what is written."""

from importlib import import_module

import numpy as np
import pytest
from hypothesis import given, settings

import mlnlite as ml
from mlnlite.ground.patterns import with_counts
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.sample.factors import factors_of
from mlnlite.infer.sample.gibbs import gibbs_draws, log_weights, owners, start, states
from mlnlite.infer.sample.mcsat import chain as chain_module
from mlnlite.infer.sample.mcsat.chain import jump, mcsat_draws
from mlnlite.infer.sample.sampling import Effort, sample
from mlnlite.infer.sample.worlds import start_worlds
from tests.networks import network, networks, world_weight, worlds

NOTHING = np.zeros((0, 2), np.int32)


def everything(net):
    return np.ones(net.n_variables, bool), (np.arange(net.n_atoms), ())


def smokers(n, n_friends, seed=0):
    """Smoking spreads along pairs of friends and causes cancer."""
    rng = np.random.default_rng(seed)
    pairs = {tuple(sorted(p)) for p in rng.integers(0, n, (n_friends, 2)).tolist() if p[0] != p[1]}
    both = [([-a - 1, b + 1], 0, 1) for a, b in pairs] + [([a + 1, -b - 1], 0, 1) for a, b in pairs]
    own = [([-a - 1, a + n + 1], 1, 1) for a in range(n)]
    alone = [([a + 1], 2, 1) for a in range(n)]
    return network([("", 1)] * (2 * n), [(both + own, False), (alone, False)], weights=[1.0, 1.1, -0.4])


def nearly_hard(n=40, weight=7.0):
    """Chains of four atoms, nearly hard, their ends pulled apart."""
    links = [([-a - 1, a + 2], 0, 1) for a in range(4 * n) if a % 4 != 3]
    links += [([a + 1, -a - 2], 0, 1) for a in range(4 * n) if a % 4 != 3]
    pulls = [([a + 1], 1 + a % 3, 1) for a in range(4 * n) if a % 4 in (0, 3)]
    return network([("", 1)] * (4 * n), [(links, False), (pulls, False)], weights=[weight, 0.6, -0.5, 0.3])


def one_hot(n=60, size=4):
    """Blocks whose neighbours like to agree."""
    same = [
        ([-(v * size + k) - 1, (v + 1) * size + k + 1], 0, 1) for v in range(n - 1) for k in range(size) if v % 6 != 5
    ]
    words = [([v * size + (v * v) % size + 1], 1, 1) for v in range(n)]
    return network([("!", size)] * n, [(same, False), (words, False)], weights=[1.5, 0.8])


def two_modes(n=24):
    """Triples whose atoms are all true or all false, by a hard formula, so that no single flip is possible."""
    rows = [[3 * i + j for j in range(3)] for i in range(n)]
    truth = np.zeros((2, 2, 2), bool)
    truth[0, 0, 0] = truth[1, 1, 1] = True
    pulls = [([3 * i + 1], 1 + i % 4, 1) for i in range(n)]
    pairs = [([-3 * i - 1, 3 * i + 4], 5, 1) for i in range(n - 1) if i % 3 != 2]
    return network(
        [("", 1)] * (3 * n), [(pulls, False), (pairs, False)], [(truth, [(r, 0, 1) for r in rows])],
        weights=[np.inf, 0.4, -1.2, 2.0, 0.0, 1.0],
    )  # fmt: skip


CASES = {
    "smokers": (lambda: smokers(150, 160), ("gibbs", "mcsat", "tempering")),
    "nearly hard": (lambda: nearly_hard(100), ("mcsat",)),
    "harder still": (lambda: nearly_hard(100, 10.0), ("mcsat",)),
    "one hot": (lambda: one_hot(90), ("gibbs", "mcsat")),
    "two modes": (lambda: two_modes(120), ("mcsat",)),
}


def test_errors_of_trips_are_as_large_as_they_say(monkeypatch):
    """MC-SAT with no slice small enough to list its worlds, trips as many and as long as ever; 400 errors."""
    monkeypatch.setattr(chain_module, "LISTED", -(1 << 40))
    verify_calibrated(nearly_hard(100), "mcsat", seeds=(1,))


@pytest.mark.parametrize(("name", "sampler"), [(n, s) for n, (_, samplers) in CASES.items() for s in samplers])
def test_errors_are_as_large_as_they_say(name, sampler):
    """Many atoms, because those of a chain or triple are off together: 300 to 500 errors that are independent."""
    verify_calibrated(CASES[name][0](), sampler)


def verify_calibrated(net, sampler, seeds=(1, 2, 3, 4)):
    exact = marginals_of(net).probability
    scores = []
    for seed in seeds:
        found = sample(net, *everything(net), sampler, Effort(0.02, 300.0, seed=seed))
        assert found.ending == "precise"
        sure = found.columns.exact | (found.columns.error == 0)
        assert np.abs(found.columns.probability - exact)[sure].max(initial=0) < 1e-6
        scores.append(((found.columns.probability - exact) / np.where(sure, 1, found.columns.error))[~sure])
    score = np.concatenate(scores)
    assert np.abs(score).max() < 5
    assert 0.92 <= np.mean(np.abs(score) < 1.96) <= 0.98
    assert 0.9 < score.std() < 1.1


def test_gibbs_alone_does_not_cross_between_modes():
    net = two_modes()
    found = sample(net, *everything(net), "gibbs", Effort(0.008, 1.0))
    assert found.ending == "time"
    assert not found.columns.mixed.all()


@pytest.mark.parametrize(
    ("text", "facts", "expected"),
    [
        ("H\nS\nH v S.\n", "", {"H": 2 / 3, "S": 2 / 3}),
        ("A\nB\n1.5 A <=> B\n", "", {"A": 0.5, "B": 0.5, "A <=> B": np.exp(1.5) / (1 + np.exp(1.5))}),
        ("A\nB\n1.5 A <=> B\n0.7 A\n", "", {"A": None, "B": None, "A <=> B": None}),
    ],
)
@pytest.mark.parametrize("method", ["auto", "mcsat"])
def test_known_traps(text, facts, expected, method):
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text(facts, model=model)
    exact = ml.marginal(model, evidence, list(expected), method="exact")
    found = ml.marginal(model, evidence, list(expected), method=method, precision=0.004, time_limit=20)
    for name, p in expected.items():
        assert exact[name] == pytest.approx(exact[name] if p is None else p, abs=1e-12)
        assert found[name] == pytest.approx(exact[name], abs=0.01 if method == "mcsat" else 1e-12)


@settings(max_examples=30, deadline=None)
@given(networks())
def test_state_of_a_world_is_its_weight(net):
    every = worlds(net)
    weights = np.array([world_weight(net, w) for w in every])
    factors = factors_of(with_counts(net), np.ones(net.n_variables, bool))
    if not factors.n_factors:
        return
    rng = np.random.default_rng(0)
    sums = np.array([log_weights(start(factors, w[factors.atom], rng)).sum() for w in every])
    possible = np.isfinite(weights)
    assert np.array_equal(sums > -1e7, possible) or not possible.any()
    if possible.any():
        difference = (sums - weights)[possible]
        assert np.ptp(difference) < 1e-9


def test_sweep_equals_its_twin():
    net = one_hot(12)
    factors = factors_of(net, np.ones(net.n_variables, bool))
    truth = worlds_at_random(net, 1)[0][factors.atom]
    fast, slow = (start(factors, truth, np.random.default_rng(5)) for _ in range(2))
    sums = gibbs_draws(fast, 20, NOTHING)
    total = twin(slow, np.random.default_rng(5).random((20, factors.n_variables)))
    assert np.array_equal(fast.true, slow.true)
    assert np.array_equal(fast.state, states(factors, fast.true))
    assert np.allclose(sums.total, total)


def twin(chain, uniform):
    """The Gibbs kernel, in words of NumPy: every value of every variable by weighing the whole world."""
    f, total = chain.factors, np.zeros((2, chain.factors.n_atoms))
    for row in uniform:
        for v, u in enumerate(row):
            atoms = list(range(f.first[v], f.first[v + 1]))
            choices = [*atoms, *([-1] if f.none[v] else [])]
            worth = []
            for a in choices:
                chain.true[v] = a
                worth.append(f.value[f.row + states(f, chain.true)].sum())
            p = np.exp(np.array(worth) - max(worth))
            p /= p.sum()
            total[0, atoms] += p[: len(atoms)]
            total[1, atoms] += p[: len(atoms)] ** 2
            chain.true[v] = choices[int(np.searchsorted(p.cumsum(), u, side="right"))]
    return total


def worlds_at_random(net, n):
    rng = np.random.default_rng(0)
    values = (rng.random((n, net.n_variables)) * net.cardinality).astype(int)
    return values[:, net.variable] == net.value


def test_a_hard_slice_is_drawn_uniformly():
    net = network(
        [("", 1)] * 3 + [("!", 3)], [([([1, 2], 0, 1), ([-2, 4], 0, 1), ([-3, -5], 0, 1)], False)], weights=[np.inf]
    )
    possible = [tuple(w) for w in worlds(net) if world_weight(net, w) == 0.0]
    factors = factors_of(net, np.ones(net.n_variables, bool))
    chain = start(factors, np.array(possible[0])[factors.atom], np.random.default_rng(3))
    even, seen = np.ones(net.n_variables, bool), dict.fromkeys(possible, 0)
    for _ in range(4000):
        jump(chain, even)
        truth = np.zeros(net.n_atoms, bool)
        truth[factors.atom[chain.true[chain.true >= 0]]] = True
        seen[tuple(truth)] += 1
    expected = 4000 / len(possible)
    assert sum((n - expected) ** 2 / expected for n in seen.values()) < 2.5 * len(possible)
    assert even.all()


def test_a_large_slice_says_that_it_was_walked():
    n = 60
    rng = np.random.default_rng(1)
    rows = [(sorted(int(x) for x in rng.choice(np.arange(1, n + 1), 3, replace=False)), 0, 1) for _ in range(90)]
    net = network([("", 1)] * n, [(rows, False)], weights=[np.inf])
    found = sample(net, *everything(net), "mcsat", Effort(0.02, 10.0))
    assert "MC-SAT, partly SampleSAT" in found.methods


def wide_slices():
    """Parts with few worlds among many: two that differ everywhere; random clauses; blocks and a count."""
    rng = np.random.default_rng(4)
    equal = np.zeros((2, 2), bool)
    equal[0, 0] = equal[1, 1] = True
    rings = network([("", 1)] * 5, tables=[(equal, [([a, (a + 1) % 5], 0, 1) for a in range(5)])], weights=[np.inf])
    rows = [([int(a) * int(rng.choice([-1, 1])) for a in rng.choice(9, 3, replace=False) + 1], 0, 1) for _ in range(22)]
    clauses = network([("", 1)] * 9, [(rows, False)], weights=[np.inf])
    some = ([0, 0, 1, 1, 0, 0], [([1, -2, 3, 4, 7], 0, 1)])
    ties = [([-1, 5], 0, 1), ([-3, -6], 0, 1), ([2, -8], 0, 1), ([3, 9], 0, 1)]
    mixed = network([("", 1)] * 3 + [("!", 3), ("?", 3)], [(ties, False)], counts=[some], weights=[np.inf])
    return {"two far apart": rings, "random clauses": clauses, "blocks and counts": mixed}


@pytest.mark.parametrize("name", ["two far apart", "random clauses", "blocks and counts"])
def test_trips_keep_the_uniform_distribution(name, monkeypatch):
    net = wide_slices()[name]
    monkeypatch.setattr(chain_module, "LISTED", -(1 << 40))
    monkeypatch.setattr(chain_module, "TRIPS", 8)
    possible = [tuple(w) for w in worlds(net) if world_weight(net, w) == 0.0]
    assert 1 < len(possible) < 60
    factors = factors_of(net, np.ones(net.n_variables, bool))
    even, n, seen = np.ones(net.n_variables, bool), 6000, dict.fromkeys(possible, 0)
    chain = start(factors, np.array(possible[0])[factors.atom], np.random.default_rng(3))
    for _ in range(n):
        jump(chain, even)
        truth = np.zeros(net.n_atoms, bool)
        truth[factors.atom[chain.true[chain.true >= 0]]] = True
        seen[tuple(truth)] += 1
    assert not even.all()
    frequency = np.array(list(seen.values())) / n
    p = 1 / len(possible)
    assert np.abs(frequency - p).max() < 5 * np.sqrt(p * (1 - p) / (n / 3))  # three draws are worth an independent one


def test_atoms_of_a_factor_know_their_variable():
    net = one_hot(3)
    factors = factors_of(net, np.ones(net.n_variables, bool))
    assert owners(factors).tolist() == net.variable[factors.atom].tolist()


def test_forced_atoms_are_exact():
    net = network(
        [("", 1)] * 3, [([([1, 2], 0, 1), ([1, -2], 0, 1)], False), ([([3], 1, 1)], False)], weights=[np.inf, 0.5]
    )
    found = sample(net, *everything(net), "mcsat", Effort(0.01, 10.0))
    assert found.columns.exact.tolist() == [True, False, False]
    assert found.methods[0] == "forced by hard formulas"
    assert found.columns.probability[0] == 1.0


def test_rare_atoms_have_an_interval():
    net = network([("", 1)] * 2, [([([1, 2], 0, 1)], False), ([([1], 1, 1)], False)], weights=[0.3, -30.0])
    found = sample(net, *everything(net), "gibbs", Effort(0.01, 10.0))
    assert not found.columns.exact.any()
    assert found.methods[0].endswith("never seen otherwise")
    assert found.columns.low[0] == 0.0
    assert 0 < found.columns.high[0] < 0.05


def test_same_seed_same_answer():
    net = smokers(20, 25)
    first, second = (sample(net, *everything(net), "gibbs", Effort(0.02, 10.0, seed=4)) for _ in range(2))
    n = min(first.draws.shape[1], second.draws.shape[1], 20)
    assert n >= 8
    assert first.columns.probability == pytest.approx(second.columns.probability, abs=0.1)


@pytest.mark.parametrize("sampler", [gibbs_draws, lambda chain, n, watched: mcsat_draws(chain, n, watched, EVEN)])
def test_compiled_code_does_what_is_written(monkeypatch, sampler):
    """All kernels as plain Python, those that they call too: the same worlds from the same chance."""
    net = with_counts(pulled_groups())
    factors = factors_of(net, np.ones(net.n_variables, bool))
    truth = start_worlds(net, 1, np.random.default_rng(1))[0][factors.atom]
    fast, slow = (start(factors, truth, np.random.default_rng(5)) for _ in range(2))
    compiled = sampler(fast, 15, NOTHING)
    plain = {name: getattr(import_module(f"mlnlite.infer.sample.{home}"), name) for home, name in KERNELS}
    for module in {f"mlnlite.infer.sample.{home}" for home, _ in KERNELS}:
        for name, kernel in plain.items():
            if hasattr(import_module(module), name):
                monkeypatch.setattr(import_module(module), name, kernel.py_func)
    written = sampler(slow, 15, NOTHING)
    assert np.array_equal(fast.true, slow.true)
    assert np.array_equal(fast.state, slow.state)
    np.testing.assert_allclose(compiled.total, written.total, atol=1e-12)


EVEN = np.ones(1000, bool)
KERNELS = [
    ("gibbs_kernel", "sweep"), ("swap_kernel", "swap"), ("mcsat.slice", "cut"), ("mcsat.units", "propagate"),
    ("mcsat.fix", "fix"), ("mcsat.assign", "assign"), ("mcsat.list", "list_worlds"), ("mcsat.reach", "reach"),
    ("mcsat.draw", "draw"), ("mcsat.wander", "wander"), ("mcsat.turn", "turn"), ("mcsat.turn", "value_of"),
    ("mcsat.turn", "pull_of"), ("mcsat.wander", "_shares"), ("mcsat.wander", "_near"), ("mcsat.wander", "_n_open"),
    ("mcsat.wander", "_chance"),
]  # fmt: skip


def pulled_groups():
    """Blocks, groups of which at most one is true, hard clauses, and too many worlds of one part to list them all."""
    rng = np.random.default_rng(2)
    n = 40
    pairs = [([-a, -b], 0, 1) for first in (1, 6) for a in range(first, first + 5) for b in range(first, a)]
    hard = [(sorted(int(x) for x in rng.choice(np.arange(11, n + 1), 3, replace=False)), 1, 1) for _ in range(40)]
    same = [([-(n + 1 + k), n + 4 + k], 2, 1) for k in range(3)]
    blocks = [("", 1)] * n + [("!", 3), ("?", 3)]
    return network(blocks, [(pairs + same, False), (hard, False)], weights=[3.0, np.inf, 1.2])
