"""Formulas whose quantifiers range over many constants: ground, not written out. Databases in, entries out."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import prod

import numpy as np

from mlnlite.engines.plan import Engine
from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.learn.data.content import content
from mlnlite.learn.data.counts import Entries
from mlnlite.learn.data.flips import flips
from mlnlite.learn.objectives.exact import conditions
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.model.read import one_database
from mlnlite.model.templates import Template

_FEW, _MOST = 4, 20_000_000
"""Cases of a quantifier up to which joins write it out; bindings of all variables up to which it is ground."""


def ranges_widely(template: Template, databases: Evidence) -> bool:
    """Whether a formula has quantifiers over too many cases for joins, and few enough groundings to list them."""
    size = {name: int(present.sum(axis=1).max(initial=0)) for name, present in databases.present.items()}
    variables = template.formula.variables
    return prod(size[v.type] for v in variables if v.bound) > _FEW and prod(size[v.type] for v in variables) <= _MOST


def without_weights(model: Model) -> Model:
    """The model with all weights 0 that are learnt."""
    zero = (t if t.hard or t.fixed else replace(t, weights=np.zeros(len(t.weights))) for t in model.templates)
    return replace(model, templates=tuple(zero))


def ground_entries(
    model: Model, number: int, databases: Evidence, targets: frozenset[str], engine: Engine | None
) -> dict[str, list[Entries]]:
    """What each atom of the target predicates changes; all other predicates are known, as the definition has it.

    Args:
        model: expanded; weights do not matter.
        number: of the template.
        databases: the data, complete.
        targets: predicates that are predicted.
        engine: what runs the plans.

    Raises:
        LimitReached: what is counted is a formula of several unknown atoms.
    """
    found: dict[str, list[Entries]] = {name: [] for name in targets}
    networks: dict[tuple[object, ...], Network] = {}
    first = sum(len(t.weights) for t in model.templates[:number])
    used = {atom.predicate for atom in model.templates[number].formula.atoms}
    model = without_weights(replace(model, templates=(model.templates[number],)))
    for name, i in product(sorted(targets & used), range(databases.n_databases)):
        given, data = conditions(databases, i, frozenset([name]), frozenset()), one_database(databases, i)
        same = name, *content(given, given.predicates)
        if same not in networks:
            networks[same] = ground(model, given, engine=engine)
        network, facts = networks[same], data.facts[name]
        true = data.atom_number(name, facts.arguments[facts.truth])
        changes = flips(network, np.isin(network.atoms, true))
        database = np.full(len(changes.atom), i, np.int64)
        found[name].append(Entries(database, network.atoms[changes.atom], first + changes.weight, changes.change))
    return found
