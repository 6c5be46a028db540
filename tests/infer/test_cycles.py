"""Odd cycles: inequalities that hold in every world, and best worlds against listing all of them."""

from itertools import product

import numpy as np
import pytest

import mlnlite as ml
from benchmarks import generators
from mlnlite.engines.numpy import NumpyEngine
from mlnlite.ground.lazy import world_evidence
from mlnlite.infer.map.cuts import cycles, walk_kernel
from mlnlite.infer.map.cuts.cycles import pairs_of, violated_walks
from mlnlite.infer.map.cuts.rows import Rows, with_rows
from mlnlite.infer.map.cuts.walk_kernel import odd_walks
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.map.relaxation import bound_of, solve_program
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.dominance import merged
from mlnlite.infer.reduce.parts import Part, all_gains, value_of
from mlnlite.infer.score import cost, counts


def frustrated(seed, n, m):
    """Pairs that attract or repel at random."""
    rng = np.random.default_rng(seed)
    scope = np.sort(np.array([rng.choice(n, 2, replace=False) for _ in range(m)]), axis=1).astype(np.int32)
    value = rng.integers(0, 2, (m, 2)).astype(np.int32)
    own = Cells(np.arange(n, dtype=np.int32)[:, None], np.ones((n, 1), np.int32), np.round(rng.normal(0, 0.5, n), 2))
    pairs = merged(Cells(scope, value, np.round(rng.normal(0, 1, m), 2)))
    return Part(0, np.arange(n), np.full(n, 2, np.int32), (own, pairs))


def worlds(part):
    return np.array(list(product(range(2), repeat=len(part.variables))))


