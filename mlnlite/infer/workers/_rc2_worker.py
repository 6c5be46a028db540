"""The process that runs RC2: problems come in on standard input, answers go out on standard output.

RC2 cannot be interrupted and says nothing before it is done, so it gets a process of its own, which can be ended.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from pysat.examples.rc2 import RC2Stratified
from pysat.formula import WCNF
from pysat.solvers import Solver


def main() -> None:
    """Reads one problem per line, writes one answer per line."""
    for line in sys.stdin:
        sys.stdout.write(json.dumps(solve(json.loads(line))) + "\n")
        sys.stdout.flush()


def solve(problem: dict[str, Any]) -> dict[str, Any]:
    """Minimises the weight of violated soft clauses.

    Args:
        problem: `hard` clauses, `soft` clauses and their integer `weights`.

    Returns:
        `state`, the literals that hold, and its `cost`; null if the hard clauses cannot be satisfied.
    """
    with Solver(name="g4", bootstrap_with=problem["hard"]) as solver:
        if not solver.solve():
            return {"state": None, "cost": None}
        if not problem["soft"]:
            return {"state": solver.get_model(), "cost": 0}
    formula = WCNF()
    formula.extend(problem["hard"])
    formula.extend(problem["soft"], weights=problem["weights"])
    with RC2Stratified(formula, solver="g4", adapt=True, exhaust=True, minz=True, trim=5) as solver:
        state = solver.compute()
        return {"state": state, "cost": solver.cost}


if __name__ == "__main__":
    main()
