"""The process that runs Ganak: problems come in on standard input, answers go out on standard output.

Ganak cannot be interrupted, so it gets a process of its own, which can be ended.
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any


def main() -> None:
    """Reads one problem per line, writes one answer per line; what Ganak prints goes elsewhere."""
    with os.fdopen(os.dup(1), "w") as out:
        os.dup2(2, 1)
        for line in sys.stdin:
            out.write(json.dumps(count(json.loads(line))) + "\n")
            out.flush()


def count(problem: dict[str, Any]) -> dict[str, Any]:
    """Counts models by weight, of all, and of those in which a literal holds.

    Args:
        problem: `n_variables`, `clauses`, `weights` (literal, weight), `literals` to condition on.

    Returns:
        `total`, and `each` for each of the literals.
    """
    return {"total": _count(problem, []), "each": [_count(problem, [[x]]) for x in problem["literals"]]}


def _count(problem: dict[str, Any], more: list[list[int]]) -> float:
    """Weight of the models that satisfy some more clauses."""
    from pyganak import WeightedCounter

    counter = WeightedCounter()
    counter.new_vars(problem["n_variables"])
    counter.add_clauses(problem["clauses"] + more)
    for literal, weight in problem["weights"]:
        counter.set_lit_weight(literal, weight)
    return float(counter.count())


if __name__ == "__main__":
    main()
