"""Sampling where exact inference cannot go: smallest effective sample size, in all and per CPU second, worst R-hat.

Run with `pytest benchmarks/bench_marginals.py -s`.
"""

import time

import numpy as np
import pytest

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
    least, worst = float(np.nanmin(found.size)), float(np.nanmax(found.r_hat))
    said = {"least effective size": least, "worst R-hat": worst, "least per CPU second": least / seconds}
    benchmark.extra_info |= said
    rare = sum("never seen otherwise" in m for m in found.methods)
    print(f"\n{name}, {method}: " + ", ".join(f"{k} {v:.4g}" for k, v in said.items()))
    print(f"  {seconds:.1f} CPU s, {wall:.1f} s; {found.endings}; {rare} never seen otherwise, not counted")
    assert least > 0
