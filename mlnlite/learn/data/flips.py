"""What each atom changes, from a ground network: for formulas whose quantifiers range over too much to be written out.

Network and world in, entries out, as `counts` gives them from joins.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.network import Bool, Int32, Network

Int64 = NDArray[np.int64]


class Flips(NamedTuple):
    """`change` groundings of weight `weight` become true when atom `atom` of the network does, see `counts.Entries`.

    All arrays have shape (n,); what belongs to one atom and weight is to be added up.
    """

    atom: Int64
    weight: Int64
    change: Int64


def flips(network: Network, truth: Bool) -> Flips:
    """What the atoms of a network change in a world.

    Args:
        network: of formulas, with all that is predicted unknown.
        truth: shape (n_atoms,), the world.
    """
    parts = list(_parts(network, truth)) or [Flips(*(np.zeros(0, np.int64) for _ in range(3)))]
    return Flips(*map(np.concatenate, zip(*parts, strict=True)))


def _parts(network: Network, truth: Bool) -> Iterator[Flips]:
    """Factors of each kind: their number of true groundings is looked up by a sum over their true atoms."""
    for clauses in network.clauses:
        k = clauses.literals.shape[1]
        true = (np.arange(k + 1) > 0) ^ clauses.negated
        yield _changes(network, truth, clauses.literals, np.ones(k, np.int64), true, clauses.weight, clauses.count)
    for tables in network.tables:
        k = tables.atoms.shape[1]
        steps = 2 ** np.arange(k - 1, -1, -1)
        yield _changes(network, truth, tables.atoms + 1, steps, tables.truth.ravel(), tables.weight, tables.count)
    for group in network.counts:
        yield _changes(network, truth, group.literals, group.steps, group.true, group.weight, group.count)


def _changes(
    network: Network,
    truth: Bool,
    literals: Int32,
    steps: NDArray[np.integer],
    true: NDArray[np.generic],
    weight: Int32,
    count: Int64,
) -> Flips:
    """Of factors with as many literals each: the atom true, against its variable having no value."""
    atom = np.abs(literals).astype(np.int64) - 1
    step = np.where(literals > 0, steps, -steps)
    adds = step * truth[atom]
    state = (np.where(literals > 0, 0, steps) + adds).sum(axis=1)
    without = state[:, None] - _of_variable(network, atom, adds)
    looked_up = true.astype(np.int64)
    change = (looked_up[without + step] - looked_up[without]) * count[:, None]
    kept = np.nonzero(change)
    return Flips(atom[kept], weight[kept[0]].astype(np.int64), change[kept])


def _of_variable(network: Network, atom: Int64, adds: Int64) -> Int64:
    """What all atoms of each atom's variable add to the state of the factor, shape (n, k)."""
    if not network.block.any():
        return adds
    key = np.arange(len(atom))[:, None] * np.int64(network.n_variables) + network.variable[atom]
    _, group = np.unique(key, return_inverse=True)
    total = np.bincount(group.ravel(), adds.ravel()).astype(np.int64)[group.ravel()]
    return np.asarray(total.reshape(atom.shape))
