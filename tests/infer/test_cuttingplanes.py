"""Rows of growing programs hold in every world; best worlds and bounds against listing all worlds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.map.cuts import ascent, lazy_program
from mlnlite.infer.map.cuts.ascent_kernel import sweep
from mlnlite.infer.map.cuts.cuttingplanes import map_lazily
from mlnlite.infer.map.cuts.lazy_program import base_of
from mlnlite.infer.map.cuts.partition import partition, partitioned, transitive
from mlnlite.infer.map.cuts.rows import Rows, add_clauses, add_stars, names_of, with_rows
from mlnlite.infer.map.cuts.separation import excuses, graph_of, lack, near_violations, stars
from mlnlite.infer.map.cuts.star_kernel import grow
from mlnlite.infer.map.cuts.waiting import violated_weight, without_lazy
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.map.relaxation import solve_program
from mlnlite.infer.map.rungs import Options

TEXTS = {
    "transitive": "Same(x, y) ^ Same(y, z) => Same(x, z)",
    "cover": "Same(x, y) v Same(y, z) v Good(x)",
    "block": "Same(x, y) ^ Kind(x, k) => Kind(y, k)",
}


def example(rng, name, weight, symmetric, n=4):
    """A model with one lazy formula, the last one, over atoms with random weights of their own."""
    constants = [f"R{i}" for i in range(n)]
    lines = ["Same(record, record)", "Good(record)", "Kind(record, kind!)", "kind = {A, B, C}"]
    lines.append("record = {" + ", ".join(constants) + "}")
    lines += [f"{rng.normal(0, 2):.1f} Same({a}, {b})" for a in constants for b in constants]
    lines += [f"{rng.normal(0, 1):.1f} Good({a})" for a in constants]
    lines += [f"{rng.normal(0, 1):.1f} Kind({a}, {k})" for a in constants for k in "ABC"]
    if symmetric:
        lines.append("Same(x, y) => Same(y, x).")
    lines.append(TEXTS[name] + "." if weight is None else f"{weight} {TEXTS[name]}")
    model = ml.model_from_text("\n".join(lines))
    known = [f"{'!' * int(rng.random() < 0.5)}Same({a}, {a})" for a in constants if rng.random() < 0.5]
    return model, ml.evidence_from_text("\n".join(known), model=model)


@pytest.mark.parametrize("name", TEXTS)
@pytest.mark.parametrize("weight", [None, 0.7])
@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_lazy_formulas_give_what_the_whole_network_gives(name, weight, symmetric, seed):
    model, evidence = example(np.random.default_rng(seed), name, weight, symmetric)
    waiting = [len(model.templates) - 1]
    whole = ml.ground(model, evidence)
    expected = map_of(whole)
    _lazy, best = map_lazily(without_lazy(model, evidence, waiting), Options())
    assert best.status == "optimal"
    assert best.log_weight == pytest.approx(expected.log_weight, abs=1e-5)
    assert best.bound >= expected.log_weight - 1e-6


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), weight=st.sampled_from([None, 0.7]), name=st.sampled_from(["transitive", "block"]))
def test_stars_and_clauses_hold_in_every_world(seed, weight, name):
    rng = np.random.default_rng(seed)
    model, evidence = example(rng, name, weight, symmetric=bool(seed % 2))
    lazy = without_lazy(model, evidence, [len(model.templates) - 1])
    base = base_of(lazy)
    weights = lazy.network.weights
    x = np.zeros(base.program.n_columns)
    x[: base.columns.n] = rng.choice([0.0, 0.4, 0.5, 0.6, 1.0], base.columns.n)
    near = near_violations(lazy, base.reading, x)
    rows = Rows(base.program.n_columns)
    add_clauses(rows, near, weights)
    n_clauses = len(rows)
    graph = graph_of(near, x, np.zeros(len(near)))
    found = stars(graph, excuses(near, graph, x), x)
    add_stars(rows, found, near, weights)
    program = with_rows(base.program, rows)
    matrix = np.zeros((len(rows), program.n_columns))
    np.add.at(matrix, (np.repeat(np.arange(len(rows)), np.diff(rows.start)), rows.column), rows.value)
    activity = matrix[:, : len(x)] @ x
    assert activity[n_clauses:] - rows.limit[n_clauses:] == pytest.approx(found.above)
    assert activity[:n_clauses] - rows.limit[:n_clauses] == pytest.approx(lack(near, x))
    paid = np.array([rows.paid.get(name, -1) for name in names_of(near)], np.int64)
    for density in np.linspace(0, 1, 100):
        point = np.zeros(program.n_columns)
        point[: base.columns.n] = rng.random(base.columns.n) < density
        violated = lack(near, point) > 0.5
        point[paid[(paid >= 0) & violated]] = 1.0
        if weight is not None or not violated.any():
            assert (matrix @ point <= rows.limit + 1e-9).all()


def test_partitions_are_found():
    rng = np.random.default_rng(0)
    label = rng.integers(0, 5, 40)
    same = label[:, None] == label
    noisy = same ^ np.triu(rng.random((40, 40)) < 0.05, 1)
    weight = np.where(noisy & noisy.T | same & (noisy | noisy.T), 1.0, -1.0)
    found = partition(weight, np.random.default_rng(1))
    assert ((found[:, None] == found) == same).mean() > 0.99


def test_transitivity_is_recognised():
    model = ml.model_from_text(
        "S(a, a)\nT(a, a)\n1 S(x, y) ^ S(y, z) => S(x, z)\n1 S(y, z) ^ S(x, y) => S(x, z)\n"
        "1 S(x, y) ^ T(y, z) => S(x, z)\n1 S(x, y) ^ S(y, z) => S(y, x)\n1 S(x, y) v S(y, z) v !S(x, z)\n"
    )
    assert [transitive(t.formula) for t in model.templates] == ["S", "S", None, None, None]


def test_partitions_are_worlds_of_the_whole_model():
    rng = np.random.default_rng(3)
    model, evidence = example(rng, "transitive", None, symmetric=True)
    lazy = without_lazy(model, evidence, [len(model.templates) - 1])
    start = partitioned(lazy)
    assert start is not None
    other, _ = example(rng, "cover", None, symmetric=True)
    assert partitioned(without_lazy(other, evidence, [len(other.templates) - 1])) is None
    assert violated_weight(lazy, np.zeros(lazy.network.n_atoms, bool)) >= 0


def test_hard_formulas_that_evidence_breaks_are_no_world():
    model = ml.model_from_text("S(a, a)\nS(x, y) ^ S(y, z) => S(x, z).\n1 S(x, y)\n")
    evidence = ml.evidence_from_text("S(A, B)\nS(B, C)\n!S(A, C)\n", model=model)
    with pytest.raises(ml.Contradiction):
        map_lazily(without_lazy(model, evidence, [0]), Options())


def test_a_time_limit_leaves_the_partition_and_its_gap():
    from benchmarks import generators
    from mlnlite.infer.deadline import in_seconds

    model, evidence = generators.entities(40, 0.2)
    _, best = map_lazily(without_lazy(model, evidence, [3]), Options("auto", in_seconds(0.0)))
    assert best.status == "feasible"
    assert np.isfinite(best.log_weight)
    assert best.gap > 0


def test_stars_grow_as_their_python_does():
    rng = np.random.default_rng(0)
    n = 12
    pairs = np.array([(a, b) for a in range(n) for b in range(a) if rng.random() < 0.7])
    excuse = rng.random(len(pairs)) * 0.4
    start, end = np.concatenate([pairs[:, 0], pairs[:, 1]]), np.concatenate([pairs[:, 1], pairs[:, 0]])
    order = np.lexsort((end, start))
    begin = np.searchsorted(start[order], np.arange(n + 1))
    arguments = begin, end[order], np.tile(excuse, 2)[order], np.tile(np.arange(len(pairs)), 2)[order], rng.random(n)
    compiled, plain = grow(*arguments, 1e-3, 8), grow.py_func(*arguments, 1e-3, 8)
    for a, b in zip(compiled, plain, strict=True):
        np.testing.assert_array_equal(a, b)
    members, clauses, above = compiled
    for m, c, value in zip(members, clauses, above, strict=True):
        m, c = m[m >= 0], c[c >= 0]
        assert len(c) == len(m) * (len(m) - 1) // 2
        assert value == pytest.approx(arguments[4][m].sum() - excuse[c].sum() - 1)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), weight=st.sampled_from([None, 0.7]), name=st.sampled_from(list(TEXTS)))
def test_no_world_passes_what_an_ascent_proves(seed, weight, name):
    model, evidence = example(np.random.default_rng(seed), name, weight, symmetric=bool(seed % 2))
    lazy = without_lazy(model, evidence, [len(model.templates) - 1])
    base = base_of(lazy)
    search = lazy_program._Search(lazy, base, Rows(base.program.n_columns), lazy_program.Found(), Options(), None, 0.0)
    lazy_program._ascend(search)
    best = map_of(ml.ground(model, evidence)).log_weight
    assert search.found.bound >= best - 1e-6
    _x, _multipliers, least = solve_program(base.part, with_rows(base.program, search.rows), Deadline(), exact=True)
    assert least + base.constant >= best - 1e-6


def test_an_ascent_gets_as_far_as_a_linear_program():
    from benchmarks import generators

    model, evidence = generators.entities(40, 0.2)
    lazy = without_lazy(model, evidence, [3])
    base = base_of(lazy)
    search = lazy_program._Search(lazy, base, Rows(base.program.n_columns), lazy_program.Found(), Options(), None, 0.0)
    lazy_program._ascend(search)
    found = search.found.bound
    least = solve_program(base.part, with_rows(base.program, search.rows), Deadline(), exact=True)[2] + base.constant
    assert least - 1e-6 <= found <= least + 0.01 * abs(least)


def test_steps_of_an_ascent_are_as_in_python():
    rng = np.random.default_rng(0)
    size = rng.integers(1, 6, 20)
    start = np.concatenate([[0], np.cumsum(size)])
    column, value = rng.integers(0, 15, start[-1]), rng.choice([-1.0, 1.0], start[-1])
    results = []
    for function in (sweep, sweep.py_func):
        multiplier, gain = np.zeros(20), rng.normal(0, 2, 15) if not results else results[0][2].copy()
        before = gain.copy()
        for softness in (1.0, 0.3, 0.1):
            function(np.arange(20), start, column, value, np.ones(20), softness, multiplier, gain)
        assert (multiplier >= 0).all()
        taken = np.bincount(column, value * np.repeat(multiplier, size), 15)
        np.testing.assert_allclose(gain, before - taken, atol=1e-9)
        results.append((multiplier, gain, before))
    np.testing.assert_allclose(results[0][0], results[1][0], atol=1e-9)


def test_linear_programs_that_do_not_end_on_a_world_are_rounded_off(monkeypatch):
    from benchmarks import generators

    for module in (lazy_program, ascent):
        monkeypatch.setattr(module, "stars", lambda *arguments: stars(*arguments).pick(np.zeros(0, int)))
    model, evidence = generators.entities(14, 0.2)
    with_stars = map_lazily(without_lazy(model, evidence, [3]), Options())[1]
    assert with_stars.status == "optimal"
    assert with_stars.log_weight == pytest.approx(map_of(ml.ground(model, evidence)).log_weight, abs=1e-4)
