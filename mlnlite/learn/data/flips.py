"""What each atom changes in formulas whose quantifiers range over too much to be written out.

What a quantifier ranges over are cases, each an expression of a few atoms. How many are true is counted as the data
are; a case that an atom occurs in is looked at again with the atom false, and true. Source, bindings and world in,
entries out, as `counts` gives them from joins.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Relation
from mlnlite.errors import LimitReached
from mlnlite.ground.compile import Source, affine
from mlnlite.ground.counting import AT_ONCE, WIDEST_CASE, State, holds, state_of
from mlnlite.ground.residual import atoms_in, equalities_in, truth_table
from mlnlite.learn.data.missing import blocks_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import AtomRef, Equal, Expression
from mlnlite.model.propositional import Proposition

Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]


class Flips(NamedTuple):
    """`change` groundings of a template's row become true when an atom does, see `counts.Entries`.

    All arrays have shape (n,); what belongs to one atom and row is to be added up.
    """

    atom: Int64
    row: Int64
    change: Int64


@dataclass(frozen=True, slots=True)
class _Cases:
    """Cases that are the same function of their propositions.

    Attributes:
        propositions: shape (n_cases, k), columns of the cases' propositions.
        true: shape (2^k,), truth by the propositions' truth, the first the highest digit.
        step: shape (n_cases,), what a true case adds to the state of the formula.
    """

    propositions: Int64
    true: Int64
    step: Int64


@dataclass(frozen=True, slots=True)
class _World:
    """Some bindings in the data: of each proposition its atom (-1: none), block and truth, shapes (n, n_columns)."""

    atom: Int64
    block: Int64
    truth: Bool


def flips(source: Source, rows: Relation, data: Evidence, name: str) -> Flips:
    """What the atoms of a predicate change.

    Args:
        source: a formula with counted propositions.
        rows: its bindings: columns of variables, `row` if the template has several, `count` if they stand for several.
        data: one database, complete.
        name: of the predicate.

    Raises:
        LimitReached: if the formula has too many states, or a case too many atoms.
    """
    state, cases, columns = _layout(source)
    found = [Flips(*(np.empty(0, np.int64) for _ in range(3)))]
    for part, n in _parts(rows, len(columns)):
        world = _world(source, part, data, (name, columns), n)
        found.append(_changes(cases, world, state.true, part))
    return Flips(*map(np.concatenate, zip(*found, strict=True)))


def holds_everywhere(source: Source, rows: Relation, data: Evidence) -> bool:
    """Whether a formula is true for all its bindings in the data; arguments as for `flips`."""
    state, cases, columns = _layout(source)
    for part, n in _parts(rows, len(columns)):
        world = _world(source, part, data, ("", columns), n)
        if not state.true[_state(cases, world)].all():
            return False
    return True


def _layout(source: Source) -> tuple[State, list[_Cases], dict[Proposition, int]]:
    """The digits of a formula's state, what adds to them, and the columns of propositions."""
    state = state_of(source)
    columns: dict[Proposition, int] = {AtomRef(i): i for i in range(len(source.formula.atoms))}
    every: list[tuple[Expression, int]] = [*zip(state.plain, state.plain_steps, strict=True)]
    for counted, step in zip(source.counted, state.counted_steps, strict=True):
        every += [(case, step) for case in counted.cases]
    return state, _alike(every, columns), columns


