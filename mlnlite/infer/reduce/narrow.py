"""Wide cells to chains of narrow ones: comes in a component, goes out one with auxiliary variables after its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlnlite.infer.reduce.conjunctions import MAX_ARITY, Cells, Conjunctions, cells_of, split_wide
from mlnlite.infer.reduce.counting import diagram, written_out
from mlnlite.infer.reduce.parts import Part, PartAnswer
from mlnlite.infer.reduce.propagate import joined


def written(part: Part) -> tuple[Part, float]:
    """A component without counting factors but cells for them, and what every world gains besides.

    Its own variables stay the first ones; where a counting factor allows nothing, neither does the component.
    """
    cardinality, rows = part.cardinality, list[Conjunctions]()
    for chains in part.chains:
        plan = diagram(chains.worth, chains.steps)
        if plan is None:
            return replace(part, chains=()), -np.inf
        add, cardinality, _ = written_out(chains, plan, cardinality)
        rows += add
    cells, constant = list(part.cells), 0.0
    for row in rows:
        found, gain = cells_of(row, cardinality)
        cells, constant = [*cells, *found], constant + gain
    return replace(part, cardinality=cardinality, cells=joined(cells), chains=()), constant


def read_back(answer: PartAnswer, part: Part, constant: float) -> PartAnswer:
    """What an answer about a component that was `written` says of the component as it was."""
    if answer.world is None or np.isneginf(constant):
        return replace(answer, world=None, bound=answer.bound + constant, optimal=False)
    return replace(answer, world=answer.world[: len(part.variables)], bound=answer.bound + constant)


def narrowed(part: Part) -> Part:
    """A component without cells too wide for a table; its own variables stay the first ones, see `split_wide`."""
    if all(c.scope.shape[1] <= MAX_ARITY for c in part.cells):
        return part
    cardinality, cells = part.cardinality, []
    for c in part.cells:
        rows = Conjunctions(c.scope, c.value, np.ones(c.scope.shape, np.bool_), c.amount)
        narrow, cardinality = split_wide(rows, cardinality)
        cells += [n for n in narrow if len(n.amount)]
    found: list[Cells] = []
    for row in cells:
        found += cells_of(row, cardinality)[0]
    return replace(part, cardinality=cardinality, cells=tuple(found))
