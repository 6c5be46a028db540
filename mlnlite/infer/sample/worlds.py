"""Worlds that hard formulas allow, found by a SAT solver: where chains start, and whether an atom can be otherwise."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from pysat.solvers import Solver

from mlnlite.ground.network import Bool, Int64, Network
from mlnlite.infer.conflict import block_clauses, contradiction, hard_clauses

_MANY_TRUE = 0.95


def start_worlds(network: Network, n: int, rng: np.random.Generator) -> Bool:
    """Worlds far apart from each other: in the first nearly all atoms are true, in the last nearly none.

    So chains that stay in what they start in do not agree by chance.

    Args:
        network: what was ground.
        n: how many.
        rng: where their chance comes from.

    Returns:
        Shape (n, n_atoms), random but for that where nothing is hard.

    Raises:
        Contradiction: there is no world.
    """
    shares = np.linspace(_MANY_TRUE, 1 - _MANY_TRUE, n)
    if not np.isposinf(network.weights).any():
        chance = rng.random((n, network.n_variables))
        values = np.where(network.block, chance * network.cardinality, chance < shares[:, None]).astype(np.int64)
        return np.asarray(values[:, network.variable] == network.value)
    worlds = np.zeros((n, network.n_atoms), np.bool_)
    with _solver(network) as solver:
        for world, share in zip(worlds, shares.tolist(), strict=True):
            signs = np.where(rng.random(network.n_atoms) < share, 1, -1)
            solver.set_phases((signs * np.arange(1, network.n_atoms + 1)).tolist())
            if not solver.solve():
                raise contradiction(network)
            model = np.array(solver.get_model() or [], np.int64)[: network.n_atoms]
            world[model[model > 0] - 1] = True
    return worlds


def can_differ(network: Network, atoms: Int64, truth: Bool) -> Bool:
    """Whether hard formulas allow atoms to have the other value.

    Args:
        network: what was ground.
        atoms: shape (n,), indices into `network.atoms`.
        truth: shape (n,), the value that each has.
    """
    if not np.isposinf(network.weights).any():
        return np.ones(len(atoms), np.bool_)
    literals = np.where(truth, -1, 1) * (atoms + 1)
    with _solver(network) as solver:
        return np.array([bool(solver.solve(assumptions=[x])) for x in literals.tolist()], np.bool_)


@contextmanager
def _solver(network: Network) -> Iterator[Solver]:
    """A solver that holds blocks and hard formulas, and knows every atom."""
    with Solver(name="glucose4") as solver:
        for a in range(1, network.n_atoms + 1):
            solver.add_clause([a, -a])
        for literals in block_clauses(network):
            solver.add_clause(literals)
        for _, literals in hard_clauses(network, network.n_atoms + 1):
            solver.add_clause(literals)
        yield solver
