"""Wide cells to chains of narrow ones: comes in a component, goes out one with auxiliary variables after its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlnlite.infer.reduce.conjunctions import MAX_ARITY, Cells, Conjunctions, cells_of, split_wide
from mlnlite.infer.reduce.parts import Part


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
