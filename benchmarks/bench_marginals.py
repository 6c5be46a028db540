"""Sampling where exact inference cannot go: smallest effective sample size, in all and per CPU second, worst R-hat.

Run with `pytest benchmarks/bench_marginals.py -s`.
"""

import time

import numpy as np
import pytest

import mlnlite as ml
from benchmarks.bench_infer import citations, smokers
from mlnlite.infer.approach import Approach
from mlnlite.infer.marginal.ladder import solve

NETWORKS = {
    "smokers, 10,000 atoms": lambda: smokers(5000, 10_000),
    "citations, 2,000 atoms in blocks": lambda: citations(200, 10, 240),
}


@pytest.mark.parametrize("method", ["auto", "gibbs", "mcsat"])
@pytest.mark.parametrize("name", NETWORKS)
def test_effective_samples_per_second(benchmark, name, method):
    net = NETWORKS[name]()
    start, begin = time.process_time(), time.perf_counter()
    found = benchmark.pedantic(solve, (net, np.arange(net.n_atoms), (), Approach(method, precision=0.02)), rounds=1)
    seconds, wall = time.process_time() - start, time.perf_counter() - begin
    least, worst = float(np.nanmin(found.columns.size)), float(np.nanmax(found.columns.r_hat))
    said = {"least effective size": least, "worst R-hat": worst, "least per CPU second": least / seconds}
    benchmark.extra_info |= said
    rare = sum("never seen otherwise" in m for m in found.methods)
    print(f"\n{name}, {method}: " + ", ".join(f"{k} {v:.4g}" for k, v in said.items()))
    print(f"  {seconds:.1f} CPU s, {wall:.1f} s; {found.endings}; {rare} never seen otherwise, not counted")
    assert least > 0


CROWD = """Smokes(person)
Cancer(person)
Drinks(person, drink)
Job(person, job!)
Seen(person)
drink = {Tea, Coffee, Wine}
job = {Nurse, Miner, Clerk}
1.5 Smokes(x) => Cancer(x)
0.8 Smokes(x) ^ Drinks(x, d)
-0.5 Drinks(x, +d)
0.7 Job(x, +j) ^ Smokes(x)
1.0 Cancer(x) => EXIST d Drinks(x, d)
!Cancer(x) v !Drinks(x, Wine).
"""


@pytest.mark.parametrize("method", ["auto", "exact"])
@pytest.mark.parametrize("n", [10_000, 100_000, 1_000_000])
def test_classes_of_people(benchmark, n, method):
    """Formulas about one person at a time: one of each class (auto), or all of them ground (exact)."""
    model = ml.model_from_text(CROWD)
    names = [f"P{i}" for i in range(n)]
    tables = {
        "Seen": {"person": names},
        "Smokes": {"person": names[::3]},
        "Job": {"person": names[::7], "job": ["Nurse"] * len(names[::7])},
        "Drinks": {"person": names[::5], "drink": ["Tea"] * len(names[::5])},
    }
    evidence = ml.Evidence.from_tables(tables, model=model)
    start = time.process_time()
    found = benchmark.pedantic(ml.marginal, (model, evidence, "Cancer"), {"method": method}, rounds=1)
    seconds = time.process_time() - start
    print(f"\n{n:,} people, {method}: {seconds:.2f} CPU s; {set(found.methods)}, log Z {found.log_z:.6f}")
    assert found.exact.all()
