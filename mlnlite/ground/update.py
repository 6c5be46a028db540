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
from mlnlite.ground.assemble import (
    atom_range,
    distinct,
    index_in,
    known_atoms,
    unknown,
    variables_of,
    with_blocks,
)
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
from mlnlite.ground.patch import renumbered, together, without
from mlnlite.ground.tables import completed, tables_of
from mlnlite.model.change import find
from mlnlite.model.evidence import Evidence
from mlnlite.model.templates import Template

Int64 = NDArray[np.int64]


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
    asked = np.empty(0, np.int64) if query is None else unknown(np.intersect1d(query, mine), now)
    new = distinct([numbers_of(asked, now), *(a for piece, _ in difference.put for a in piece.atoms)])
    new = atoms_numbered(new, now)
    atoms, block = with_blocks(_with_atoms(network.atoms, new, np.setdiff1d(mine, unknown(mine, now))), now)
    variable, value, cardinality, is_block = variables_of(atoms, block, now)
    taken = blocks_of(difference.taken, index_in(numbers_of(network.atoms, now)), network.n_atoms)
    put = blocks_of(difference.put, index_in(numbers_of(atoms, now)), len(atoms))
    left = without(Blocks(network.clauses, network.tables, network.counts), taken, difference.dropped)
    blocks = together(renumbered(left, network.atoms, atoms), put)
    return replace(
        network,
        evidence=now,
        atoms=atoms,
        variable=variable,
        value=value,
        cardinality=cardinality,
        block=is_block,
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
    atoms = np.delete(atoms, place[there])
    place, there = find(atoms, new)
    return np.insert(atoms, place[~there], new[~there])


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
class _Side:
    """One of the two states of evidence, and what runs plans over it."""

    evidence: Evidence
    tables: Tables
    run: Run


def _difference(network: Network, now: Evidence, touched: Mapping[str, Int64], engine: Engine | None) -> _Difference:
    found = _Difference(network.decided_true.copy(), np.zeros(len(network.weights), np.bool_))
    sides: tuple[_Side, _Side] | None = None
    for i, template in enumerate(network.model.templates):
        if not any(a.predicate in touched for a in template.formula.atoms):
            continue
        sides = sides or (_side(network, network.evidence, touched, engine), _side(network, now, touched, engine))
        rows = slice(*np.searchsorted(network.template, [i, i + 1]).tolist())
        with blamed(template):
            if counting_source(i, template, now) is None:
                _add_touched(found, source_of(i, template, now), template, rows, sides, touched)
            else:
                _add_whole(found, i, template, rows, sides[1])
    return found


def _side(network: Network, evidence: Evidence, touched: Mapping[str, Int64], engine: Engine | None) -> _Side:
    tables = {**tables_of(evidence), **row_tables(network.model)}
    for name, numbers in touched.items():
        tables[f"{name}{TOUCHED}"] = (np.zeros(len(numbers), np.int32), *evidence.arguments_of(name, numbers).T)
    return _Side(evidence, tables, (engine or engine_for()).load(tables))


def _add_whole(found: _Difference, index: int, template: Template, rows: slice, now: _Side) -> None:
    part = ground_template(index, template, now.evidence, now.run, now.tables)
    found.dropped[rows] = True
    found.decided_true[rows] = part.decided_true
    found.put.extend((piece, rows.start) for piece in part.pieces)


def _add_touched(
    found: _Difference,
    source: Source,
    template: Template,
    rows: slice,
    sides: tuple[_Side, _Side],
    touched: Mapping[str, Int64],
) -> None:
    """Adds what the groundings of a template were and are that touch one of the atoms."""
    indices = [i for i, atom in enumerate(source.formula.atoms) if atom.predicate in touched]
    more_true, more_open = (np.zeros(source.n_rows, np.int64) for _ in range(2))
    for end in range(1, len(indices) + 1):
        mine = replace(source, touching=tuple(indices[:end]))
        for side, sign, pieces in zip(sides, (-1, 1), (found.taken, found.put), strict=True):
            tally, lists_true = _listed(replace(mine, evidence=side.evidence), side)
            pieces.extend((piece, rows.start) for piece in tally.pieces)
            more_true += sign * (tally.true if lists_true else -tally.false - tally.open)
            more_open += sign * tally.open
    if template.hard and (more_true + more_open < 0).any():
        plan = plan_of(source)
        raise violated(template, "" if isinstance(plan, bool) else violation(source, plan, sides[1].run))
    found.decided_true[rows] += more_true


def _listed(source: Source, side: _Side) -> tuple[Tally, bool]:
    """What the plan of a source lists, and whether it is where the formula can be true."""
    plan = plan_of(source)
    if isinstance(plan, bool):
        return Tally([], *(np.zeros(source.n_rows, np.int64) for _ in range(3))), plan
    tally = tally_of(source, plan, side.run, [plan.compiled.plan])
    assert tally is not None  # nothing is counted
    return tally, plan.lists_true
