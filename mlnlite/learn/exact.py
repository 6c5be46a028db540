"""Databases to exact and composite likelihoods: networks, what the data say of their variables, lists of worlds.

Where a component has too many worlds to list, its database is kept as a network, and value and gradient (counts in the
data less expected counts) come from elimination.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Engine
from mlnlite.errors import Diagnostic, EvidenceMistake
from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.ground.tables import completed
from mlnlite.infer.formula import formula_probabilities
from mlnlite.infer.marginal import marginals_of
from mlnlite.learn.content import content
from mlnlite.learn.merge import Listed
from mlnlite.learn.worlds import MOST_WORLDS, Worlds, components, list_worlds, n_worlds, pairs
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.facts import closed
from mlnlite.model.formulas import All, Any, AtomRef, Expression, Not
from mlnlite.model.model import Model
from mlnlite.model.read import one_database
from mlnlite.model.symbols import Predicate

Int64 = NDArray[np.int64]
Float = NDArray[np.float64]
Objective = Literal["likelihood", "composite"]


@dataclass(frozen=True, slots=True)
class Wide:
    """One database as networks.

    Attributes:
        every: in which everything predicted is unknown.
        known: in which only what the data leave open is.
        database: its number.
    """

    every: Network
    known: Network
    database: int


@dataclass(frozen=True, slots=True)
class Compiled:
    """What the likelihood of the databases is made of.

    Attributes:
        every: all worlds of listed parts.
        known: those that agree with the data, of parts with unknown variables.
        wide: databases with parts that are too large to list.
        constant: log-likelihood of what no formula touches.
        n_choices: number of atoms and blocks that are predicted.
    """

    every: list[Listed]
    known: list[Listed]
    wide: list[Wide]
    constant: float
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
    found = Compiled([], [], [], 0.0, 0)
    constant, n_choices = 0.0, 0
    known: dict[tuple[bytes, ...], _Database] = {}
    networks: dict[tuple[bytes, ...], Network] = {}
    for i in range(databases.n_databases):
        data = one_database(databases, i)
        data = closed(data, _closable(data) - targets - unknown)
        same = content(data, [n for n in data.predicates if n not in targets])
        if same not in networks:
            networks[same] = ground(model, conditions(databases, i, targets, unknown), engine=engine)
        key = content(data, data.predicates)
        if key not in known:
            known[key] = _database(model, data, networks[same], (targets, unknown), objective)
        one = known[key]
        if one.worlds is not None:
            found.every.append(_of_database(one.worlds.every, i))
            found.known.append(_of_database(one.worlds.known, i))
        if one.wide is not None:
            found.wide.append(replace(one.wide, database=i))
        constant, n_choices = constant + one.constant, n_choices + one.n_choices
    return replace(found, constant=constant, n_choices=n_choices)


@dataclass(frozen=True, slots=True)
class _Database:
    """What one database adds: worlds, or a pair of networks."""

    worlds: Worlds | None
    wide: Wide | None
    constant: float
    n_choices: int


def _database(
    model: Model,
    data: Evidence,
    network: Network,
    names: tuple[frozenset[str], frozenset[str]],
    objective: Objective,
) -> _Database:
    targets, unknown = names
    values = _values(network, data, targets - unknown)
    n_choices, constant = _untouched(network, values, data, names)
    parts = pairs(network) if objective == "composite" else components(network)
    if all(n_worlds(network, p) <= MOST_WORLDS for p in parts):
        return _Database(list_worlds(network, values, parts, 0), None, constant, n_choices)
    wide = Wide(network, _clamped(model, data, network, values, targets - unknown), 0)
    return _Database(None, wide, constant, n_choices)


def _of_database(found: Listed, index: int) -> Listed:
    return replace(found, database=np.full(len(found.database), index))


def conditions(databases: Evidence, index: int, targets: frozenset[str], unknown: frozenset[str]) -> Evidence:
    """One database without what is predicted; the world of the other predicates is closed, but of the unknown ones."""
    data = one_database(databases, index)
    return _hidden(closed(data, _closable(data) - targets - unknown), targets)


def _closable(data: Evidence) -> frozenset[str]:
    """Predicates whose world can be closed: `P(x, y!)` always has a true value, known or not."""
    return frozenset(name for name, predicate in data.predicates.items() if predicate.marker != "!")


def _hidden(data: Evidence, targets: frozenset[str]) -> Evidence:
    """The data without the facts about the targets."""
    facts = dict(data.facts)
    for name in targets:
        arity = data.predicates[name].arity
        facts[name] = Facts(np.empty(0, np.int32), np.empty((0, arity), np.int32), np.empty(0, np.bool_))
    return replace(data, facts=facts)


def _clamped(model: Model, data: Evidence, network: Network, values: Int64, complete: frozenset[str]) -> Network:
    """The network in which all is known but what the data leave open."""
    return ground(model, closed(data, complete & _closable(data)), query=network.atoms[values[network.variable] < 0])


def _values(network: Network, data: Evidence, complete: frozenset[str]) -> Int64:
    """Value of each variable in the data, -1 if it is not known."""
    truth = _truth(network, data, complete)
    values = np.where(network.block, -1, 0).astype(np.int64)
    values[network.variable[truth < 0]] = -1
    n_atoms = np.bincount(network.variable, minlength=network.n_variables)
    n_false = np.bincount(network.variable[truth == 0], minlength=network.n_variables)
    optional = network.block & (network.cardinality > n_atoms) & (n_false == n_atoms)
    values[optional] = 0
    values[network.variable[truth == 1]] = network.value[truth == 1]
    _verify_values(network, data, values, complete)
    return values


def _truth(network: Network, data: Evidence, complete: frozenset[str]) -> NDArray[np.int8]:
    """1, 0, or -1 for unknown, for each atom of a network."""
    truth = np.full(network.n_atoms, -1, np.int8)
    names, first = list(data.predicates), np.array(list(data.first_atom().values()))
    of = np.searchsorted(first, network.atoms, "right") - 1
    truth[np.isin(of, [names.index(n) for n in complete])] = 0
    for name, facts in completed(data).facts.items():
        atoms = data.atom_number(name, facts.arguments)
        for known in (False, True):
            truth[np.isin(network.atoms, atoms[facts.truth == known])] = known
    return truth


def _verify_values(network: Network, data: Evidence, values: Int64, complete: frozenset[str]) -> None:
    """Complains of blocks of complete predicates that must have a value and have none."""
    for v in np.flatnonzero(network.block & (values < 0)).tolist():
        atom = int(network.atoms[np.flatnonzero(network.variable == v)[0]])
        name, _ = data.atom_at(atom)
        if name in complete:
            predicate = data.predicates[name]
            message = f"the block of {data.atom_text(atom)} has no value in {data.names[0]}"
            hint = f"{predicate} has exactly one true value for each block; name {name} among the open predicates"
            raise EvidenceMistake([Diagnostic("E320", message, predicate.span, hint)])


def _untouched(
    network: Network, values: Int64, data: Evidence, names: tuple[frozenset[str], frozenset[str]]
) -> tuple[int, float]:
    """Number of known atoms and blocks of the targets, and the log-likelihood of those that no formula touches."""
    targets, unknown = names
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


# --- by elimination


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
        for network, sign in ((one.known, 1.0), (one.every, -1.0)):
            log_z, counts = expected_counts(replace(network, weights=weights), wanted)
            value += sign * log_z
            gradient += sign * counts
    return value, gradient


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
