"""The most probable world of many workloads by every rung that can: `python benchmarks/map.py [WORKLOAD ...]`.

Each cell runs in a process of its own, so that seconds are CPU seconds of everything after reading (children included)
and memory is the peak of the process. Real data is looked for in `../shared/data`.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

import mlnlite as ml
from benchmarks import generators
from mlnlite.infer.map.rungs import METHODS, Method

DATA = Path(__file__).parents[2] / "shared" / "data"
LIMIT = 60.0


def _file(folder: str, program: str = "prog.mln", evidence: str = "evidence.db"):
    def read():
        model = ml.read_model(DATA / folder / program)
        return model, ml.read_evidence(DATA / folder / evidence, model=model)

    return read


WORKLOADS: dict[str, tuple[Callable[[], tuple], tuple[Method, ...]]] = {
    "class": (_file("mln/class"), ("auto", "ve", "ilp", "wcsp", "annealing")),
    "cse": (_file("mln/cse"), ("auto", "ilp", "wcsp", "annealing", "maxwalksat")),
    "rc1000": (_file("mln/rc1000", "prog-fixed.mln"), ("auto",)),
    "smoke": (_file("mln/smoke"), METHODS),
    "alarm-kreator": (_file("pracmln/alarm", "mlns/alarm-kreator.mln", "dbs/query1.db"), ("auto",)),
    "alarm-noisyor": (_file("pracmln/alarm", "mlns/alarm-noisyor.mln", "dbs/query1.db"), ("auto",)),
    "meals-1": (_file("pracmln/meals", "mlns/meals_any_for.mln", "dbs/query1.db"), ("auto",)),
    "meals-2": (_file("pracmln/meals", "mlns/meals_any_for.mln", "dbs/query2.db"), ("auto",)),
    "smoking": (_file("pracmln/smokers", "mlns/wts.pybpll.smoking-train-smoking.mln", "dbs/smoking-test.db"), METHODS),
    "smokers-20000": (lambda: generators.smokers(10_000), ("auto", "mincut", "annealing")),
    "smokers-200000": (lambda: generators.smokers(100_000), ("auto", "mincut")),
    "smokers-2000000": (lambda: generators.smokers(1_000_000), ("auto",)),
    "entities-100-.05": (lambda: generators.entities(100, 0.05), ("auto",)),
    "entities-100-.05-soft": (lambda: generators.entities(100, 0.05, hard=False), ("auto",)),
    "entities-100-.1": (lambda: generators.entities(100, 0.1), ("auto",)),
    "entities-100-.2": (lambda: generators.entities(100, 0.2), ("auto",)),
    "entities-300-.05": (lambda: generators.entities(300, 0.05), ("auto",)),
    "entities-300-.1": (lambda: generators.entities(300, 0.1), ("auto",)),
    "entities-300-.1-soft": (lambda: generators.entities(300, 0.1, hard=False), ("auto",)),
    "rivals-1000": (generators.rivals, ("auto", "ilp", "wcsp", "annealing", "maxwalksat")),
    "rivals-1000-opposed": (lambda: generators.rivals(opposed=True), ("auto", "ilp", "wcsp", "annealing")),
    "regions-32": (generators.regions, ("auto", "ilp", "wcsp", "annealing", "maxwalksat")),
    "items-1000": (generators.items, ("auto", "ilp", "wcsp", "annealing", "maxwalksat")),
}


def measure(name: str, method: Method, limit: float, queue: multiprocessing.Queue) -> None:
    model, evidence = WORKLOADS[name][0]()
    start = time.process_time() + _children()
    try:
        state = ml.map_state(model, evidence, method=method, time_limit=limit)
        value, gap, status = f"{state.cost:.2f}", f"{state.gap:.3g}", state.status
    except ml.MlnError as error:
        value, gap, status = "-", "-", type(error).__name__
    seconds = time.process_time() + _children() - start
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    queue.put(f"| {name} | {method} | {seconds:.2f} | {memory:.0f} | {value} | {gap} | {status} |")


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("workloads", nargs="*", choices=[[], *WORKLOADS], default=[])
    parser.add_argument("--limit", type=float, default=LIMIT, help="[s] for each search")
    arguments = parser.parse_args()
    print("| workload | method | CPU s | MB | cost | gap | status |\n|---|---|---|---|---|---|---|")
    context = multiprocessing.get_context("spawn")
    for name in arguments.workloads or WORKLOADS:
        for method in WORKLOADS[name][1]:
            queue = context.Queue()
            process = context.Process(target=measure, args=(name, method, arguments.limit, queue))
            process.start()
            print(queue.get(), flush=True)
            process.join()


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))
    main()
