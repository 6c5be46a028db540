"""The groundings that a given world makes false, as a query: for formulas that must not be listed whole.

Cutting planes (Riedel, Improving the accuracy and efficiency of MAP inference for Markov logic, UAI 2008): solve
without such a formula, ask which of its groundings the solution violates, add these, and solve again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.choose import engine_for
from mlnlite.engines.plan import Engine, Relation
from mlnlite.ground.blocks import Piece
from mlnlite.ground.compile import Source, bindings, with_number
from mlnlite.ground.condition import with_facts
from mlnlite.ground.ground import row_tables, source_of
from mlnlite.ground.network import Network
from mlnlite.ground.residual import ClauseShape
from mlnlite.ground.tables import tables_of
from mlnlite.model.change import UNKNOWN
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import closed
from mlnlite.model.formulas import AtomRef
from mlnlite.model.propositional import cubes

Int64 = NDArray[np.int64]

_CERTAIN = ".certain"


def world_evidence(network: Network, truth: NDArray[np.bool_]) -> Evidence:
    """The true atoms of a world as evidence, everything else false."""
    known = np.where(truth, 1, UNKNOWN).astype(np.int8)
    return closed(with_facts(network, known), network.evidence.predicates)


def violations(
    network: Network,
    world: Evidence,
    template: int,
    *,
    certain: Evidence | None = None,
    engine: Engine | None = None,
    most: int | None = None,
) -> list[Piece]:
    """The groundings of a template that a world makes false, as clauses of atom numbers.

    Args:
        network: whose model has the template.
        world: complete, as `world_evidence` gives it.
        template: its index in `model.templates`.
        certain: for a world in which some atoms are only partly true: what is wholly true. `world` then holds what
            may be true, and a grounding counts as violated if it may be.
        engine: what runs the query.
        most: no more than so many of each kind of clause.

    Returns:
        Pieces of clauses (the disjunction of literals that are all false in the world), over known atoms too, which are
        given as `Evidence.atom_number` has them.
    """
    tables = {**tables_of(world), **row_tables(network.model)}
    source = source_of(template, network.model.templates[template], world)
    if certain is not None:
        source = replace(source, excluded=_CERTAIN)
        tables |= {f"{name}{_CERTAIN}": columns for name, columns in tables_of(certain).items()}
    run = (engine or engine_for()).load(tables)
    pieces = []
    for cube in cubes(source.formula.body, False):
        literals = [(p.index, truth) for p, truth in cube.items() if isinstance(p, AtomRef)]
        plan = bindings(source, cube, source.formula.free)
        for index, _ in literals:
            plan = with_number(plan, world, source.formula.atoms[index], column_of(index), world.first_atom())
        rows = run(plan)
        pieces += _pieces(source, literals, rows, most)
    return pieces


def column_of(index: int) -> str:
    """Name of the column with the number of atom `index`."""
    return f"n{index}"


def _pieces(source: Source, literals: Sequence[tuple[int, bool]], rows: Relation, most: int | None) -> list[Piece]:
    names = [column_of(i) for i, _ in literals]
    n_rows = len(rows[names[0]]) if names else 0
    if not n_rows:
        return []
    keep = np.arange(n_rows)[:most]
    # every literal of the cube holds, so the clause of their negations is what is violated
    shape = ClauseShape(tuple(i for i, _ in literals), tuple(not truth for _, truth in literals), negated=False)
    row = rows["row"][keep] if source.tabled else np.zeros(len(keep), np.int64)
    return [Piece(tuple(rows[name][keep] for name in names), shape, row, np.ones(len(keep), np.int64))]
