"""Networks too wide to list to value and gradient of their likelihood, by elimination."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.network import Network
from mlnlite.infer.exact.formula import formula_probabilities
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.model.formulas import All, Any, AtomRef, Expression, Not

Float = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Wide:
    """One database as networks.

    Attributes:
        every: in which everything predicted is unknown.
        known: in which only what the data leave open is.
        database: its number.
        times: how much it counts.
    """

    every: Network
    known: Network
    database: int
    times: float = 1.0


def wide_value(wide: Sequence[Wide], weights: Float, wanted: NDArray[np.bool_]) -> tuple[float, Float]:
    """Log-likelihood of databases kept as networks, and its gradient.

    Args:
        wide: the databases.
        weights: all weights, shape (n_weights,).
        wanted: shape (n_weights,), whose gradient is worked out; that of the others is 0.

    Raises:
        LimitReached: if elimination is too wide.
    """
    value, gradient = 0.0, np.zeros(len(weights))
    for one in wide:
        for network, sign in ((one.known, one.times), (one.every, -one.times)):
            log_z, counts = expected_counts(replace(network, weights=weights), wanted)
            value += sign * log_z
            gradient += sign * counts
    return value, gradient


def wide_slopes(wide: Sequence[Wide], weights: Float, wanted: NDArray[np.bool_]) -> Float:
    """The gradient of each database, shape (n_wide, n_weights). Arguments as `wide_value`."""
    return np.array([wide_value([one], weights, wanted)[1] for one in wide]).reshape(-1, len(weights))


def expected_counts(network: Network, wanted: NDArray[np.bool_]) -> tuple[float, Float]:
    """The log partition function, and the expected number of true groundings of each wanted weight."""
    log_z = _log_z(network)
    expected = np.where(wanted, network.decided_true, 0).astype(float)
    formulas, weight, count = _ground_formulas(network, wanted)
    if formulas:
        np.add.at(expected, weight, np.array(count) * formula_probabilities(network, formulas))
    for w in {int(w) for c in network.counts for w in c.weight if wanted[w]}:
        expected[w] = _slope(network, w)
    return log_z, expected


def _log_z(network: Network) -> float:
    if network.n_atoms:
        return marginals_of(network).log_z
    soft = np.isfinite(network.weights)
    return float(network.weights[soft] @ network.decided_true[soft])


def _slope(network: Network, weight: int, step: float = 1e-4) -> float:
    """How the log partition function changes with one weight, by five points (error about step^4)."""
    values = {}
    for k in (-2, -1, 1, 2):
        shifted = network.weights.copy()
        shifted[weight] += k * step
        values[k] = _log_z(replace(network, weights=shifted))
    return (8 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12 * step)


def _ground_formulas(network: Network, wanted: NDArray[np.bool_]) -> tuple[list[Expression], list[int], list[int]]:
    """The ground formulas of the wanted weights, their weights, and how often each is there."""
    formulas: list[Expression] = []
    weight: list[int] = []
    count: list[int] = []
    for clauses in network.clauses:
        chosen = np.flatnonzero(wanted[clauses.weight])
        for row in clauses.literals[chosen].tolist():
            clause = Any(tuple(map(_literal, row)))
            formulas.append(Not(clause) if clauses.negated else clause)
        weight += clauses.weight[chosen].tolist()
        count += clauses.count[chosen].tolist()
    for tables in network.tables:
        chosen, signs = np.flatnonzero(wanted[tables.weight]), np.where(np.argwhere(tables.truth), 1, -1)
        for row in tables.atoms[chosen].tolist():
            cells = (np.array(row) + 1) * signs
            formulas.append(Any(tuple(All(tuple(map(_literal, cell))) for cell in cells.tolist())))
        weight += tables.weight[chosen].tolist()
        count += tables.count[chosen].tolist()
    return formulas, weight, count


def _literal(literal: int) -> Expression:
    return AtomRef(literal - 1) if literal > 0 else Not(AtomRef(-literal - 1))
