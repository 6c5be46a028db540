"""What a world is worth, straight from the network: comes in truth values, goes out counts and the log-weight."""

from __future__ import annotations

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64, Network
from mlnlite.infer.reduce.potentials import check_weights


def counts(network: Network, truth: Bool) -> Int64:
    """Number of true groundings of each weight, those that evidence decides included.

    Args:
        network: of which.
        truth: shape (n_atoms,).

    Returns:
        Shape (n_weights,).
    """
    total = network.decided_true.copy()
    for clauses in network.clauses:
        holds = (truth[np.abs(clauses.literals) - 1] == (clauses.literals > 0)).any(axis=1) != clauses.negated
        np.add.at(total, clauses.weight[holds], clauses.count[holds])
    for tables in network.tables:
        holds = tables.truth[tuple(truth[tables.atoms].T.astype(np.int64))]
        np.add.at(total, tables.weight[holds], tables.count[holds])
    for group in network.counts:
        state = (truth[np.abs(group.literals) - 1] == (group.literals > 0)) @ group.steps
        np.add.at(total, group.weight, group.count * group.true[state])
    return total


def costs(network: Network, truth: Bool) -> tuple[Float, Float]:
    """What a world pays for each soft weight: for false groundings if it is positive, for true ones if it is negative.

    Args:
        network: of which.
        truth: shape (n_atoms,).

    Returns:
        Shapes (n_weights,): over all groundings, and over those that evidence leaves open.
    """
    true = counts(network, truth)
    soft = np.isfinite(network.weights)
    weight = np.where(soft, np.abs(network.weights), 0.0)
    positive = network.weights > 0
    open_true = true - network.decided_true
    total = np.where(positive, network.n_groundings - true, true)
    return weight * total, weight * np.where(positive, network.n_open - open_true, open_true)


def log_weight(network: Network, truth: Bool) -> float:
    """Log-weight of a world; minus infinity if a grounding of a hard formula, or a block, is violated.

    Args:
        network: of which.
        truth: shape (n_atoms,).

    Raises:
        QueryMistake: a weight is not known.
    """
    check_weights(network)
    true, hard = counts(network, truth), np.isposinf(network.weights)
    if np.any(true[hard] < network.n_groundings[hard]) or not respects_blocks(network, truth):
        return -np.inf
    return float(np.sum(network.weights[~hard] * true[~hard]))


def respects_blocks(network: Network, truth: Bool) -> bool:
    """Whether each block has one value: exactly one true atom, or at most one where "none" is a value."""
    true = np.bincount(network.variable[truth], minlength=network.n_variables)
    n_atoms = np.bincount(network.variable, minlength=network.n_variables)
    needed = network.block & (n_atoms == network.cardinality)
    return not np.any((true > 1) | (needed & (true == 0)))


def truth_of(network: Network, values: Int64) -> Bool:
    """Truth value of each atom.

    Args:
        network: of which.
        values: shape (n_variables,), or more, the value of each variable.
    """
    return np.asarray(values[network.variable] == network.value)
