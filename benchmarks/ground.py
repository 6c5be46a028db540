"""Times grounding against size and prints a table: `python benchmarks/ground.py [largest number of people]`.

Each row is a process of its own, with compiled bytecode as in an installed package: CPU and wall seconds of `ground`,
CPU seconds of the whole process, making the input included. The exponent is fitted to CPU seconds over the sizes;
ground formulas a second beyond start-up are those by which the largest input exceeds the smallest, over the CPU
seconds of `ground` by which it does.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

DATA = Path(__file__).parents[2] / "shared" / "data" / "mln"
FRIENDS = """*Friends(person, person)
Smokes(person)
Cancer(person)
0.5 Smokes(x) => Cancer(x)
0.4 Friends(x, y) ^ Smokes(x) => Smokes(y)
-0.3 Smokes(x)
"""
TRAP = """P(a)
Q(a)
*R(a, b, b)
*T(a, b)
1 P(x) ^ T(x, y) ^ T(x, z) ^ R(x, y, z) => Q(x)
"""


def friends(n):
    """`n` people with 10 random friends each; a tenth of Smokes is known."""
    import mlnlite as ml
    from mlnlite.model.evidence import Evidence, Facts
    from mlnlite.model.symbols import Type

    model = ml.model_from_text(FRIENDS)
    rng = np.random.default_rng(0)
    pairs = np.repeat(np.arange(n), 10) * n + rng.integers(0, n, 10 * n)
    pairs.sort()  # np.unique, which hashes, takes a minute here
    pairs = pairs[np.append(True, pairs[1:] != pairs[:-1])]
    pairs = np.stack(np.divmod(pairs, n), 1).astype(np.int32)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    known = np.sort(rng.choice(n, n // 10, replace=False)).astype(np.int32)[:, None]
    zeros = lambda k: np.zeros(k, np.int32)  # noqa: E731
    facts = {
        "Friends": Facts(zeros(len(pairs)), pairs, np.ones(len(pairs), bool)),
        "Smokes": Facts(zeros(len(known)), known, rng.random(len(known)) < 0.5),
        "Cancer": Facts(zeros(0), np.empty((0, 1), np.int32), np.empty(0, bool)),
    }
    types = {"person": Type("person", tuple(f"P{i}" for i in range(n)))}
    return model, Evidence(types, dict(model.predicates), facts, {"person": np.ones((1, n), bool)})


def transitivity(n):
    """All triples of `n` open constants."""
    import mlnlite as ml

    constants = ", ".join(f"R{i}" for i in range(n))
    model = ml.model_from_text(f"S(r, r)\nr = {{{constants}}}\n1.5 S(x, y) ^ S(y, z) => S(x, z)\n")
    return model, ml.no_evidence(model)


def trap(n):
    """One rule of five literals over three variables, `n` people and as many things, 5,000 facts."""
    import mlnlite as ml

    rng = np.random.default_rng(0)
    model = ml.model_from_text(TRAP + f"a = {{{', '.join(f'A{i}' for i in range(n))}}}\n")
    lines = [f"T(A{x}, B{y})" for x, y in rng.integers(0, n, (2500, 2))]
    lines += [f"R(A{x}, B{y}, B{z})" for x, y, z in rng.integers(0, n, (2500, 3))]
    return model, ml.evidence_from_text("\n".join(lines), model=model)


def sample(name):
    """A sample of Tuffy's, read from its files."""
    import mlnlite as ml

    model = ml.read_model(DATA / name / "prog.mln")
    return model, ml.read_evidence(DATA / name / "evidence.db", model=model)


CASES = {"friends": friends, "transitivity": transitivity, "trap": trap, "sample": sample}


def measure(case, size):
    """In this process: ground, and print what it took."""
    import mlnlite as ml

    model, evidence = CASES[case](int(size) if size.isdigit() else size)
    start, cpu = time.perf_counter(), time.process_time()
    network = ml.ground(model, evidence)
    wall, cpu = time.perf_counter() - start, time.process_time() - cpu
    arrays = [a for block in network.clauses for a in (block.literals, block.weight, block.count)]
    bytes_each = sum(a.nbytes for a in arrays) / max(network.n_factors, 1)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(network.n_atoms, network.n_factors, cpu, wall, time.process_time(), peak, bytes_each)


def in_a_process(case, size):
    """What `measure` prints, in a process that finds all modules compiled, as those of an installed package are."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    with_cache = {**environment, "PYTHONPYCACHEPREFIX": str(Path(tempfile.gettempdir()) / "mlnlite-benchmark-bytecode")}
    command = [sys.executable, __file__, "--one", case, size]
    out = subprocess.run(command, capture_output=True, text=True, check=True, env=with_cache)
    return tuple(map(float, out.stdout.split()))


def main():
    largest = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    sizes = [n for n in (1_000, 10_000, 100_000, 1_000_000) if n <= largest]
    runs = [("friends", str(n)) for n in sizes] + [("transitivity", str(n)) for n in (20, 100, 200)]
    runs += [("trap", "10000"), *(("sample", name) for name in ("class", "cse") if (DATA / name).exists())]
    print(f"{'case':<22}{'atoms':>12}{'factors':>13}{'ground CPU':>12}{'wall':>8}{'process':>9}{'MB':>7}{'B each':>8}")
    in_a_process("friends", "1000")  # makes the bytecode
    found = {}
    for case, size in runs:
        atoms, factors, seconds, wall, process, peak, each = in_a_process(case, size)
        found.setdefault(case, []).append((factors, seconds))
        head = f"{case + ' ' + size:<22}{atoms:>12,.0f}{factors:>13,.0f}"
        print(f"{head}{seconds:>12.2f}{wall:>8.2f}{process:>9.2f}{peak:>7,.0f}{each:>8.1f}")
    if len(sizes) > 1:
        times = [seconds for _, seconds in found["friends"]]
        print(f"friends: exponent {np.polyfit(np.log(sizes), np.log(times), 1)[0]:.2f}")
    for case in ("friends", "transitivity"):
        (few, start), (many, end) = found[case][0], found[case][-1]
        print(f"{case}: {(many - few) / (end - start) / 1e6:.1f} million ground formulas a CPU second beyond start-up")


if __name__ == "__main__":
    measure(*sys.argv[2:4]) if sys.argv[1:2] == ["--one"] else main()
