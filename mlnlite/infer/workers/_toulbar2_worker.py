"""The process that runs toulbar2: problems come in on standard input, answers go out on standard output.

toulbar2 holds the interpreter lock while it solves and prints where it likes, so it gets a process of its own. What it
keeps in globals can spoil the proof of a later problem, so each problem gets a fork.
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any

from pytoulbar2 import CFN, pytb2


def main() -> None:
    """Reads one problem per line, writes one answer per line."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        for eliminates in (True, False):  # the solver crashes now and then where it eliminates variables as it searches
            child = os.fork()
            if child == 0:
                answers.write(json.dumps(solve(json.loads(line), eliminates=eliminates)) + "\n")
                answers.flush()
                os._exit(0)
            if os.waitpid(child, 0)[1] == 0:
                break
        else:
            answers.write("null\n")
            answers.flush()


def solve(problem: dict[str, Any], *, eliminates: bool = True) -> dict[str, Any]:
    """Minimises a sum of integer costs.

    Args:
        problem: `cardinality` of each variable; `functions` as [scope, default cost, cells, costs], cells being lists
            of values and a cost of null forbidding the cell; `seconds`, 0 for no limit; `seed`; `backtracks`, null
            for no limit.
        eliminates: whether the search eliminates variables of few neighbours.

    Returns:
        `state` and its `cost`, null if none was found; `bound`, the least that any state costs, null if unknown;
        `optimal`, whether the state is proved to be one of least cost.
    """
    network = CFN(resolution=0, seed=problem["seed"], vac=0, verbose=-1)
    if not eliminates:
        pytb2.option.elimDegree = -1
    if problem["backtracks"] is not None:
        pytb2.option.backtrackLimit = problem["backtracks"]
    for v, size in enumerate(problem["cardinality"]):
        network.AddVariable(f"v{v}", range(size))
    try:
        for scope, default, cells, costs in problem["functions"]:
            network.AddCompactFunction(scope, default, cells, [network.Top if c is None else c for c in costs])
        found = network.Solve(timeLimit=problem["seconds"])
    except network.Contradiction:
        found = None
    if found is None:
        return {"state": None, "cost": None, "bound": None, "optimal": False}
    state, cost = list(found[0]), int(found[1])
    bound = int(network.GetDDualBound())
    return {"state": state, "cost": cost, "bound": bound, "optimal": bound >= cost}


if __name__ == "__main__":
    main()
