"""Formulas whose quantifiers range over many constants: counted, not written out. Databases in, entries out."""

from __future__ import annotations

from dataclasses import replace
from math import prod

import numpy as np

from mlnlite.engines.choose import engine_for
from mlnlite.engines.plan import Engine, Relation
from mlnlite.ground.compile import Source
from mlnlite.ground.counting import counting_plan
from mlnlite.ground.ground import counted_source, row_tables
from mlnlite.ground.tables import completed, tables_of
from mlnlite.learn.data.content import content
from mlnlite.learn.data.counts import Entries, violated
from mlnlite.learn.data.flips import flips, holds_everywhere
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import closed
from mlnlite.model.model import Model
from mlnlite.model.read import one_database
from mlnlite.model.templates import Template

_FEW, _MOST = 4, 20_000_000
"""Cases of a quantifier up to which joins write it out; bindings of all variables up to which they are listed."""


def ranges_widely(template: Template, databases: Evidence) -> bool:
    """Whether a formula has quantifiers over too many cases for joins, and few enough groundings to list them."""
    size = {name: int(present.sum(axis=1).max(initial=0)) for name, present in databases.present.items()}
    variables = template.formula.variables
    return prod(size[v.type] for v in variables if v.bound) > _FEW and prod(size[v.type] for v in variables) <= _MOST


def without_weights(model: Model) -> Model:
    """The model with all weights 0 that are learnt."""
    zero = (t if t.hard or t.fixed else replace(t, weights=np.zeros(len(t.weights))) for t in model.templates)
    return replace(model, templates=tuple(zero))


def counted_entries(
    model: Model, number: int, databases: Evidence, targets: frozenset[str], engine: Engine | None
) -> dict[str, list[Entries]]:
    """What each atom of the target predicates changes.

    Args:
        model: expanded; weights do not matter.
        number: of the template.
        databases: the data, complete.
        targets: predicates that are predicted.
        engine: what runs the plans.

    Raises:
        Contradiction: if the data violate the formula, which is hard.
        LimitReached: what is counted has too many atoms, or the formula too many states.
    """
    found: dict[str, list[Entries]] = {name: [] for name in targets}
    template = model.templates[number]
    first = sum(len(t.weights) for t in model.templates[:number])
    used = {atom.predicate for atom in template.formula.atoms}
    sources: dict[tuple[bytes, ...], tuple[Source, Relation]] = {}
    for i in range(databases.n_databases):
        data = completed(closed(one_database(databases, i), databases.predicates))
        constants = content(data, ())
        if constants not in sources:
            source = counted_source(number, template, data)
            run = (engine or engine_for()).load({**tables_of(data), **row_tables(model)})
            sources[constants] = source, run(counting_plan(source, ({},)).plan)
        if template.hard and not holds_everywhere(*sources[constants], data):
            raise violated(template)
        for name in sorted(targets & used):
            changes = flips(*sources[constants], data, name)
            database = np.full(len(changes.atom), i, np.int64)
            found[name].append(Entries(database, changes.atom, first + changes.row, changes.change))
    return found
