"""Databases that leave atoms unknown to complete ones: what is unknown is drawn from a model, given what is known.

The model is fitted to the pseudo-likelihood of the known atoms, the unknown ones being as they were drawn last
(stochastic EM: Celeux and Diebolt 1985; several draws as in multiple imputation: Rubin 1987).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.errors import LimitReached
from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.learn.data.content import content
from mlnlite.learn.data.merge import Listed, merged
from mlnlite.learn.data.missing import MOST_ATOMS, blocks_of, every_atom
from mlnlite.learn.objectives.choose import pseudo_listed
from mlnlite.learn.objectives.exact import labelled
from mlnlite.learn.objectives.quantified import without_weights
from mlnlite.learn.optimise.problem import Problem, problem_of
from mlnlite.learn.optimise.solve import best
from mlnlite.learn.prior import Gaussian, penalty_of
from mlnlite.learn.trust.simulate import draw_worlds, with_facts
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.model.symbols import Predicate

Int64 = NDArray[np.int64]

DRAWS = 5
"""Complete databases for each that leaves atoms unknown."""

ROUNDS = 4
"""How often the model is fitted and atoms are drawn again."""


@dataclass(frozen=True, slots=True)
class Hidden:
    """What databases do not say.

    Attributes:
        databases: as they were read.
        names: predicates with unknown atoms.
        opened: each database, in which just these atoms are open.
        atoms: of each database, the numbers of its unknown atoms, rising.
    """

    databases: Evidence
    names: frozenset[str]
    opened: tuple[Evidence, ...]
    atoms: tuple[Int64, ...]


def hidden(model: Model, databases: Evidence, open_predicates: frozenset[str]) -> Hidden:
    """What databases do not say of the predicates in the formulas of a model."""
    used = {atom.predicate for t in model.templates for atom in t.formula.atoms}
    opened = tuple(labelled(databases, i, frozenset(), open_predicates)[0] for i in range(databases.n_databases))
    by_name = [{name: _unknown(data, data.predicates[name]) for name in sorted(used)} for data in opened]
    names = frozenset(name for found in by_name for name, atoms in found.items() if len(atoms))
    atoms = tuple(np.sort(np.concatenate([np.empty(0, np.int64), *found.values()])) for found in by_name)
    return Hidden(databases, names, opened, atoms)


def _unknown(data: Evidence, predicate: Predicate) -> Int64:
    """The atoms of a predicate that are open in a database."""
    if predicate.closed:
        return np.empty(0, np.int64)
    if np.prod([int(data.present[t].sum()) for t in predicate.types], dtype=object) > MOST_ATOMS:
        hint = "mark single atoms, or learn without this predicate"
        raise LimitReached(f"{predicate.name} has too many unknown atoms to look for rules", hint)
    facts, every = data.facts[predicate.name], data.atom_number(predicate.name, every_atom(data, predicate))
    known = data.atom_number(predicate.name, facts.arguments)
    settled = known if predicate.value is None else blocks_of(data, predicate, known[facts.truth])
    return every[~np.isin(every, known) & ~np.isin(blocks_of(data, predicate, every), settled)]


def completions(found: Hidden, model: Model, targets: frozenset[str], random: np.random.Generator) -> list[Evidence]:
    """Databases in which what is unknown is drawn: from the model, fitted to what is known.

    Args:
        found: what is unknown.
        model: expanded, with a formula about each predicate that has unknown atoms; its weights do not matter.
        targets: predicates that it is to predict, besides those with unknown atoms.
        random: where chance comes from.
    """
    networks = _networks(found, without_weights(model))
    drawn = _drawn(found, networks, random)
    for _ in range(ROUNDS):
        problem = problem_with(found, model, drawn, targets | found.names)
        penalty = penalty_of(Gaussian(), model.templates).of(problem.free)
        weights = problem.all_weights(best(problem, penalty, np.zeros(len(problem.free)), None).x)
        drawn = _drawn(found, [None if n is None else replace(n, weights=weights) for n in networks], random)
    return drawn


def _networks(found: Hidden, model: Model) -> list[Network | None]:
    """What each database leaves open; None for nothing."""
    networks: dict[tuple[bytes, ...], Network] = {}
    every: list[Network | None] = []
    for opened, atoms in zip(found.opened, found.atoms, strict=True):
        same = content(opened, opened.predicates)
        if len(atoms) and same not in networks:
            networks[same] = ground(model, opened, query=atoms)
        every.append(networks[same] if len(atoms) else None)
    return every


def problem_with(found: Hidden, model: Model, drawn: Sequence[Evidence], targets: frozenset[str]) -> Problem:
    """The pseudo-likelihood of the known atoms of the targets, on average over completions; the model is expanded."""
    parts = [p for data in drawn for p in _known(found, pseudo_listed(model, data, targets, None), targets)]
    n_weights = sum(len(t.weights) for t in model.templates)
    worth = np.full(found.databases.n_databases, 1 / len(drawn))
    return problem_of(model, merged(parts, n_weights, worth=worth))


def _drawn(found: Hidden, networks: Sequence[Network | None], random: np.random.Generator) -> list[Evidence]:
    """Completions drawn from networks with weights."""
    true = []
    for opened, network in zip(found.opened, networks, strict=True):
        facts = [(name, opened.facts[name]) for name in sorted(found.names)]
        known = np.concatenate([opened.atom_number(name, table.arguments[table.truth]) for name, table in facts])
        if network is None:
            true.append([known] * DRAWS)
            continue
        worlds = draw_worlds(network, DRAWS, random)
        true.append([np.concatenate([known, network.atoms[w[network.variable] == network.value]]) for w in worlds])
    complete = replace(found.databases, soft={})
    return [with_facts(complete, found.names, [of[r] for of in true]) for r in range(DRAWS)]


def _known(found: Hidden, parts: Sequence[Listed], targets: frozenset[str]) -> list[Listed]:
    """Choices without those of unknown atoms and blocks."""
    data, kept = found.databases, []
    n_atoms = sum(int(np.prod(data.sizes(name), dtype=object)) for name in data.predicates)
    unknown = np.concatenate([atoms + i * n_atoms for i, atoms in enumerate(found.atoms)])
    for name, part in zip(sorted(targets), parts, strict=True):
        predicate, first = data.predicates[name], data.first_atom()[name]
        own = unknown[(unknown % n_atoms >= first) & (unknown % n_atoms < first + np.prod(data.sizes(name)))]
        of_unit = part.database * n_atoms + blocks_of(data, predicate, part.unit)
        kept.append(
            _some(part, ~np.isin(of_unit, own // n_atoms * n_atoms + blocks_of(data, predicate, own % n_atoms)))
        )
    return kept


def _some(part: Listed, keep: NDArray[np.bool_]) -> Listed:
    """Some of the choices."""
    rows = keep[part.choice]
    choice = (np.cumsum(keep) - 1)[part.choice[rows]]
    matrix = sparse.csr_array(part.rows[np.flatnonzero(rows)])
    return replace(
        part, rows=matrix, times=part.times[rows], choice=choice, database=part.database[keep], unit=part.unit[keep]
    )
