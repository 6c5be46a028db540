"""Takes decided literals out of counting factors: come in potentials, go out potentials with shorter chains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlnlite.ground.network import Bool, Float
from mlnlite.infer.reduce.conjunctions import starts_of
from mlnlite.infer.reduce.counting import Chains
from mlnlite.infer.reduce.potentials import Potentials


def settled(potentials: Potentials) -> Potentials:
    """Potentials in which chains read no literal that forbidden values decide; what is then constant is added up."""
    if not potentials.chains:
        return potentials
    start = starts_of(potentials.cardinality)
    forbidden = np.zeros(int(potentials.cardinality.sum()), np.bool_)
    for c in potentials.cells:
        if c.scope.shape[1] == 1:
            never = np.isneginf(c.amount)
            forbidden[start[c.scope[never, 0]] + c.value[never, 0]] = True
    left = np.add.reduceat(~forbidden, start, dtype=np.int64) if len(start) else np.zeros(0, np.int64)
    chains: list[Chains] = []
    constant = potentials.constant
    for chain in potentials.chains:
        out = forbidden[start[chain.variable] + chain.value]
        known = out | (left[chain.variable] == 1)
        shorter, gain = _without(chain, known, known & (out != chain.equal))
        chains, constant = [*chains, *shorter], constant + gain
    return replace(potentials, chains=tuple(chains), constant=constant)


def _without(chains: Chains, known: Bool, true: Bool) -> tuple[list[Chains], float]:
    """Chains without known literals, of which some are true, and what all worlds gain from those that are decided."""
    if not known.any():
        return [chains], 0.0
    count = np.where(true, chains.steps, 0).sum(axis=1)
    kinds, which = np.unique(np.column_stack([count, known]), axis=0, return_inverse=True)
    found, gain = [], 0.0
    for i, (first, *of_literals) in enumerate(kinds.tolist()):
        open_ = np.flatnonzero(np.array(of_literals) == 0)
        rest = chains.pick(np.flatnonzero(which.ravel() == i), open_)
        worth: Float = chains.worth[first : first + int(rest.steps.sum()) + 1]
        if (worth == worth[0]).all():
            gain += float((rest.scale * worth[0]).sum()) if np.isfinite(worth[0]) else -np.inf
        else:
            found.append(replace(rest, worth=worth))
    return found, gain
