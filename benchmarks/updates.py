"""Times one fact added to a session, or withdrawn, against grounding whole: `python benchmarks/updates.py [people]`."""

from __future__ import annotations

import sys
import time

import numpy as np
from ground import friends

import mlnlite as ml
from mlnlite.ground.update import updated
from mlnlite.model.change import UNKNOWN, status_of, with_status

REPEATS = 10


def main():
    """Changes one atom of each kind, back and forth; the medians of CPU seconds."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    model, evidence = friends(n)
    whole = median(ml.ground, model, evidence)
    network = ml.ground(model, evidence)
    print(f"{n:,} people, {network.n_factors:,} ground formulas: ground whole {whole * 1e3:.1f} ms")
    rng = np.random.default_rng(1)
    for name in ("Smokes", "Friends"):
        pair = rng.integers(0, n, (1, evidence.predicates[name].arity)).astype(np.int32)
        atom = evidence.atom_number(name, pair)
        (was,) = status_of(evidence, atom)
        now = with_status(evidence, atom, np.array([1 if was == UNKNOWN else UNKNOWN], np.int8))
        there = updated(network, now, atom)
        forth, back = median(updated, network, now, atom), median(updated, there, evidence, atom)
        for what, seconds in (("there", forth), ("back", back)):
            print(f"{evidence.atom_text(int(atom[0]))} {what}: {seconds * 1e3:.1f} ms, {seconds / whole:.3f} of it")


def median(work, *given):
    """CPU seconds."""
    found = []
    for _ in range(REPEATS):
        start = time.process_time()
        work(*given)
        found.append(time.process_time() - start)
    return float(np.median(found))


if __name__ == "__main__":
    main()
