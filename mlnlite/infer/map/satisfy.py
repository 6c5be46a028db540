"""A world that the hard formulas allow: comes in a component as cells, goes out a value for each variable, or none."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from pysat.solvers import Solver

from mlnlite.ground.network import Int64
from mlnlite.infer.reduce.conjunctions import starts_of
from mlnlite.infer.reduce.narrow import written
from mlnlite.infer.reduce.parts import Part


def feasible_world(part: Part) -> Int64 | None:
    """A world without a forbidden cell.

    Args:
        part: a component.

    Returns:
        Shape (n,), or None if there is none.
    """
    plain, constant = written(part)
    if np.isneginf(constant):
        return None
    first = starts_of(plain.cardinality) + 1
    with Solver(name="cadical153") as solver:
        for begin, size in zip(first.tolist(), plain.cardinality.tolist(), strict=True):
            solver.add_clause(list(range(begin, begin + size)))
            for a, b in combinations(range(begin, begin + size), 2):
                solver.add_clause([-a, -b])
        for cells in plain.cells:
            hard = np.isneginf(cells.amount)
            solver.append_formula((-(first[cells.scope[hard]] + cells.value[hard])).tolist())
        if not solver.solve():
            return None
        true = np.array(solver.get_model()) > 0
    own = zip(first, part.cardinality, strict=False)
    return np.array([int(true[b - 1 : b - 1 + k].argmax()) for b, k in own])
