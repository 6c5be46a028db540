"""Times questions to a compiled session of the handover model: `python benchmarks/session.py [questions]`."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

import mlnlite as ml

MODEL = Path(__file__).parents[2] / "shared" / "data" / "handover" / "learnt.mln"
TOLD = ["hasShape", "isA", "hasAffordance", "handover", "armMobility"]


def main():
    """Compiles once, asks about random objects, prints the median and the 99th percentile."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    model = ml.read_model(MODEL)
    session = ml.compile(model, query="graspRegion", evidence_predicates=TOLD, constants={"cluster": ["x"]})
    evidence, rng = session.network.evidence, np.random.default_rng(0)
    names = {p: evidence.types[evidence.predicates[p].types[-1]].constants for p in TOLD}
    wall, cpu = [], []
    for _ in range(n):
        values = {p: str(rng.choice(names[p])) for p in TOLD}
        facts = [(p, "x", v) if evidence.predicates[p].arity == 2 else (p, v) for p, v in values.items()]
        start, used = time.perf_counter(), time.process_time()
        session.query(facts)
        wall.append(time.perf_counter() - start)
        cpu.append(time.process_time() - used)
    for name, times in (("wall", wall), ("CPU", cpu)):
        median, late = np.percentile(times, [50, 99]) * 1000
        print(f"{n:,} questions: {name} median {median:.2f} ms, 99 % {late:.2f} ms")


if __name__ == "__main__":
    main()
