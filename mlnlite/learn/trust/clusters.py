"""The data of a learnt model again, cluster by cluster: what is independent of what."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.learn.data.merge import Listed, merged
from mlnlite.learn.data.worlds import components
from mlnlite.learn.learned import How, targets_of
from mlnlite.learn.objectives.choose import pseudo_listed, tied_of, worth_of
from mlnlite.learn.objectives.exact import compiled, conditions
from mlnlite.learn.objectives.quantified import without_weights
from mlnlite.learn.optimise.problem import Problem, problem_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model

Int64 = NDArray[np.int64]

ENOUGH = 10
"""Databases from which on they are the clusters; with fewer, their components are."""


def clustered(model: Model, databases: Evidence, how: How) -> tuple[Problem, int]:
    """The problem with the choices of different clusters kept apart, and the number of clusters.

    Clusters are the databases, or, if there are few, the connected components of their networks.

    Args:
        model: expanded; its weights do not matter.
        databases: the data.
        how: what is learnt.
    """
    targets = targets_of(model, how)
    n_weights = sum(len(t.weights) for t in model.templates)
    tied, worth = tied_of(model, how.tied), worth_of(databases, how.database_weights)
    apart = databases.n_databases < ENOUGH
    if how.objective == "pseudo-likelihood":
        parts = pseudo_listed(model, databases, targets, None)
        groups = _component_groups(model, databases, targets, parts) if apart else [p.database for p in parts]
        found = problem_of(model, merged(parts, n_weights, groups, worth), tied=tied)
        return found, len(np.unique(found.every.group))
    unknown = frozenset(how.open_predicates)
    exact = compiled(without_weights(model), databases, targets, unknown, how.objective)
    every = merged(exact.every, n_weights, _part_groups(exact.every, apart), worth)
    known = merged(exact.known, n_weights, _part_groups(exact.known, apart), worth)
    times = np.ones(databases.n_databases) if worth is None else worth
    wide = tuple(replace(w, times=float(times[w.database])) for w in exact.wide)
    found = problem_of(model, every, known, wide, tied)
    return found, len(np.unique(found.every.group)) + len(wide)


def _part_groups(parts: list[Listed], apart: bool) -> list[Int64]:
    """The database of each choice, or the number of its component."""
    if not apart:
        return [p.database for p in parts]
    starts = np.cumsum([0, *(p.n_choices for p in parts)])
    return [p.unit + start for p, start in zip(parts, starts, strict=False)]


def _component_groups(model: Model, databases: Evidence, targets: frozenset[str], parts: list[Listed]) -> list[Int64]:
    """The component of the network in which each choice is."""
    atoms, labels, n_labels = [np.empty(0, np.int64)], [np.empty(0, np.int64)], 0
    n_atoms = sum(int(np.prod(databases.sizes(name), dtype=object)) for name in databases.predicates)
    for i in range(databases.n_databases):
        network = ground(without_weights(model), conditions(databases, i, targets, frozenset()))
        atoms.append(network.atoms + i * n_atoms)
        labels.append(_labels(network)[network.variable] + n_labels)
        n_labels += network.n_variables
    every, label = np.concatenate(atoms), np.concatenate(labels)
    return [label[np.searchsorted(every, p.unit + p.database * n_atoms)] for p in parts]


def _labels(network: Network) -> Int64:
    label = np.zeros(network.n_variables, np.int64)
    for i, part in enumerate(components(network)):
        label[part] = i
    return label
