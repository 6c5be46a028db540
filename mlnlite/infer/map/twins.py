"""Components that are the same but for names: come in components, goes out which is a copy of which, value by value.

Each value of each variable stands as an atom of a network, each cell as a factor; so copies are found even where
variables, or their values, stand in another order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlnlite.ground.isomorphism import copies
from mlnlite.ground.network import Clauses, Counts, Int32, Int64, Network
from mlnlite.infer.reduce.conjunctions import starts_of
from mlnlite.infer.reduce.parts import Part
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model


@dataclass(frozen=True, slots=True)
class Twins:
    """Which components are copies.

    Attributes:
        original: shape (n_parts,), the first component that each is a copy of; its own number for an original.
        first: shape (n_parts + 1,), where the variables of each component start in an array over all of them.
        start: shape (n_variables + 1,), where the values of each variable start in an array over all of them.
        twin: shape (total cardinality,), for each value the one of the original that it corresponds to.
    """

    original: Int64
    first: Int64
    start: Int64
    twin: Int64

    def world(self, number: int, world: Int64) -> Int64:
        """The world of a copy that corresponds to a world of its original.

        Args:
            number: of the copy.
            world: shape (n,), a value for each variable of the original.
        """
        other, begin, end = self.original[number], self.first[number], self.first[number + 1]
        holds = np.zeros(len(self.twin), np.bool_)
        holds[self.start[self.first[other] : self.first[other + 1]] + world] = True
        own = slice(self.start[begin], self.start[end])
        return np.asarray(np.flatnonzero(holds[self.twin[own]]) + self.start[begin] - self.start[begin:end])


def twins_of(parts: Sequence[Part]) -> Twins:
    """Finds copies among components; a few may be missed, see `copies`."""
    first = np.cumsum([0, *(len(p.variables) for p in parts)])
    cardinality = np.concatenate([np.zeros(0, np.int32), *(p.cardinality for p in parts)])
    start = np.append(starts_of(cardinality), cardinality.sum())
    component = np.repeat(np.arange(len(parts), dtype=np.int32), np.diff(first))
    if len(parts) < 2:
        return Twins(np.arange(len(parts)), first, start, np.arange(start[-1]))
    found = copies(_as_network(parts, first, cardinality, start), component)
    return Twins(found.original, first, start, found.twin)


def _as_network(parts: Sequence[Part], first: Int64, cardinality: Int32, start: Int64) -> Network:
    """All components as one network of blocks."""
    cells = [(begin, c) for begin, part in zip(first.tolist(), parts, strict=False) for c in part.cells]
    weights = np.concatenate([np.zeros(0), *(c.amount for _, c in cells)])
    row, clauses = np.arange(len(weights), dtype=np.int32), []
    for begin, c in cells:
        literals = (start[c.scope.astype(np.int64) + begin] + c.value + 1).astype(np.int32)
        own, row = np.split(row, [len(literals)])
        clauses.append(Clauses(literals, own, np.ones(len(own), np.int64)))
    counts = []
    for begin, chains in [(b, c) for b, part in zip(first.tolist(), parts, strict=False) for c in part.chains]:
        atoms = start[chains.variable.astype(np.int64) + begin] + chains.value + 1
        literals = np.where(chains.equal, atoms, -atoms).astype(np.int32)
        own = np.arange(len(weights), len(weights) + len(literals), dtype=np.int32)
        bits = chains.worth.astype(float).view(np.int64)  # only to be told apart
        counts.append(Counts(literals, bits, own, np.ones(len(own), np.int64), chains.steps))
        weights = np.concatenate([weights, chains.scale])
    n_atoms = int(start[-1])
    variable = np.repeat(np.arange(len(cardinality), dtype=np.int32), cardinality)
    nothing = np.zeros(0, np.int64)
    return Network(
        Model({}, {}, ()), Evidence({}, {}, {}, {}), np.arange(n_atoms), variable,
        (np.arange(n_atoms) - start[:-1][variable]).astype(np.int32), cardinality, np.ones(len(cardinality), np.bool_),
        tuple(clauses), (), weights, nothing.astype(np.int32), nothing, nothing,
        tuple(counts),
    )  # fmt: skip
