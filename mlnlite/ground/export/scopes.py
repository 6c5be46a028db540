"""Factors as functions of variables (blocks are one variable each), for formats of graphical models."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import LimitReached
from mlnlite.ground.export.factors import clause_factors, table_factors
from mlnlite.ground.network import Network

LARGEST = 1 << 20
"""Entries of the largest table that a format gets."""


def log_tables(network: Network) -> Iterator[tuple[tuple[int, ...], NDArray[np.float64]]]:
    """For each factor its variables and the table of what each combination of values gains.

    Raises:
        LimitReached: if a factor has more than `LARGEST` combinations.
    """
    for factor in clause_factors(network):
        atoms = [abs(x) - 1 for x in factor.literals]
        signs = [x > 0 for x in factor.literals]
        scope, holds = _columns(network, atoms)
        true = np.zeros(_shape(network, scope), np.bool_)
        for column, sign in zip(holds, signs, strict=True):
            true = true | (column == sign)
        yield scope, _gains(true, factor.gain) + factor.constant
    for table in table_factors(network):
        scope, holds = _columns(network, table.atoms)
        index = tuple(np.broadcast_to(h, _shape(network, scope)).astype(np.int64) for h in holds)
        yield scope, _gains(table.truth[index], table.gain)


def _shape(network: Network, scope: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(network.cardinality[list(scope)].tolist())


def _gains(true: NDArray[np.bool_], gain: float) -> NDArray[np.float64]:
    if np.isposinf(gain):
        return np.where(true, 0.0, -np.inf)
    return np.where(true, gain, 0.0)


def _columns(network: Network, atoms: tuple[int, ...] | list[int]) -> tuple[tuple[int, ...], list[NDArray[np.bool_]]]:
    """The variables of some atoms, and for each atom where it is true, shaped to broadcast over them."""
    scope = tuple(dict.fromkeys(network.variable[list(atoms)].tolist()))
    sizes = _shape(network, scope)
    if np.prod(sizes, dtype=float) > LARGEST:
        message = f"a ground formula over {len(scope)} variables has too many combinations for a table"
        raise LimitReached(message, hint="export it as .wcnf or .txt")
    holds = []
    for a in atoms:
        axis = scope.index(int(network.variable[a]))
        shape = [1] * len(scope)
        shape[axis] = sizes[axis]
        holds.append((np.arange(sizes[axis]) == network.value[a]).reshape(shape))
    return scope, holds


def value_names(network: Network) -> list[list[str]]:
    """A name for each value of each variable: the atom that it makes true, or its negation, or `none`."""
    texts = network.evidence.atom_texts(network.atoms)
    names = [["none"] * c for c in network.cardinality.tolist()]
    for a, text in enumerate(texts):
        v = int(network.variable[a])
        names[v][int(network.value[a])] = text
        if not network.block[v]:
            names[v][0] = f"!{text}"
    return names
