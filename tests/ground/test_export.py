"""Other programs read what is exported, and find the same optimum and the same partition function."""

from __future__ import annotations

import itertools
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from pysat.examples.rc2 import RC2
from pysat.formula import WCNF

import mlnlite as ml
from mlnlite.ground.export.cfn import cfn
from mlnlite.ground.export.scopes import log_tables
from mlnlite.ground.export.text import text
from mlnlite.ground.export.uai import uai
from mlnlite.ground.export.wcnf import SCALE, wcnf
from mlnlite.ground.export.write import export
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.reduce.potentials import decided_log_weight
from tests.models import evidence_texts, model_texts


def networks(text_, facts):
    model = ml.model_from_text(text_)
    try:
        network = ml.ground(model, ml.evidence_from_text(facts, model=model))
        return network, map_of(network)
    except ml.Contradiction:
        return None, None


def best_gain(network):
    """What the best any world could gain from open formulas: every positive gain, no negative one."""
    soft = np.isfinite(network.weights)
    return float(np.sum(np.maximum(network.weights[soft], 0.0) * network.n_open[soft]))


@settings(max_examples=30, deadline=None)
@given(model_texts(), evidence_texts())
def test_wcnf_has_the_same_optimum(text_, facts):
    network, best = networks(text_, facts)
    if network is None:
        return
    with RC2(WCNF(from_string=wcnf(network))) as solver:
        assert solver.compute() is not None
        cost = solver.cost / SCALE
    assert best_gain(network) - cost + decided_log_weight(network) == pytest.approx(best.log_weight, abs=1e-4)


@settings(max_examples=30, deadline=None)
@given(model_texts(), evidence_texts())
def test_uai_has_the_same_partition_function(text_, facts):
    network, _ = networks(text_, facts)
    if network is None or np.prod(network.cardinality.astype(float)) > 5000:
        return
    numbers = iter(uai(network).split()[1:])
    n = int(next(numbers))
    sizes = [int(next(numbers)) for _ in range(n)]
    scopes = [[int(next(numbers)) for _ in range(int(next(numbers)))] for _ in range(int(next(numbers)))]
    tables = []
    for scope in scopes:
        entries = [float(next(numbers)) for _ in range(int(next(numbers)))]
        tables.append(np.array(entries).reshape([sizes[v] for v in scope]))
    total = sum(
        math.prod(t[tuple(values[v] for v in s)] for s, t in zip(scopes, tables, strict=True))
        for values in itertools.product(*map(range, sizes))
    )
    assert math.log(total) + decided_log_weight(network) == pytest.approx(marginals_of(network).log_z, abs=1e-9)


@settings(max_examples=20, deadline=None)
@given(model_texts(), evidence_texts())
def test_cfn_charges_the_best_world_what_it_pays(text_, facts):
    network, best = networks(text_, facts)
    if network is None:
        return
    problem = json.loads(cfn(network))
    value = dict.fromkeys(range(network.n_variables), 0)
    for a in np.flatnonzero(best.truth):
        value[int(network.variable[a])] = int(network.value[a])
    cost = 0.0
    for function in problem["functions"].values():
        scope = [int(x[1:]) for x in function["scope"]]
        shape = [len(problem["variables"][f"x{v}"]) for v in scope]
        cost += np.array(function["costs"]).reshape(shape)[tuple(value[v] for v in scope)]
    best_of_each = sum(table.max() for _, table in log_tables(network))
    assert best_of_each - cost + decided_log_weight(network) == pytest.approx(best.log_weight, abs=1e-4)


def test_text_reads_back_as_a_model_of_the_same_weight():
    model = ml.model_from_text("S(p)\nC(p)\n1.5 S(x) => C(x)\n-0.5 S(x) ^ C(x)\nS(x) v C(x).")
    network = ml.ground(model, ml.evidence_from_text("S(A)\n!C(B)", model=model))
    again = ml.model_from_text("S(p)\nC(p)\n" + text(network))
    facts = "S(A)\n!C(B)"
    expected = ml.marginal(model, ml.evidence_from_text(facts, model=model), "S, C")
    found = ml.marginal(again, ml.evidence_from_text(facts, model=again), "S, C")
    assert dict(found) == pytest.approx(dict(expected))


def test_evidence_of_another_model_is_refused():
    first, second = (ml.model_from_text(f"S(p)\n1 S({c})") for c in "AB")
    with pytest.raises(ml.QueryMistake, match="read for another model"):
        ml.marginal(second, ml.no_evidence(first))


@pytest.mark.parametrize("ending", ["txt", "wcnf", "uai", "cfn", "dot", "graphml", "parquet"])
def test_files(ending, tmp_path):
    model = ml.model_from_text("S(p)\nF(p, p)\nR(p, c!)\nc = {Red, Blue}\n1.5 F(x, y) => (S(x) <=> S(y))\n1 R(x, Red)")
    network = ml.ground(model, ml.evidence_from_text("S(A)\n!S(B)\nF(A, C)", model=model))
    export(network, tmp_path / f"network.{ending}")
    assert (tmp_path / f"network.{ending}").stat().st_size > 100
    assert [p.name for p in tmp_path.iterdir()] == [f"network.{ending}"]


def test_unknown_ending(tmp_path):
    network = ml.ground(*(lambda m: (m, ml.no_evidence(m)))(ml.model_from_text("S(p)\np = {A}\n1 S(x)")))
    with pytest.raises(ml.QueryMistake, match=r"network\.xyz ends in none of"):
        export(network, tmp_path / "network.xyz")
    with pytest.raises(ml.QueryMistake, match="there is no folder"):
        export(network, tmp_path / "not" / "network.txt")
