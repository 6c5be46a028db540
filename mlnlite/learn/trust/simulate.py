"""Learnt model and data to data drawn from the model: the conditions stay, what is predicted is drawn anew."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.learn.data.missing import blocks_of, every_atom
from mlnlite.learn.data.worlds import MOST_WORLDS, components, incidence, n_worlds, world_counts
from mlnlite.learn.learned import LearnedModel, targets_of
from mlnlite.learn.objectives.chains import new_chains, sweep
from mlnlite.learn.objectives.exact import conditions
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.symbols import Predicate

Int64 = NDArray[np.int64]

WARM_UP = 200
APART = 20
"""Sweeps between two worlds of a chain."""
MOST_CHAINS = 8


def simulate(
    learned: LearnedModel, databases: Evidence, repetitions: int, random: np.random.Generator
) -> tuple[bool, Iterator[Evidence]]:
    """Databases in which everything predicted is drawn from the learnt model, given the rest.

    What the data do not say is drawn as well, and then hidden.

    Args:
        learned: the model, and what it predicts.
        databases: the conditions.
        repetitions: how often.
        random: where chance comes from.

    Returns:
        Whether some component was too wide to be drawn from exactly, and the databases.
    """
    targets = targets_of(learned.model, learned.how)
    unknown = frozenset(learned.how.open_predicates)
    draws = []
    for i in range(databases.n_databases):
        given = conditions(databases, i, targets, unknown)
        network = ground(learned.model, given, query=all_atoms(given, targets))
        draws.append((network, draw_worlds(network, repetitions, random)))

    def drawn() -> Iterator[Evidence]:
        for r in range(repetitions):
            true = [network.atoms[worlds[r][network.variable] == network.value] for network, worlds in draws]
            yield _hidden(with_facts(databases, targets, true), databases, unknown & targets)

    return any(map(_is_wide, (network for network, _ in draws))), drawn()


def _is_wide(network: Network) -> bool:
    return any(n_worlds(network, part) > MOST_WORLDS for part in components(network))


def draw_worlds(network: Network, repetitions: int, random: np.random.Generator) -> Int64:
    """Worlds drawn from a network with weights, as values of its variables: shape (repetitions, n_variables).

    Exactly, but for components with too many worlds to list: these by Gibbs sampling, or MC-SAT, `APART` sweeps apart.
    """
    worlds = _sampled(network, repetitions, random) if _is_wide(network) else None
    worlds = np.zeros((repetitions, network.n_variables), np.int64) if worlds is None else worlds
    hard, touching = np.isposinf(network.weights), incidence(network)
    for part in components(network):
        if n_worlds(network, part) > MOST_WORLDS:
            continue
        table = world_counts(network, part, touching)
        is_hard = hard[table.weights]
        log_weight = table.counts[:, ~is_hard] @ network.weights[table.weights[~is_hard]]
        held = table.counts[:, is_hard].sum(axis=1)
        log_weight = np.where(held < held.max(initial=0), -np.inf, log_weight)
        chance = np.exp(log_weight - log_weight.max())
        worlds[:, part] = table.grid[random.choice(len(chance), repetitions, p=chance / chance.sum())]
    return worlds


def _sampled(network: Network, repetitions: int, random: np.random.Generator) -> Int64:
    """Worlds from chains."""
    chains = new_chains(network, min(repetitions, MOST_CHAINS), random)
    nothing = sparse.csr_array((len(network.weights), 0))
    chains, _ = sweep(chains, network.weights, nothing, WARM_UP, random)
    found: list[NDArray[np.bool_]] = []
    while len(found) < repetitions:
        found += list(chains.worlds)
        chains, _ = sweep(chains, network.weights, nothing, APART, random)
    values = np.zeros((repetitions, network.n_variables), np.int64)
    row, atom = np.nonzero(np.array(found[:repetitions]))
    values[row, network.variable[atom]] = network.value[atom]
    return values


def _hidden(drawn: Evidence, data: Evidence, unknown: frozenset[str]) -> Evidence:
    """Drawn databases without what the data do not say: marked atoms, and what of unknown predicates is no fact."""
    facts = dict(drawn.facts)
    n_atoms = sum(int(np.prod(data.sizes(name), dtype=object)) for name in data.predicates)
    for name in {*unknown, *data.soft} & set(data.predicates):
        predicate, table, known = data.predicates[name], drawn.facts[name], data.facts[name]
        place = _blocks(data, predicate, table.arguments) + table.database.astype(np.int64) * n_atoms
        of_data = _blocks(data, predicate, known.arguments) + known.database.astype(np.int64) * n_atoms
        if name in unknown and predicate.value is None:
            facts[name] = replace(known, truth=np.isin(of_data, place))
            continue
        keep = np.isin(place, of_data[known.truth]) if name in unknown else np.ones(len(place), np.bool_)
        if name in data.soft:
            soft = data.soft[name]
            marked = _blocks(data, predicate, soft.arguments) + soft.database.astype(np.int64) * n_atoms
            keep &= ~np.isin(place, marked)
        facts[name] = Facts(table.database[keep], table.arguments[keep], table.truth[keep])
    return replace(drawn, facts=facts)


def _blocks(data: Evidence, predicate: Predicate, arguments: NDArray[np.int32]) -> Int64:
    return blocks_of(data, predicate, data.atom_number(predicate.name, arguments))


def all_atoms(evidence: Evidence, targets: frozenset[str]) -> Int64:
    """Numbers of all atoms of the targets."""
    found = [evidence.atom_number(name, every_atom(evidence, evidence.predicates[name])) for name in targets]
    return np.sort(np.concatenate([np.empty(0, np.int64), *found]))


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
        arguments = np.array(columns, np.int32).reshape(len(sizes), len(within)).T
        facts[name] = Facts(database[here][order], np.ascontiguousarray(arguments), np.ones(len(within), np.bool_))
    return replace(databases, facts=facts)
