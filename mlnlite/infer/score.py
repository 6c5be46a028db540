"""What a world is worth, straight from the network: comes in truth values, goes out counts and the log-weight."""

from __future__ import annotations

import numpy as np

from mlnlite.ground.network import Bool, Int64, Network
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
    holds = np.concatenate([[False], truth, ~truth[::-1]])  # of each literal: a negative one counts from the end
    for clauses in network.clauses:
        true = np.full(len(clauses.weight), False)
        for literal in clauses.literals.T:
            true |= holds[literal]
        true ^= clauses.negated
        np.add.at(total, clauses.weight[true], clauses.count[true])
    for tables in network.tables:
        true = tables.truth[tuple(truth[tables.atoms].T.astype(np.int64))]
        np.add.at(total, tables.weight[true], tables.count[true])
    for group in network.counts:
        state = holds[group.literals] @ group.steps
        np.add.at(total, group.weight, group.count * group.true[state])
    return total


def n_paid(network: Network, true: Int64) -> Int64:
    """For each soft weight how many open groundings a world pays for: false ones if it is positive, else true ones.

    Args:
        network: of which.
        true: shape (n_weights,), see `counts`.
    """
    open_true = true - network.decided_true
    soft = np.isfinite(network.weights) & (network.weights != 0)
    return np.asarray(np.where(network.weights > 0, network.n_open - open_true, open_true) * soft)


def cost(network: Network, true: Int64) -> float:
    """What a world pays for all groundings of soft formulas, those that evidence decides included.

    Args:
        network: of which.
        true: shape (n_weights,), see `counts`.
    """
    soft = np.where(np.isfinite(network.weights), network.weights, 0.0)
    return float(np.sum(np.where(soft > 0, soft * (network.n_groundings - true), -soft * true)))


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
