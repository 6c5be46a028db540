"""Facts that come and go, without grounding again: a network and changed evidence in, the network of the latter out.

Only groundings with an atom about which evidence has changed are listed, once with the old evidence and once with the
new (semi-naive evaluation; Gupta, Mumick and Subrahmanian, Maintaining views incrementally, SIGMOD 1993): what they
were is taken out, what they are is put in. A template whose quantifiers are counted is ground anew if it is touched.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.choose import engine_for
from mlnlite.engines.plan import Engine, Run, Tables
from mlnlite.ground.assemble import atom_range, distinct, known_atoms, unknown, variables_of
from mlnlite.ground.blocks import Blocks, Piece, blocks_of
from mlnlite.ground.compile import TOUCHED, Source
from mlnlite.ground.ground import (
    Tally,
    blamed,
    counting_source,
    ground_template,
    plan_of,
    row_tables,
    source_of,
    tally_of,
    violated,
    violation,
)
from mlnlite.ground.network import Network
from mlnlite.ground.numbers import atoms_numbered, numbers_of
from mlnlite.ground.patch import patched
from mlnlite.ground.tables import completed, fact_tables, tables_of
from mlnlite.model.change import facts_about, find, spliced
from mlnlite.model.evidence import Evidence
from mlnlite.model.templates import Template

Int64 = NDArray[np.int64]

BEFORE = ".before"
"""Ends the names of the tables of facts that were."""


def updated(
    network: Network, evidence: Evidence, changed: Int64, *, query: Int64 | None = None, engine: Engine | None = None
) -> Network:
    """The network of a model whose evidence has changed. Atoms that no factor touches any more stay.

    Args:
        network: as `ground` gives it.
        evidence: what is known now, of the same constants.
        changed: numbers of the atoms about which it says something else than what the network was ground with.
        query: numbers of atoms that must be in the network unless they are known.
        engine: what runs the plans; by default chosen by the size of the input.

    Raises:
        Contradiction: if the evidence makes a hard formula false, or leaves a block without a value.
        LimitReached: as `ground`.
    """
    now = completed(evidence)
    touched = _touched(network.evidence, now, changed)
    mine = distinct(list(touched.values()))
    difference = _difference(network, now, touched, engine)
    asked = np.empty(0, np.int64) if query is None else unknown(query[find(mine, query)[1]], now)
    new = distinct([numbers_of(asked, now), *(a for piece, _ in difference.put for a in piece.atoms)])
    known = np.setdiff1d(mine, unknown(mine, now))
    variables = variables_of(_with_atoms(network.atoms, atoms_numbered(new, now), known), now)
    blocks = patched(
        Blocks(network.clauses, network.tables, network.counts),
        blocks_of(difference.taken, network.atoms, now),
        blocks_of(difference.put, variables.atoms, now),
        difference.dropped,
        (network.atoms, variables.atoms),
    )
    return replace(
        network,
        evidence=now,
        atoms=variables.atoms,
        variable=variables.variable,
        value=variables.value,
        cardinality=variables.cardinality,
        block=variables.block,
        clauses=blocks.clauses,
        tables=blocks.tables,
        counts=blocks.counts,
        decided_true=difference.decided_true,
    )


def _touched(before: Evidence, now: Evidence, changed: Int64) -> dict[str, Int64]:
    """By predicate, the numbers of the atoms whose status may differ."""
    touched = {}
    for name, predicate in now.predicates.items():
        low, high = atom_range(predicate, now)
        mine = np.unique(changed[(changed >= low) & (changed < high)])
        if len(mine) and predicate.value is not None:  # what is known of one value says something about the others
            was, is_ = (2 * known_atoms(predicate, e) + e.facts[name].truth for e in (before, now))
            mine = np.unique(np.setxor1d(was, is_, assume_unique=True) // 2)
        if len(mine):
            touched[name] = mine
    return touched


def _with_atoms(atoms: Int64, new: Int64, known: Int64) -> Int64:
    """Rising numbers of atoms with some more, and without those that are known."""
    place, there = find(atoms, known)
    atoms = spliced(atoms, place[there], np.empty(0, np.int64), known[:0])
    place, there = find(atoms, new)
    return spliced(atoms, np.empty(0, np.int64), place[~there], new[~there])


# --- what the touched groundings were, and what they are


@dataclass(frozen=True, slots=True)
class _Difference:
    """What changes in a network.

    Attributes:
        decided_true: shape (n_weights,), number of groundings that the new evidence makes true.
        dropped: shape (n_weights,), weights of which every factor goes.
        taken: pieces whose factors go, and for each the index of its first weight.
        put: pieces whose factors come.
    """

    decided_true: Int64
    dropped: NDArray[np.bool_]
    taken: list[tuple[Piece, int]] = field(default_factory=list)
    put: list[tuple[Piece, int]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class _Sides:
    """What is known before and after, the tables of both, and what runs plans over them."""

    before: Evidence
    now: Evidence
    touched: Mapping[str, Int64]
    tables: Tables
    run: Run


def _difference(network: Network, now: Evidence, touched: Mapping[str, Int64], engine: Engine | None) -> _Difference:
    found = _Difference(network.decided_true.copy(), np.zeros(len(network.weights), np.bool_))
    sides: _Sides | None = None
    for i, template in enumerate(network.model.templates):
        if not any(a.predicate in touched for a in template.formula.atoms):
            continue
        sides = sides or _sides(network, now, touched, engine)
        rows = slice(*np.searchsorted(network.template, [i, i + 1]).tolist())
        with blamed(template):
            if counting_source(i, template, now) is None:
                _add_touched(found, source_of(i, template, now), template, rows, sides)
            else:
                _add_whole(found, i, template, rows, sides)
    return found


def _sides(network: Network, now: Evidence, touched: Mapping[str, Int64], engine: Engine | None) -> _Sides:
    tables = {**tables_of(now), **row_tables(network.model)}
    for name, facts in network.evidence.facts.items():
        if name in touched:
            tables |= fact_tables(name, facts, BEFORE)
        else:
            tables |= {f"{name}.{kind}{BEFORE}": tables[f"{name}.{kind}"] for kind in ("true", "false", "known")}
    for name, numbers in touched.items():
        tables[f"{name}{TOUCHED}"] = (np.zeros(len(numbers), np.int32), *now.arguments_of(name, numbers).T)
        for evidence, state in ((network.evidence, BEFORE), (now, "")):
            tables |= fact_tables(f"{name}{TOUCHED}", facts_about(evidence, name, numbers), state)
    return _Sides(network.evidence, now, touched, tables, (engine or engine_for()).load(tables))


def _add_whole(found: _Difference, index: int, template: Template, rows: slice, sides: _Sides) -> None:
    part = ground_template(index, template, sides.now, sides.run, sides.tables)
    found.dropped[rows] = True
    found.decided_true[rows] = part.decided_true
    found.put.extend((piece, rows.start) for piece in part.pieces)


def _add_touched(found: _Difference, source: Source, template: Template, rows: slice, sides: _Sides) -> None:
    """Adds what the groundings of a template were and are that touch one of the atoms."""
    indices = [i for i, atom in enumerate(source.formula.atoms) if atom.predicate in sides.touched]
    before = replace(source, evidence=sides.before, state=BEFORE)
    more_true, more_open = (np.zeros(source.n_rows, np.int64) for _ in range(2))
    for end in range(1, len(indices) + 1):
        for side, sign, pieces in ((before, -1, found.taken), (source, 1, found.put)):
            tally, lists_true = _listed(replace(side, touching=tuple(indices[:end])), sides.run)
            pieces.extend((piece, rows.start) for piece in tally.pieces)
            more_true += sign * (tally.true if lists_true else -tally.false - tally.open)
            more_open += sign * tally.open
    if template.hard and (more_true + more_open < 0).any():
        plan = plan_of(source)
        raise violated(template, "" if isinstance(plan, bool) else violation(source, plan, sides.run))
    found.decided_true[rows] += more_true


def _listed(source: Source, run: Run) -> tuple[Tally, bool]:
    """What the plan of a source lists, and whether it is where the formula can be true."""
    plan = plan_of(source)
    if isinstance(plan, bool):
        return Tally([], *(np.zeros(source.n_rows, np.int64) for _ in range(3))), plan
    tally = tally_of(source, plan, run, [plan.compiled.plan])
    assert tally is not None  # nothing is counted
    return tally, plan.lists_true