def _parts(rows: Relation, n_columns: int) -> Iterator[tuple[Relation, int]]:
    """Bindings in parts, and the length of each."""
    n = len(next(iter(rows.values()))) if rows else 1
    at_once = max(1, AT_ONCE // max(1, n_columns))
    for start in range(0, n, at_once):
        yield {key: values[start : start + at_once] for key, values in rows.items()}, min(at_once, n - start)


def _alike(every: list[tuple[Expression, int]], columns: dict[Proposition, int]) -> list[_Cases]:
    """Cases with their steps, those of one function together; new equalities get columns."""
    found: dict[tuple[int, bytes], list[tuple[list[int], int]]] = {}
    for case, step in every:
        propositions: list[Proposition] = [*map(AtomRef, sorted(atoms_in(case))), *dict.fromkeys(equalities_in(case))]
        if len(propositions) > WIDEST_CASE:
            raise LimitReached(f"a quantifier is over a formula of more than {WIDEST_CASE} atoms")
        places = [columns.setdefault(p, len(columns)) for p in propositions]
        found.setdefault((len(places), truth_table(case, tuple(propositions)).tobytes()), []).append((places, step))
    return [
        _Cases(
            np.array([places for places, _ in members], np.int64).reshape(len(members), k),
            np.frombuffer(table, np.bool_).astype(np.int64),
            np.array([step for _, step in members], np.int64),
        )
        for (k, table), members in found.items()
    ]


def _world(source: Source, rows: Relation, data: Evidence, of: tuple[str, dict[Proposition, int]], n: int) -> _World:
    """Bindings in the data; only the atoms of one predicate have numbers."""
    name, columns = of
    number, truth = np.full((n, len(columns)), -1, np.int64), np.zeros((n, len(columns)), np.bool_)
    first = data.first_atom()
    for proposition, place in columns.items():
        if isinstance(proposition, Equal):
            truth[:, place] = holds(proposition, rows, n)
            continue
        terms, constant = affine(data, source.formula.atoms[proposition.index], first)
        number[:, place] = constant + sum(rows[c].astype(np.int64) * factor for c, factor in terms.items())
    names = np.array([s.predicate for s in source.formula.atoms], object)
    for predicate in dict.fromkeys(names.tolist()):
        places, facts = np.flatnonzero(names == predicate), data.facts[predicate]
        true = data.atom_number(predicate, facts.arguments[facts.truth])
        truth[:, places] = np.isin(number[:, places], true)
    number[:, : len(names)][:, names != name] = -1
    block = np.where(number >= 0, blocks_of(data, data.predicates[name], number), -1) if name else number
    return _World(number, block, truth)


def _changes(cases: list[_Cases], world: _World, true: Int64, rows: Relation) -> Flips:
    """The atom true against its block without a value, for each binding and atom."""
    state = _state(cases, world)
    atoms, blocks = [np.empty((4, 0), np.int64)], [np.empty((3, 0), np.int64)]
    for some in cases:
        now = some.true[_code(world.truth[:, some.propositions])]
        for j in range(some.propositions.shape[1]):
            atom, block = _again(some, world, now, j)
            atoms.append(atom)
            blocks.append(block)
    binding, atom, block, step = _added(np.concatenate(atoms, axis=1))
    of_binding, of_block, without = _added(np.concatenate(blocks, axis=1))
    width = int(max(block.max(initial=0), of_block.max(initial=0))) + 1
    key, wanted = of_binding * width + of_block, binding * width + block
    at = np.minimum(np.searchsorted(key, wanted), max(len(key) - 1, 0))
    base = state[binding] + (np.where(key[at] == wanted, without[at], 0) if len(key) else 0)
    change = true[base + step] - true[base]
    kept = np.flatnonzero(change)
    change, binding = change[kept], binding[kept]
    row, count = rows.get("row"), rows.get("count")
    return Flips(
        atom[kept],
        np.zeros(len(kept), np.int64) if row is None else row[binding].astype(np.int64),
        change if count is None else change * count[binding],
    )


def _state(cases: list[_Cases], world: _World) -> Int64:
    """The state of the formula for each binding."""
    state = np.zeros(len(world.atom), np.int64)
    for some in cases:
        state += some.true[_code(world.truth[:, some.propositions])] @ some.step
    return state


def _code(truth: Bool) -> Int64:
    """Truth of propositions, shape (..., k), as places in a table."""
    return np.asarray(truth @ (1 << np.arange(truth.shape[-1] - 1, -1, -1)), np.int64)


def _again(some: _Cases, world: _World, now: Int64, j: int) -> tuple[Int64, Int64]:
    """What the j-th atom of each case moves, where it does: (binding, atom, block, step) and (binding, block, step).

    The first is of the atom true against its block without a value; the second of that against the data. An atom that
    occurs again in a case counts once, as does a block.
    """
    places = some.propositions
    atom, block, truth = world.atom[:, places], world.block[:, places], world.truth[:, places]
    own, mates = atom[:, :, j, None], block[:, :, j, None]
    without = truth & ~(block == mates)
    false = some.true[_code(without)]
    true = some.true[_code(without | (atom == own))]
    mine = own[:, :, 0] >= 0
    new_atom = mine & ~(atom[:, :, :j] == own).any(axis=2) & (true != false)
    new_block = mine & ~(block[:, :, :j] == mates).any(axis=2) & (false != now)
    row, case = np.nonzero(new_atom)
    first = row, atom[row, case, j], block[row, case, j], some.step[case] * (true - false)[row, case]
    row, case = np.nonzero(new_block)
    second = row, block[row, case, j], some.step[case] * (false - now)[row, case]
    return np.stack(first), np.stack(second)


def _added(entries: Int64) -> Iterator[Int64]:
    """Entries, shape (k, n), that agree in all but the last added up, in order."""
    keys, values = entries[:-1], entries[-1]
    if not len(values):
        return iter(entries)
    order = np.lexsort(keys[::-1])
    keys, values = keys[:, order], values[order]
    starts = np.flatnonzero(np.append(True, (keys[:, 1:] != keys[:, :-1]).any(axis=0)))
    return iter([*keys[:, starts], np.add.reduceat(values, starts)])
