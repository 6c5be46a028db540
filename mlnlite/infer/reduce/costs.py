"""Gains to costs: comes in a component, goes out an equal one (up to a constant) in which pairs of atoms only cost.

A cell that pays needs a row for each of its literals in a linear program, one that costs a single row.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.parts import Part


def with_costs(part: Part) -> tuple[Part, float]:
    """The component, and what every world gains besides.

    Args:
        part: any component; its pairs of atoms with a gain change, everything else stays.
    """
    cells: list[Cells] = []
    constant = 0.0
    for c in part.cells:
        if c.scope.shape[1] != 2 or not (c.amount > 0).any():
            cells.append(c)
            continue
        changed, gain = _pairs(c, part)
        cells, constant = [*cells, *changed], constant + gain
    return replace(part, cells=tuple(cells)), constant


def _pairs(cells: Cells, part: Part) -> tuple[list[Cells], float]:
    """Pairs: those of atoms as tables of which the largest entry is 0, the others as they are."""
    atoms = (part.cardinality[cells.scope] == 2).all(axis=1)
    key = cells.scope[:, 0].astype(np.int64) * len(part.cardinality) + cells.scope[:, 1]
    names, pair = np.unique(key, return_inverse=True)
    pays = np.zeros(len(names), np.bool_)
    pays[pair[cells.amount > 0]] = True
    changes = atoms & pays[pair]
    table = np.zeros((len(names), 4))
    np.add.at(table, (pair[changes], 2 * cells.value[changes, 0] + cells.value[changes, 1]), cells.amount[changes])
    peak = table.max(axis=1)
    peak[np.isneginf(peak)] = 0.0  # nothing is allowed, and stays so
    table -= peak[:, None]
    row, entry = np.nonzero(table)
    first, second = np.divmod(names[row], len(part.cardinality))
    scope = np.stack([first, second], axis=1).astype(np.int32)
    value = np.stack(np.divmod(entry, 2), axis=1).astype(np.int32)
    kept = Cells(cells.scope[~changes], cells.value[~changes], cells.amount[~changes])
    return [kept, Cells(scope, value, table[row, entry])], float(peak.sum())
