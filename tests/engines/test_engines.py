"""Every engine gives the same rows, whole or in parts, however sparse the keys; joins stay as small as they can be."""

from __future__ import annotations

import gc
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.engines.choose import BySize
from mlnlite.engines.duckdb import DuckDBEngine
from mlnlite.engines.numpy import NumpyEngine, TooManyRowsError
from mlnlite.engines.parts import in_parts, most_rows
from mlnlite.engines.plan import AntiJoin, Compute, Count, Join, Lookup, Project, Scan, Union, Where, columns_of
from mlnlite.ground.compile import bindings
from mlnlite.ground.ground import prepared, source_of
from mlnlite.model.propositional import cubes
from tests.reference_engine import ReferenceEngine

R, S = Scan("r", ("x", "y")), Scan("s", ("y", "z"))
PLANS = [
    Join(R, S),
    Join(R, Scan("s", ("x", "y"))),
    Join(Scan("r", ("x", None)), Scan("s", ("z", None))),
    AntiJoin(R, S),
    AntiJoin(R, Scan("s", ("x", "y"))),
    Where(Join(R, S), "x", "!=", "z"),
    Compute(R, "n", (("x", 7), ("y", -3)), 5),
    Lookup(R, "t", ("x",), "n", "y"),
    Lookup(R, "t", ("y",), "n", -1),
    Lookup(R, "t", ("x",), "n", "y", dropped=1),
    Lookup(Lookup(R, "t", ("x",), "n", "y", dropped=1), "t", ("y",), "m", -1, dropped=0),
    Union((Project(R, ("y",)), Project(S, ("y",)))),
    Union((R, Scan("s", ("x", "y")))),
    Count(Join(R, S), ("x",)),
    Count(Join(R, S), ("x", "z")),
    Count(R, ()),
    Scan("r", ("x", "x")),
    Scan("r", (3, "y")),
]


def rows_of(run, plan):
    result = run(plan)
    return Counter(zip(*(result[c].tolist() for c in columns_of(plan)), strict=True))


@st.composite
def stored(draw):
    scale = draw(st.sampled_from([1, 10**9]))
    kind = np.int32 if scale == 1 else np.int64
    pairs = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), max_size=12)
    keyed = draw(st.dictionaries(st.integers(0, 5), st.integers(0, 9), max_size=5))
    columns = [np.array(sorted(draw(pairs)), kind).reshape(-1, 2) * scale for _ in range(2)]
    table = np.array(sorted(keyed.items()), kind).reshape(-1, 2) * scale
    return {name: tuple(rows.T) for name, rows in zip("rst", (*columns, table), strict=True)}


@settings(max_examples=40, deadline=None)
@given(stored())
def test_engines_agree(tables):
    runs = [engine.load(tables) for engine in (NumpyEngine(), DuckDBEngine(), ReferenceEngine())]
    for plan in PLANS:
        first, *others = (rows_of(run, plan) for run in runs)
        assert all(first == other for other in others)


@settings(max_examples=40, deadline=None)
@given(stored(), st.integers(1, 4))
def test_parts_together_are_the_whole(tables, chunk):
    run = NumpyEngine().load(tables)
    for plan in PLANS:
        whole = rows_of(run, plan)
        parts = in_parts(plan, tables, chunk)
        assert sum((rows_of(run, part) for part in parts), Counter()) == whole
        assert sum(whole.values()) <= max(1, most_rows(plan, tables)) * (2 if isinstance(plan, Union) else 1)


NARROW = {"r": (np.array([1, 1, 0, 5]), np.array([2, 3, 2, 2])), "s": (np.array([1, 1]), np.array([2, 7]))}
SPARSE = {"r": (np.array([1, 10**12, 1]), np.array([2, 3, 9]), np.array([10**12, 4, 4])), "s": (np.array([1]),) * 3}
SPARSE["s"] = tuple(np.array([c[0], c[1], 7]) for c in SPARSE["r"])


@pytest.mark.parametrize("engine", [NumpyEngine(), DuckDBEngine()])
def test_values_that_the_other_table_lacks_match_nothing(engine):
    run, same = engine.load(NARROW), Scan("s", ("x", "y"))
    assert rows_of(run, AntiJoin(R, same)) == Counter([(1, 3), (0, 2), (5, 2)])
    assert rows_of(run, Join(R, same)) == Counter([(1, 2)])
    assert sorted(run(Lookup(R, "s", ("x",), "n", -1))["n"].tolist())[:2] == [-1, -1]


