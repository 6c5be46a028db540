"""Sampling where exact inference cannot go: smallest effective sample size per CPU second.

Run with `pytest benchmarks/bench_marginals.py -s`.
"""

import time

import numpy as np
import pytest

from benchmarks.bench_infer import citations, smokers
from mlnlite.infer.sampling import Effort, sample

NETWORKS = {
    "smokers, 10,000 atoms": lambda: smokers(5000, 10_000),
    "citations, 2,000 atoms in blocks": lambda: citations(200, 10, 240),
}


@pytest.mark.parametrize("sampler", ["gibbs", "mcsat"])
@pytest.mark.parametrize("name", NETWORKS)
def test_effective_samples_per_second(benchmark, name, sampler):
    net = NETWORKS[name]()
    asked = np.arange(net.n_atoms), ()
    start = time.process_time()
    found = benchmark.pedantic(
        sample, (net, np.ones(net.n_variables, bool), asked, sampler, Effort(0.02, 30.0)), rounds=1
    )
    seconds = time.process_time() - start
    least = float(np.nanmin(found.size))
    benchmark.extra_info |= {"least effective size per CPU second": least / seconds, "R-hat": np.nanmax(found.r_hat)}
    print(f"\n{name}, {sampler}: {least / seconds:.0f} per CPU s, worst R-hat {np.nanmax(found.r_hat):.3f}")
    assert found.n_draws > 0
