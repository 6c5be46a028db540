"""Databases to exact and composite likelihoods: networks, what the data say of their variables, lists of worlds.

Where a component has too many worlds to list, its database is kept as a network.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Engine
from mlnlite.errors import Diagnostic, EvidenceMistake
from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.ground.tables import completed
from mlnlite.learn.data.content import content
from mlnlite.learn.data.merge import Listed
from mlnlite.learn.data.missing import Marks, blocks_of, closed_but, marks_of
from mlnlite.learn.data.wide import Wide
from mlnlite.learn.data.worlds import MOST_WORLDS, Worlds, components, list_worlds, n_worlds, pairs
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.model import Model
from mlnlite.model.read import one_database
from mlnlite.model.symbols import Predicate

Int64 = NDArray[np.int64]
Float = NDArray[np.float64]
Objective = Literal["likelihood", "composite", "max-margin"]


@dataclass(frozen=True, slots=True)
class Compiled:
    """What the likelihood of the databases is made of.

    Attributes:
        every: all worlds of listed parts.
        known: those that agree with the data, of parts with unknown variables.
        wide: databases with parts that are too large to list.
        labels: what each database says, and how many atoms and blocks are predicted in it.
        constant: shape (n_databases,), log-likelihood of what no formula touches.
        n_choices: number of atoms and blocks that are predicted.
    """

    every: list[Listed]
    known: list[Listed]
    wide: list[Wide]
    labels: list[tuple[Labels, int]]
    constant: Float
    n_choices: int


def compiled(
    model: Model,
    databases: Evidence,
    targets: frozenset[str],
    unknown: frozenset[str],
    objective: Objective,
    engine: Engine | None = None,
) -> Compiled:
    """The likelihood of the targets given all else.

    Args:
        model: expanded; weights do not matter, except whether they are hard.
        databases: the data.
        targets: predicates that are predicted.
        unknown: predicates whose atoms are unknown unless they are facts; the others are false.
        objective: of whole components, or of pairs of variables that share a formula.
        engine: what runs the plans.
    """
    found, n_choices = Compiled([], [], [], [], np.zeros(databases.n_databases), 0), 0
    known: dict[tuple[bytes, ...], _Database] = {}
    networks: dict[tuple[bytes, ...], Network] = {}
    for i in range(databases.n_databases):
        data, marks = labelled(databases, i, targets, unknown)
        same = content(data, [n for n in data.predicates if n not in targets])
        if same not in networks:
            networks[same] = ground(model, without(data, targets), engine=engine)
        key = (*content(data, data.predicates), *(m.tobytes() for m in marks.values()))
        if key not in known:
            labels = labels_of(networks[same], data, targets - unknown, marks)
            known[key] = _database(model, data, labels, (targets, unknown), objective)
        one = known[key]
        if one.worlds is not None:
            found.every.append(_of_database(one.worlds.every, i))
            found.known.append(_of_database(one.worlds.known, i))
        if one.wide is not None:
            found.wide.append(replace(one.wide, database=i))
        found.labels.append((one.labels, one.n_choices))
        found.constant[i] = one.constant
        n_choices += one.n_choices
    return replace(found, n_choices=n_choices)


@dataclass(frozen=True, slots=True)
class Labels:
    """What a database says of the variables of its network.

    Attributes:
        network: in which everything predicted is unknown.
        values: shape (n_variables,), value of each variable, -1 if it is not known.
        excluded: shape (n, 2), variables that are not known, and values that they do not have.
        marks: atoms marked unknown.
    """

    network: Network
    values: Int64
    excluded: Int64
    marks: Marks


@dataclass(frozen=True, slots=True)
class _Database:
    """What one database adds: labels, and worlds or a pair of networks."""

    worlds: Worlds | None
    wide: Wide | None
    labels: Labels
    constant: float
    n_choices: int


def _database(
    model: Model,
    data: Evidence,
    labels: Labels,
    names: tuple[frozenset[str], frozenset[str]],
    objective: Objective,
) -> _Database:
    targets, unknown = names
    network, composite = labels.network, objective == "composite"
    n_choices, constant = _untouched(labels, data, names)
    parts = pairs(network) if composite else components(network)
    if composite or (objective == "likelihood" and all(n_worlds(network, p) <= MOST_WORLDS for p in parts)):
        worlds = list_worlds(network, labels.values, parts, labels.excluded)
        return _Database(worlds, None, labels, constant, n_choices)
    clamped = closed_but(data, targets - unknown, labels.marks)
    known = ground(model, clamped, query=network.atoms[labels.values[network.variable] < 0])
    return _Database(None, Wide(network, known, 0), labels, constant, n_choices)


def _of_database(found: Listed, index: int) -> Listed:
    return replace(found, database=np.full(len(found.database), index))


def labelled(
    databases: Evidence, index: int, targets: frozenset[str], unknown: frozenset[str]
) -> tuple[Evidence, Marks]:
    """One database, and its marks; closed is what is not predicted, but for unknown predicates and atoms."""
    data, marks = marks_of(one_database(databases, index))
    partly = closed_but(data, frozenset(data.predicates) - targets - unknown, marks)
    return replace(partly, facts={**partly.facts, **_within_blocks(data, targets, marks)}), marks


def _within_blocks(data: Evidence, targets: frozenset[str], marks: Marks) -> dict[str, Facts]:
    """The facts about marked blocks of the targets: values that are not marked are false."""
    names = [n for n in marks if n in targets and data.predicates[n].marker == "!"]
    return {n: closed_but(data, [n], marks).facts[n] for n in names}


def conditions(databases: Evidence, index: int, targets: frozenset[str], unknown: frozenset[str]) -> Evidence:
    """One database without what is predicted; the world of the other predicates is closed, but of the unknown ones."""
    return without(labelled(databases, index, targets, unknown)[0], targets)


def without(data: Evidence, targets: Collection[str]) -> Evidence:
    """The data without the facts about the targets, and these open."""
    facts, predicates = dict(data.facts), dict(data.predicates)
    for name in targets:
        arity = data.predicates[name].arity
        facts[name] = Facts(np.empty(0, np.int32), np.empty((0, arity), np.int32), np.empty(0, np.bool_))
        predicates[name] = replace(data.predicates[name], closed=False)
    return replace(data, facts=facts, predicates=predicates)


def labels_of(network: Network, data: Evidence, complete: frozenset[str], marks: Marks) -> Labels:
    """What a database says of the variables of its network.

    Args:
        network: in which everything predicted is unknown.
        data: the database.
        complete: predicates of which atoms that are neither facts nor marked are false.
        marks: atoms marked unknown.

    Raises:
        EvidenceMistake: if a block of these that must have a value has none.
    """
    truth = _truth(network, data, complete, marks)
    values = np.where(network.block, -1, 0).astype(np.int64)
    values[network.variable[truth < 0]] = -1
    n_atoms = np.bincount(network.variable, minlength=network.n_variables)
    n_false = np.bincount(network.variable[truth == 0], minlength=network.n_variables)
    optional = network.block & (network.cardinality > n_atoms) & (n_false == n_atoms)
    values[optional] = 0
    values[network.variable[truth == 1]] = network.value[truth == 1]
    _verify_values(network, data, values, (complete, truth))
    out = np.flatnonzero((truth == 0) & (values[network.variable] < 0))
    excluded = np.column_stack([network.variable[out], network.value[out]]).astype(np.int64)
    return Labels(network, values, excluded, marks)


def _truth(network: Network, data: Evidence, complete: frozenset[str], marks: Marks) -> NDArray[np.int8]:
    """1, 0, or -1 for unknown, for each atom of a network."""
    truth = np.full(network.n_atoms, -1, np.int8)
    names, first = list(data.predicates), np.array(list(data.first_atom().values()))
    of = np.searchsorted(first, network.atoms, "right") - 1
    truth[np.isin(of, [names.index(n) for n in complete])] = 0
    for atoms in marks.values():
        truth[np.isin(network.atoms, atoms)] = -1
    for name, facts in completed(data).facts.items():
        atoms = data.atom_number(name, facts.arguments)
        for known in (False, True):
            truth[np.isin(network.atoms, atoms[facts.truth == known])] = known
    return truth


def _verify_values(
    network: Network, data: Evidence, values: Int64, of: tuple[frozenset[str], NDArray[np.int8]]
) -> None:
    """Complains of blocks of complete predicates that must have a value and have none."""
    complete, truth = of
    all_false = np.bincount(network.variable[truth < 0], minlength=network.n_variables) == 0
    for v in np.flatnonzero(network.block & (values < 0) & all_false).tolist():
        atom = int(network.atoms[np.flatnonzero(network.variable == v)[0]])
        name, _ = data.atom_at(atom)
        if name in complete:
            predicate = data.predicates[name]
            message = f"the block of {data.atom_text(atom)} has no value in {data.names[0]}"
            hint = f"{predicate} has exactly one true value for each block; mark it unknown: `?{data.atom_text(atom)}`"
            raise EvidenceMistake([Diagnostic("E320", message, predicate.span, hint)])


def _untouched(labels: Labels, data: Evidence, names: tuple[frozenset[str], frozenset[str]]) -> tuple[int, float]:
    """Number of known atoms and blocks of the targets, and the log-likelihood of those that no formula touches."""
    (targets, unknown), network, values = names, labels.network, labels.values
    order, first = list(data.predicates), np.array(list(data.first_atom().values()))
    leader = np.unique(network.variable, return_index=True)[1]
    inside = np.searchsorted(first, network.atoms[leader][values >= 0], "right") - 1
    n_choices, total = 0, 0.0
    for name in targets:
        predicate = data.predicates[name]
        n_units, n_values = _units(predicate, data)
        if name in unknown:
            facts = data.facts[name]
            n_units = len(facts.truth) if predicate.value is None else int(facts.truth.sum())
        elif name in labels.marks:
            n_units -= len(np.unique(blocks_of(data, predicate, labels.marks[name])))
        n_choices += n_units
        left = max(0, n_units - int(np.count_nonzero(inside == order.index(name))))
        total -= left * float(np.log(max(n_values, 1)))
    return n_choices, total


def _units(predicate: Predicate, data: Evidence) -> tuple[int, int]:
    """Number of atoms or blocks of a predicate, and number of values of each."""
    sizes = [int(data.present[t].sum()) for t in predicate.types]
    n_units = int(np.prod([sizes[k] for k in predicate.keys], dtype=object))
    n_values = 2 if predicate.value is None else sizes[predicate.value] + (predicate.marker == "?")
    return n_units, n_values