@pytest.mark.parametrize("engine", [NumpyEngine(), DuckDBEngine()])
def test_keys_of_more_than_64_bits(engine):
    run = engine.load(SPARSE)
    whole, other = Scan("r", ("x", "y", "z")), Scan("s", ("x", "y", "z"))
    every = set(zip(*(c.tolist() for c in SPARSE["r"]), strict=True))
    shared = every & set(zip(*(c.tolist() for c in SPARSE["s"]), strict=True))
    assert set(rows_of(run, Join(whole, other))) == shared
    assert set(rows_of(run, AntiJoin(whole, other))) == every - shared
    assert len(shared) == 2


def test_duckdb_reads_parts_too():
    tables = {"r": (np.arange(100), np.arange(100) % 7), "s": (np.arange(7), np.arange(7) * 2)}
    run = DuckDBEngine().load(tables)
    parts = in_parts(Join(R, S), tables, 20)
    assert len(parts) > 1
    assert sum((rows_of(run, part) for part in parts), Counter()) == rows_of(run, Join(R, S))


def test_a_join_too_large_for_numpy_goes_to_the_database(monkeypatch):
    tables = {"r": (np.arange(50), np.zeros(50, int)), "s": (np.zeros(50, int), np.arange(50))}
    with pytest.raises(TooManyRowsError):
        NumpyEngine(1000).load(tables)(Join(R, S))
    monkeypatch.setattr("mlnlite.engines.choose.MOST_ROWS", 1000)
    assert sum(rows_of(BySize().load(tables), Join(R, S)).values()) == 2500


def test_what_a_database_spills_goes_to_a_folder_that_is_removed(tmp_path):
    rng = np.random.default_rng(0)
    run = DuckDBEngine(memory=100 * 10**6, scratch=str(tmp_path)).load({"r": tuple(rng.integers(0, 9, (2, 1000)))})
    assert len(list(tmp_path.iterdir())) == 1
    assert run(Count(R, ("x",)))["count"].sum() == 1000
    del run
    gc.collect()
    assert list(tmp_path.iterdir()) == []


def test_memory_of_a_database_is_bounded():
    n = 1_500_000
    tables = {"r": (np.arange(n), np.arange(n) % 1000)}
    run = DuckDBEngine(memory=60 * 10**6).load(tables)
    with pytest.raises(ml.LimitReached, match="memory"):
        run(Count(Join(R, Scan("r", ("z", "y"))), ("x", "z")))


def test_a_database_that_cannot_write_what_it_spills_says_so(tmp_path):
    run = DuckDBEngine(memory=60 * 10**6, scratch=str(tmp_path)).load({"r": (np.arange(180), np.arange(180))})
    (folder,) = tmp_path.iterdir()
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()
    folder.write_text("no folder any more")
    product = Join(Join(Scan("r", ("x", "a")), Scan("r", ("y", "b"))), Scan("r", ("z", "c")))
    with pytest.raises(ml.LimitReached, match="temporary files"):
        run(Count(product, ("x", "y", "z")))
    folder.unlink()
    folder.mkdir()


CHAIN = """*Start(a)
*E0(a, a)
*E1(a, a)
*E2(a, a)
*E3(a, a)
Goal(a, a)
1 E2(y2, y3) ^ E0(y0, y1) ^ E3(y3, y4) ^ Start(y0) ^ E1(y1, y2) => Goal(y0, y4)
"""


def test_no_intermediate_of_a_long_join_is_larger_than_needed():
    n, rng = 2000, np.random.default_rng(0)
    model = ml.model_from_text(f"{CHAIN}a = {{{', '.join(f'A{i}' for i in range(n))}}}\n")
    facts = [f"E{i}(A{x}, A{y})" for i in range(4) for x in range(n) for y in rng.choice(n, 2, replace=False)]
    evidence = ml.evidence_from_text("\n".join(["Start(A5)", "Start(A7)", *facts]), model=model)
    model, evidence, tables = prepared(model, evidence)
    source = source_of(0, model.templates[0], evidence)
    (cube,) = cubes(source.formula.body, False)
    run = NumpyEngine().load(tables)
    sizes = [len(next(iter(run(p).values()))) for p in _joins(bindings(source, cube, source.formula.free))]
    assert sizes == [32, 16, 8, 4]


def _joins(plan):
    while isinstance(plan, Join | AntiJoin | Where):
        if isinstance(plan, Join):
            yield plan
        plan = plan.source if isinstance(plan, Where) else plan.left
