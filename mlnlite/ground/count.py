"""True groundings of every formula in one world, by counting joins: no network, no grounding listed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.numpy import NumpyEngine
from mlnlite.engines.plan import Count, Engine, Run, Tables
from mlnlite.ground.compile import Source, bindings
from mlnlite.ground.ground import counting_source, groundings_of_a_row, part_of, plan_of, row_tables, source_of
from mlnlite.ground.tables import tables_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import closed
from mlnlite.model.model import Model
from mlnlite.model.propositional import cubes

Int64 = NDArray[np.int64]


def count_true(model: Model, world: Evidence, *, engine: Engine | None = None) -> Int64:
    """Number of true groundings of each weight (the rows of all templates, one after the other).

    Args:
        model: with expanded templates.
        world: one database; what is not a fact is false.
        engine: what runs the joins; by default the reference engine.
    """
    world = closed(world, world.predicates)
    tables = {**tables_of(world), **row_tables(model)}
    run = (engine or NumpyEngine()).load(tables)
    found = [np.empty(0, np.int64)]
    for i, template in enumerate(model.templates):
        counting = counting_source(i, template, world)
        if counting is not None:
            found.append(_by_listing(counting, run, tables))
            continue
        source = source_of(i, template, world)
        false, true = cubes(source.formula.body, False), cubes(source.formula.body, True)
        chosen = true if len(true) < len(false) else false
        n = np.zeros(source.n_rows, np.int64)
        for cube in chosen:
            rows = run(Count(bindings(source, cube, source.formula.free), ("row",) if source.tabled else ()))
            np.add.at(n, rows["row"] if source.tabled else np.zeros(len(rows["count"]), np.int64), rows["count"])
        found.append(n if chosen is true else groundings_of_a_row(source) - n)
    return np.concatenate(found)


def _by_listing(source: Source, run: Run, tables: Tables) -> Int64:
    """True groundings of a formula with counts: these are listed, and found to be decided."""
    plan = plan_of(source)
    if isinstance(plan, bool):
        return np.full(source.n_rows, plan * groundings_of_a_row(source), np.int64)
    part = part_of(source, plan, run, tables)
    assert part is not None
    return part.decided_true