@pytest.mark.parametrize("start", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_best_worlds_equal_enumeration(seed, start):
    part = frustrated(seed, 9, 24)
    expected = max(value_of(part, w) for w in worlds(part))
    answer = cycles.solve_part(part, start=np.ones(9, np.int64) if start else None)
    assert answer.optimal
    assert value_of(part, answer.world) == pytest.approx(expected, abs=1e-9)
    assert expected - 1e-9 <= answer.bound <= expected + 1e-5


@pytest.mark.parametrize("seed", range(6))
def test_cycles_hold_in_every_world_and_bounds_do(seed):
    part = frustrated(seed, 7, 16)
    pairs, rng = pairs_of(part), np.random.default_rng(seed)
    every = worlds(part)
    with_nobody = np.concatenate([every, np.zeros((len(every), 1), int)], axis=1)
    differ = with_nobody[:, pairs.first] != with_nobody[:, pairs.second]
    rows, n_found = Rows(pairs.program.n_columns), 0
    for _ in range(20):
        x = rng.choice([0.0, 0.5, 0.5, 1.0], pairs.program.n_columns)
        above, start, steps = violated_walks(pairs, x, np.arange(pairs.n), 1e-3)
        for a, b, by in zip(start[:-1], start[1:], above, strict=True):
            columns, odd = steps[a:b] // 2, steps[a:b] % 2 == 1
            assert (1 - x[columns[odd]]).sum() + x[columns[~odd]].sum() <= 1 - by + 1e-9
            assert odd.sum() % 2 == 1
            assert ((1 - differ[:, columns[odd]]).sum(axis=1) + differ[:, columns[~odd]].sum(axis=1) >= 1).all()
            n_found += 1
        cycles._separate(pairs, rows, x, np.arange(pairs.n), 1e-3, 6)
    assert n_found
    program = with_rows(pairs.program, rows)
    best = max(value_of(part, w) for w in every)
    _, multipliers, bound = solve_program(part, program, cycles.FOREVER, exact=True)
    assert bound >= best - 1e-7
    assert bound_of(part, program, multipliers + rng.normal(0, 0.1, len(multipliers)))[0] >= best - 1e-9
    assert bound <= all_gains(part) + 1e-9


def walks(start, end, x, source, hub):
    """Length of the shortest odd closed walk through a node by Bellman and Ford, hub left out."""
    distance = np.full((int(max(start.max(), end.max())) + 1, 2), np.inf)
    distance[source, 0] = 0.0
    for _ in range(2 * len(distance)):
        for a, b, value in zip(start, end, x, strict=True):
            for here, there in ((a, b), (b, a)):
                for parity in range(2):
                    if there != hub and here != hub:
                        for odd, length in ((0, value), (1, 1 - value)):
                            other = distance[here, parity] + length
                            distance[there, parity ^ odd] = min(distance[there, parity ^ odd], other)
    return distance[source, 1]


@pytest.mark.parametrize("seed", range(5))
def test_walks_are_the_shortest_ones(seed):
    rng = np.random.default_rng(seed)
    ends = np.array([(a, b) for a in range(9) for b in range(a) if rng.random() < 0.4 or a == 8])
    x = rng.choice([0.0, 0.1, 0.3, 0.5, 0.8, 1.0], len(ends))
    start, end, column = (np.concatenate(a) for a in (ends.T, ends.T[::-1], [np.arange(len(ends))] * 2))
    order = np.argsort(start, kind="stable")
    begin = np.searchsorted(start[order], np.arange(10))
    for source in range(8):
        arguments = begin, end[order], column[order], x, np.array([source]), 8, 1e-3
        above, _start, steps = odd_walks(*arguments)
        length = walks(*ends.T, x, source, 8)
        assert (1 - above).tolist() == pytest.approx([length] if length < 1 - 1e-3 else [])
        assert (1 - x[steps[steps % 2 == 1] // 2]).sum() + x[steps[steps % 2 == 0] // 2].sum() <= length + 1e-9
    for a, b in zip(odd_walks(*arguments[:4], np.arange(9), 8, 0.01), _plain(*arguments[:4]), strict=True):
        np.testing.assert_allclose(a, b)


def _plain(*arguments):
    """The same as plain Python."""
    saved = walk_kernel.explore, walk_kernel.close
    walk_kernel.explore, walk_kernel.close = (f.py_func for f in saved)
    try:
        return odd_walks.py_func(*arguments, np.arange(9), 8, 0.01)
    finally:
        walk_kernel.explore, walk_kernel.close = saved


@pytest.mark.parametrize("seed", range(6))
def test_no_world_passes_what_an_ascent_over_cycles_proves(seed):
    part = frustrated(seed, 10, 26)
    pairs, rows = pairs_of(part), Rows(pairs_of(part).program.n_columns)
    best = max(value_of(part, w) for w in worlds(part))
    world, bound = cycles._ascend(pairs, rows, np.zeros(10, np.int64), (0.0, 0.0), cycles.FOREVER, seed)
    least = solve_program(part, with_rows(pairs.program, rows), cycles.FOREVER, exact=True)[2]
    assert value_of(part, world) <= best + 1e-9 <= bound + 2e-9
    assert best - 1e-6 <= least <= bound + 1e-6


def test_wider_cells_are_no_pairs():
    triple = Cells(np.array([[0, 1, 2]], np.int32), np.ones((1, 3), np.int32), np.array([-1.0]))
    assert cycles.solve_part(Part(0, np.arange(3), np.full(3, 2, np.int32), (triple,))) is None


def test_frustrated_networks_are_proved():
    model, evidence = generators.rivals(150)
    network = ml.ground(model, evidence)
    best = map_of(network)
    assert best.status == "optimal"
    other = map_of(network, method="ilp", gap=0.02)
    assert other.log_weight <= best.log_weight + 1e-6 <= other.bound + 2e-6
    whole = ml.ground(model, world_evidence(network, best.truth), engine=NumpyEngine())
    anew = cost(whole, counts(whole, np.zeros(whole.n_atoms, np.bool_)))
    assert anew == pytest.approx(cost(network, counts(network, best.truth)))


def test_what_is_not_proved_has_a_gap():
    network = ml.ground(*generators.rivals(120, opposed=True))
    best = map_of(network, time_limit=1.0)
    longer = map_of(network, time_limit=2.0)
    assert best.log_weight <= longer.bound + 1e-9
    assert longer.log_weight <= best.bound + 1e-9


def test_what_is_forbidden_is_left_to_others():
    part = frustrated(0, 20, 50)
    hard = Cells(np.array([[0, 1]], np.int32), np.array([[1, 0]], np.int32), np.array([-np.inf]))
    assert pairs_of(part) is not None
    assert pairs_of(Part(0, part.variables, part.cardinality, (*part.cells, hard))) is None
