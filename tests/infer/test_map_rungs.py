"""Every rung against listing all worlds, and against each other where listing is too much."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mlnlite.errors import Contradiction
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.exact.elimination import best_world
from mlnlite.infer.exact.order import plan
from mlnlite.infer.map import ilp, ladder, maxsat, mincut, relaxation, rungs, toulbar2
from mlnlite.infer.map.flow_kernel import arcs, greedy, push, seeds
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.map.search import annealing, walksat
from mlnlite.infer.map.search.annealing_kernel import sweeps
from mlnlite.infer.map.search.landscape import holding, landscape_of, missing_of, worth
from mlnlite.infer.map.search.walksat_kernel import walk
from mlnlite.infer.map.twins import twins_of
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.counting import Chains
from mlnlite.infer.reduce.dominance import merged, without_dominated
from mlnlite.infer.reduce.narrow import narrowed, written
from mlnlite.infer.reduce.parts import Part, all_gains, value_of
from mlnlite.infer.reduce.potentials import Potentials, potentials_of
from mlnlite.infer.workers.ask import workers
from tests.networks import network, networks, world_weight, worlds


@pytest.fixture(scope="module")
def ask():
    with workers() as ask:
        yield ask


def whole(net, *, chained=True):
    """A network as one component, without any simplification but unit propagation."""
    p = potentials_of(net, max_arity=np.inf, chained=chained)
    return p, Part(0, np.arange(len(p.cardinality)), p.cardinality, p.cells, p.chains)


def best_weight(net):
    return max(world_weight(net, t) for t in worlds(net))


def by_elimination(part, _):
    small, constant = written(part)
    if np.isneginf(constant):
        return None
    small = narrowed(small)
    tree = plan(small.cardinality, [c.scope for c in small.cells], 1 << 20)
    value, world = best_world(tree, small.cardinality, small.cells)
    return None if np.isneginf(value) else world[: len(part.variables)]


PROVING = {
    "ilp": lambda part, _: ilp.solve_part(part),
    "wcsp": lambda part, ask: toulbar2.solve_part(part, ask, Deadline()),
    "maxsat": lambda part, ask: maxsat.solve_part(part, ask, Deadline()),
}


@pytest.mark.parametrize("rung", PROVING)
@settings(max_examples=40, deadline=None)
@given(net=networks(max_atoms=14))
def test_solvers_equal_enumeration(rung, ask, net):
    expected = best_weight(net)
    potentials, part = whole(net)
    if np.isneginf(potentials.constant):
        assert np.isneginf(expected)
        return
    answer = PROVING[rung](part, ask)
    if np.isneginf(expected):
        assert answer.world is None
        return
    assert answer.optimal
    assert potentials.constant + value_of(part, answer.world) == pytest.approx(expected, abs=1e-5)
    assert potentials.constant + answer.bound >= expected - 1e-9
    assert potentials.constant + answer.bound <= expected + 1e-3


@settings(max_examples=60, deadline=None)
@given(net=networks(max_atoms=14))
def test_elimination_with_wide_cells_equals_enumeration(net):
    expected = best_weight(net)
    potentials, part = whole(net)
    if np.isneginf(potentials.constant):
        return
    world = by_elimination(part, None)
    if world is None:
        assert np.isneginf(expected)
    else:
        assert potentials.constant + value_of(part, world) == pytest.approx(expected, abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(net=networks(max_atoms=12))
def test_dominance_keeps_a_best_world(net):
    expected = best_weight(net)
    reduced = without_dominated(potentials_of(net, max_arity=np.inf, chained=True))
    part = Part(0, np.arange(net.n_variables), reduced.cardinality, reduced.cells, reduced.chains)
    values = [(truth @ np.diag(net.value)).astype(int) for truth in worlds(net)]
    of_variables = [np.bincount(net.variable, v, net.n_variables).astype(np.int64) for v in values]
    if np.isneginf(expected):
        assert np.isneginf(reduced.constant) or max(value_of(part, w) for w in of_variables) == -np.inf
        return
    assert reduced.constant + max(value_of(part, w) for w in of_variables) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("search", [annealing.solve_part, walksat.solve_part])
@settings(max_examples=40, deadline=None)
@given(net=networks(max_atoms=14))
def test_searches_find_best_worlds_of_small_networks(search, net):
    expected = best_weight(net)
    potentials, part = whole(net)
    if np.isneginf(potentials.constant) or np.isneginf(expected):
        return
    options = {"moves": 40_000} if search is annealing.solve_part else {"steps": 60_000}
    answer = search(part, **options)
    assert answer.world is not None
    value = potentials.constant + value_of(part, answer.world)
    assert value <= expected + 1e-9
    if search is annealing.solve_part:
        assert value == pytest.approx(expected, abs=1e-9)
    assert potentials.constant + answer.bound >= expected - 1e-9


@settings(max_examples=40, deadline=None)
@given(net=networks(max_atoms=12), solver=st.sampled_from(["simplex", "ipm", "pdlp"]), seed=st.integers(0, 100))
def test_linear_bounds_hold_with_any_multipliers(net, solver, seed):
    expected = best_weight(net)
    potentials, part = whole(net)
    if np.isneginf(potentials.constant) or np.isneginf(expected):
        return
    answer = relaxation.solve_part(part, solver_name=solver)
    assert potentials.constant + answer.bound >= expected - 1e-6
    if answer.optimal:
        assert potentials.constant + value_of(part, answer.world) == pytest.approx(expected, abs=1e-5)
    program, _ = ilp.program_of(part)
    anything = np.random.default_rng(seed).normal(0, 1, program.n_rows)
    assert potentials.constant + relaxation.bound_of(part, program, anything)[0] >= expected - 1e-9


def counted(worth_, steps=None, gains=None):
    """A component of atoms of which a count is worth something, and each atom something by itself."""
    steps = np.ones(len(worth_) - 1, np.int32) if steps is None else np.array(steps, np.int32)
    m = len(steps)
    chains = Chains(
        np.arange(m)[None].astype(np.int32), np.ones((1, m), np.int32), np.ones((1, m), bool), steps, worth_, np.ones(1)
    )
    own = Cells(np.arange(m, dtype=np.int32)[:, None], np.ones((m, 1), np.int32), np.array(gains))
    return Part(0, np.arange(m), np.full(m, 2, np.int32), (own,), (chains,))


def test_convex_costs_of_a_count_need_no_binary_columns():
    gains = np.round(np.random.default_rng(0).normal(0.5, 1, 40), 2)
    part = counted(-0.05 * np.arange(41.0) ** 2, gains=gains)
    program, columns = ilp.program_of(part)
    assert program.binary == []
    assert program.n_rows == 2
    assert program.n_columns == columns.n + 40
    best = max(np.sort(gains)[::-1][:k].sum() - 0.05 * k**2 for k in range(41))
    for answer in (relaxation.solve_part(part, solver_name="simplex"), ilp.solve_part(part)):
        assert answer.optimal
        assert value_of(part, answer.world) == pytest.approx(best)
        assert answer.bound == pytest.approx(best, abs=1e-5)


@pytest.mark.parametrize(
    ("worth_", "n_binary"),
    [
        ([0, 0, 0, 5.0, 5, 5], 1),  # flat, up, flat: the second bend is the wrong way
        ([0, 1, 2, 3, 4, 5.0], 0),
        ([0, -np.inf, -np.inf, 2, 3, 4], 2),  # all or at least three
        ([-np.inf, -np.inf, 1, 1, -np.inf, -np.inf], 0),
        ([3.0, 0, 3, 0, 3, 0], 2),
    ],
)
def test_binary_columns_stand_where_costs_of_a_count_are_not_convex(worth_, n_binary):
    rng = np.random.default_rng(1)
    for _ in range(5):
        part = counted(np.array(worth_), gains=np.round(rng.normal(0, 2, 5), 2))
        assert len(ilp.program_of(part)[0].binary) == n_binary
        best = max(value_of(part, np.array([w >> i & 1 for i in range(5)])) for w in range(32))
        answer = ilp.solve_part(part)
        assert value_of(part, answer.world) == pytest.approx(best)
        assert answer.bound == pytest.approx(best, abs=1e-5)


def test_counts_that_no_atoms_add_up_to_are_no_bends():
    part = counted(np.array([0, 9, 2, 9, 4, 9, 6]), steps=[2, 2, 2], gains=[-1.0, 1, 1])
    assert ilp.program_of(part)[0].binary == []
    assert value_of(part, ilp.solve_part(part).world) == pytest.approx(7.0)
    assert ilp.solve_part(counted(np.full(4, -np.inf), gains=[1.0, 1, 1])).world is None


def test_pairs_that_stand_several_times_are_not_all_pairs():
    pairs = [(0, 0), (0, 0), (0, 0), (0, 1), (0, 1), (1, 0)]
    cost = Cells(np.tile(np.arange(2, dtype=np.int32), (6, 1)), np.array(pairs, np.int32), np.full(6, -1.74))
    gain = Cells(np.zeros((1, 1), np.int32), np.ones((1, 1), np.int32), np.array([3.9]))
    other = Cells(np.ones((1, 1), np.int32), np.ones((1, 1), np.int32), np.array([1.74]))
    part = Part(0, np.arange(2), np.array([3, 3]), (gain, other, cost))
    assert ilp.solve_part(part).bound == pytest.approx(5.64, abs=1e-5)


# --- minimum cuts


def attractive(rng, n, m, *, flip=False, digits=2):
    """Pairs that attract, once some variables are flipped."""
    flips = rng.random(n) < 0.5 if flip else np.zeros(n, bool)
    scope = np.sort(np.array([rng.choice(n, 2, replace=False) for _ in range(m)]), axis=1).astype(np.int32)
    value = rng.integers(0, 2, (m, 2)).astype(np.int32)
    agrees = (value[:, 0] ^ flips[scope[:, 0]]) == (value[:, 1] ^ flips[scope[:, 1]])
    amount = np.round(rng.exponential(1.0, m), digits) * np.where(agrees, 1, -1)
    own = Cells(
        np.arange(n, dtype=np.int32)[:, None], np.ones((n, 1), np.int32), np.round(rng.normal(0, 1.5, n), digits)
    )
    return Part(0, np.arange(n), np.full(n, 2, np.int32), (own, merged(Cells(scope, value, amount))))


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_minimum_cuts_equal_enumeration(seed, flip):
    rng = np.random.default_rng(seed)
    part = attractive(rng, int(rng.integers(2, 11)), int(rng.integers(1, 25)), flip=flip)
    n = len(part.variables)
    expected = max(value_of(part, np.array([w >> i & 1 for i in range(n)])) for w in range(2**n))
    answer = mincut.solve_part(part)
    assert answer.optimal
    assert value_of(part, answer.world) == pytest.approx(expected, abs=1e-9)
    assert answer.bound == pytest.approx(expected, abs=1e-9)


def test_minimum_cuts_agree_with_integer_programs_and_scipy():
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import maximum_flow

    part = attractive(np.random.default_rng(1), 120, 300, flip=True)
    answer = mincut.solve_part(part)
    by_ilp = ilp.solve_part(part)
    assert value_of(part, answer.world) == pytest.approx(value_of(part, by_ilp.world), abs=1e-6)
    function = mincut.quadratic(part)
    function = mincut.flipped(function, mincut.flips(function))
    cut, n = mincut.minimum_cut(function), len(function.linear)
    half, terminal = function.product // 2, function.linear.copy()
    np.add.at(terminal, function.first, half)
    np.add.at(terminal, function.second, half)
    nodes = np.arange(n)
    rows = np.concatenate([function.first, function.second, np.full(n, n), nodes])
    columns = np.concatenate([function.second, function.first, nodes, np.full(n, n + 1)])
    room = np.concatenate([half, half, np.maximum(terminal, 0), np.maximum(-terminal, 0)]).astype(np.int32)
    graph = csr_array((room, (rows, columns)), shape=(n + 2, n + 2))
    assert maximum_flow(graph, n, n + 1).flow_value == cut.flow == cut.capacity


def test_what_does_not_attract_is_no_cut():
    triangle = Cells(
        np.array([[0, 1], [1, 2], [0, 2]], np.int32), np.ones((3, 2), np.int32), np.array([-1.0, -1.0, -1.0])
    )
    assert mincut.solve_part(Part(0, np.arange(3), np.full(3, 2, np.int32), (triangle,))) is None


def test_weights_that_are_no_decimals_state_their_rounding():
    rng = np.random.default_rng(5)
    part = attractive(rng, 8, 20, digits=17)
    answer = mincut.solve_part(part)
    assert 0 < answer.bound - value_of(part, answer.world) < 1e-8


# --- all rungs on networks of a middle size


def one_hot(seed, n=24, k=5):
    rng = np.random.default_rng(seed)
    blocks = [("!", k)] * n
    rows = []
    for _ in range(4 * n):
        vs = np.sort(rng.choice(n, int(rng.integers(1, 4)), replace=False))
        rows.append(
            ([int(v * k + rng.integers(k) + 1) * int(rng.choice([-1, 1])) for v in vs], int(rng.integers(5)), 1)
        )
    by_length = {size: [r for r in rows if len(r[0]) == size] for size in {len(r[0]) for r in rows}}
    return network(blocks, [(r, False) for r in by_length.values()], weights=[0.7, 1.3, -0.4, 2.0, -1.1])


@pytest.mark.parametrize("seed", range(2))
def test_rungs_agree_on_networks_of_a_middle_size(seed):
    net = one_hot(seed)
    answers = {m: map_of(net, method=m, time_limit=30) for m in ("auto", "ilp", "wcsp", "annealing", "maxwalksat")}
    best = answers["ilp"].log_weight
    for name, answer in answers.items():
        assert answer.log_weight <= best + 1e-6 <= answer.bound + 2e-6, name
        assert answer.bound - answer.log_weight == pytest.approx(answer.gap, abs=1e-9)
    assert answers["auto"].log_weight == answers["wcsp"].log_weight == pytest.approx(best)
    assert answers["annealing"].log_weight == pytest.approx(best)


@pytest.mark.parametrize("method", ["auto", "ilp", "maxsat", "annealing", "maxwalksat"])
def test_the_same_seed_gives_the_same_world(method):
    net = one_hot(7, n=10)
    first, second = (map_of(net, method=method, seed=3) for _ in range(2))
    assert (first.truth == second.truth).all()
    assert first.bound == second.bound


@pytest.mark.parametrize("method", ["ilp", "wcsp", "maxsat", "annealing", "maxwalksat"])
def test_hard_formulas_that_exclude_each_other_are_found_out(method):
    rows = [([s * a, t * b], 0, 1) for a, b in ((1, 2),) for s in (1, -1) for t in (1, -1)]
    net = network([("", 1)] * 2, [(rows, False)], weights=[np.inf])
    with pytest.raises(Contradiction):
        map_of(net, method=method)


# --- compiled kernels and their plain twins


def with_counts(part):
    """The component with a counting factor over values of blocks that are to be and are not to be."""
    n, rng = len(part.variables), np.random.default_rng(5)
    variable, value = (
        np.array([np.arange(n), np.arange(n)[::-1]], np.int32),
        rng.integers(0, 2, (2, n)).astype(np.int32),
    )
    steps = np.sort(rng.integers(1, 3, n)).astype(np.int32)
    worth_ = np.round(rng.normal(0, 2, steps.sum() + 1), 2)
    chains = Chains(variable, value, rng.random((2, n)) < 0.5, steps, worth_, np.array([1.0, -0.5]))
    return replace(part, chains=(chains,))


def test_kernels_do_what_their_python_does():
    rng = np.random.default_rng(0)
    part = with_counts(whole(one_hot(3, n=8))[1])
    landscape = landscape_of(part)
    tallies, runs = landscape.tallies, []
    for kernel in (sweeps, sweeps.py_func):
        world = np.zeros(8, np.int64)
        best, missing, chance = world.copy(), missing_of(landscape, world), np.random.default_rng(4)
        value, state = worth(landscape, world), tallies.states(holding(landscape, world))
        value, top = kernel(
            landscape.start, landscape.begin, landscape.cell, landscape.amount, tallies.arrays, missing, state,
            world, best, np.geomspace(3, 0.1, 50), value, value, chance,
        )  # fmt: skip
        assert worth(landscape, world) == pytest.approx(value)
        assert worth(landscape, best) == pytest.approx(top)
        assert (missing == missing_of(landscape, world)).all()
        assert (state == tallies.states(holding(landscape, world))).all()
        assert value_of(part, best) == pytest.approx(top)
        runs.append((world.tolist(), top))
    assert runs[0] == runs[1]
    function = mincut.quadratic(attractive(rng, 30, 60))
    assert function is not None


def test_walks_do_what_their_python_does(monkeypatch):
    part = with_counts(whole(one_hot(3, n=8))[1])
    compiled = walksat.solve_part(part, seed=2, steps=900)
    monkeypatch.setattr("mlnlite.infer.map.search.walksat_kernel.walk", walk.py_func)
    plain = walksat.solve_part(part, seed=2, steps=900)
    assert compiled.world.tolist() == plain.world.tolist()


@pytest.mark.parametrize("seed", range(5))
def test_flows_do_what_their_python_does(seed, monkeypatch):
    part = attractive(np.random.default_rng(seed), 40, 100)
    compiled = mincut.solve_part(part)
    for function in (arcs, greedy, push, seeds):
        monkeypatch.setattr(f"mlnlite.infer.map.flow_kernel.{function.__name__}", function.py_func)
    plain = mincut.solve_part(part)
    assert compiled.world.tolist() == plain.world.tolist()
    assert plain.optimal


def renamed(part, rng):
    """The same component with variables and their values in another order."""
    order = rng.permutation(len(part.variables))
    values = [rng.permutation(k) for k in part.cardinality]
    cells = []
    for c in part.cells:
        value = np.array(
            [[values[v][x] for v, x in zip(*row, strict=True)] for row in zip(c.scope, c.value, strict=True)]
        )
        rows = rng.permutation(len(c.amount))
        column = np.argsort(order[c.scope[rows]], axis=1)
        scope = np.take_along_axis(order[c.scope[rows]], column, axis=1).astype(np.int32)
        value = np.take_along_axis(value.reshape(c.scope.shape)[rows], column, axis=1).astype(np.int32)
        cells.append(Cells(scope, value, c.amount[rows]))
    cardinality = np.empty_like(part.cardinality)
    cardinality[order] = part.cardinality
    return Part(0, part.variables, cardinality, tuple(cells))


@settings(max_examples=40, deadline=None)
@given(net=networks(with_counts=False), other=networks(), seed=st.integers(0, 99))
def test_copies_have_the_worlds_of_their_originals(net, other, seed):
    rng = np.random.default_rng(seed)
    part, different = whole(net)[1], whole(other)[1]
    twins = twins_of([part, different, renamed(part, rng), part])
    assert twins.original[3] == 0
    assert twins.original[1] in (0, 1)
    for i, copy in ((2, renamed(part, np.random.default_rng(seed))), (3, part)):
        if twins.original[i] == 0:
            world = np.array([rng.integers(k) for k in part.cardinality])
            assert value_of(copy, twins.world(i, world)) == pytest.approx(value_of(part, world))


@pytest.mark.parametrize("method", ["auto", "ilp", "ve"])
def test_copies_are_solved_once(method, monkeypatch):
    rng, n = np.random.default_rng(0), 14
    weights = [round(float(w), 2) for w in rng.normal(0, 1, 40)]
    names = [np.arange(n), n + rng.permutation(n), 2 * n + rng.permutation(n)]
    clauses = []
    for w in range(len(weights)):
        atoms, signs = rng.choice(n, 3, replace=False), rng.choice([-1, 1], 3)
        clauses.append(([((signs * (own[atoms] + 1)).tolist(), w, 1) for own in names], False))
    net, searched = network([("", 1)] * (3 * n), clauses, (), weights), []
    search, eliminate = rungs._search, ladder._eliminate
    monkeypatch.setattr(rungs, "_search", lambda *a: searched.append(a[0]) or search(*a))
    monkeypatch.setattr(ladder, "_eliminate", lambda *a: searched.append(a[0]) or eliminate(*a))
    best = map_of(net, method=method)
    assert {id(part) for part in searched} == {id(searched[0])}
    assert best.status == "optimal"
    assert best.truth[names[0]].tolist() == best.truth[names[1]].tolist() == best.truth[names[2]].tolist()
    assert best.log_weight == pytest.approx(map_of(net, method="wcsp").log_weight)


def test_equal_cells_merge_whatever_their_width():
    scope = np.tile(np.arange(30, dtype=np.int32), (3, 1))
    value = np.ones((3, 30), np.int32)
    value[1, 4] = 0
    cells = merged(Cells(scope, value, np.array([1.0, 2.0, 3.0])))
    assert sorted(cells.amount.tolist()) == [2.0, 4.0]


def test_potentials_without_variables_are_no_trouble():
    empty = Potentials(np.zeros(0, np.int32), (), 1.5)
    assert without_dominated(empty).constant == 1.5
    assert all_gains(Part(0, np.zeros(0, np.int64), np.zeros(0, np.int32), ())) == 0
