"""Learnt model and data to data drawn from the model: the conditions stay, what is predicted is drawn anew."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import LimitReached
from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.learn.exact import conditions
from mlnlite.learn.learned import LearnedModel
from mlnlite.learn.worlds import MOST_WORLDS, components, n_worlds, world_counts
from mlnlite.model.evidence import Evidence, Facts

Int64 = NDArray[np.int64]


def simulate(
    learned: LearnedModel, databases: Evidence, repetitions: int, random: np.random.Generator
) -> Iterator[Evidence]:
    """Databases in which everything predicted is drawn from the learnt model, given the rest.

    Args:
        learned: the model, and what it predicts.
        databases: the conditions.
        repetitions: how often.
        random: where chance comes from.

    Raises:
        LimitReached: if a component has too many worlds to list.
    """
    targets = frozenset(learned.model.predicates if learned.how.predict is None else learned.how.predict)
    draws = []
    for i in range(databases.n_databases):
        given = conditions(databases, i, targets, frozenset())
        network = ground(learned.model, given, query=_atoms(given, targets))
        draws.append((network, draw_worlds(network, repetitions, random)))
    for r in range(repetitions):
        true = [network.atoms[worlds[r][network.variable] == network.value] for network, worlds in draws]
        yield with_facts(databases, targets, true)


def draw_worlds(network: Network, repetitions: int, random: np.random.Generator) -> Int64:
    """Worlds drawn from a network with weights, exactly, as values of its variables: shape (repetitions, n_variables).

    Raises:
        LimitReached: if a component has too many worlds to list.
    """
    worlds = np.zeros((repetitions, network.n_variables), np.int64)
    hard = np.isposinf(network.weights)
    for part in components(network):
        if n_worlds(network, part) > MOST_WORLDS:
            hint = "learn from smaller databases, or ask for the sandwich"
            raise LimitReached(f"worlds are drawn exactly up to {MOST_WORLDS:,} worlds of a component", hint)
        table = world_counts(network, part)
        is_hard = hard[table.weights]
        log_weight = table.counts[:, ~is_hard] @ network.weights[table.weights[~is_hard]]
        held = table.counts[:, is_hard].sum(axis=1)
        log_weight = np.where(held < held.max(initial=0), -np.inf, log_weight)
        chance = np.exp(log_weight - log_weight.max())
        worlds[:, part] = table.grid[random.choice(len(chance), repetitions, p=chance / chance.sum())]
    return worlds


def _atoms(evidence: Evidence, targets: frozenset[str]) -> Int64:
    """Numbers of all atoms of the targets."""
    found = [np.empty(0, np.int64)]
    for name in targets:
        ids = [np.flatnonzero(evidence.present[t][0]) for t in evidence.predicates[name].types]
        grid = np.stack(np.meshgrid(*ids, indexing="ij"), axis=-1).reshape(-1, len(ids)).astype(np.int32)
        found.append(evidence.atom_number(name, grid))
    return np.sort(np.concatenate(found))


def with_facts(databases: Evidence, targets: frozenset[str], true: list[Int64]) -> Evidence:
    """The databases with other facts about the targets: the numbers of the true atoms of each database."""
    atoms = np.concatenate([np.empty(0, np.int64), *true])
    database = np.repeat(np.arange(len(true)), [len(a) for a in true]).astype(np.int32)
    facts, first = dict(databases.facts), databases.first_atom()
    for name in targets:
        sizes = databases.sizes(name)
        here = (atoms >= first[name]) & (atoms < first[name] + int(np.prod(sizes, dtype=object)))
        order = np.lexsort((atoms[here], database[here]))
        within = (atoms[here] - first[name])[order]
        columns = np.unravel_index(within, sizes) if sizes else ()
        arguments = np.array(columns, np.int32).reshape(len(sizes), -1).T
        facts[name] = Facts(database[here][order], np.ascontiguousarray(arguments), np.ones(len(within), np.bool_))
    return replace(databases, facts=facts)
