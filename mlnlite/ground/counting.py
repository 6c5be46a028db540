"""Formulas in which quantifiers are counted: from bindings of the free variables to functions of a state.

The cases of a quantifier are atoms that differ in some constants only. They are no columns of a plan: their numbers
are an affine function of the variables' columns, and what is known of them is looked up for all of them at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Count, Plan, Project, Relation, Union
from mlnlite.errors import LimitReached
from mlnlite.ground.compile import Compiled, Source, affine, bindings, column, side, variables_of
from mlnlite.ground.groups import Group
from mlnlite.ground.numbers import first_numbers, known_numbers
from mlnlite.ground.residual import Decided, atoms_in, equalities_in, truth_table
from mlnlite.ground.states import NONE, reduced
from mlnlite.ground.tables import KNOWN_FALSE, KNOWN_TRUE
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import Argument, AtomRef, Equal, Expression, Not
from mlnlite.model.propositional import FALSE, TRUE, Cube, Proposition, simplified

Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

MOST_STATES = 1 << 22
"""States of a formula: the product of what its counts and its other atoms can be."""

AT_ONCE = 1 << 19
"""Ground atoms that are looked up at once."""

WIDEST_CASE = 9
"""Atoms and equalities of a case."""

DENSEST = 1 << 24
"""Atoms whose status an array holds."""


def plain_cubes(cubes: tuple[Cube, ...]) -> tuple[Cube, ...]:
    """The cubes without what they say of counted propositions; they may overlap."""
    plain = [{p: t for p, t in c.items() if not (isinstance(p, AtomRef) and p.index < 0)} for c in cubes]
    return ({},) if {} in plain else tuple({frozenset(c.items()): c for c in plain}.values())


def counting_plan(source: Source, cubes: tuple[Cube, ...]) -> Compiled:
    """The plan that lists bindings in which some cube is possible, with a column for each variable that matters.

    Args:
        source: of a formula with counted propositions.
        cubes: as `plain_cubes` gives them.
    """
    free = source.formula.free
    row = ("row",) if source.tabled else ()
    bound = tuple(Project(bindings(source, c, free), (*map(column, free), *row)) for c in cubes)
    plan: Plan = bound[0] if len(bound) == 1 else Union(bound)
    used = _used(source)
    kept = (*row, *map(column, used))
    counted = not kept or not set(free) <= {*used, *source.keys}
    plan = Count(plan, kept) if counted else Project(plan, kept)
    return Compiled(plan, tuple(range(len(source.formula.atoms))), {}, (), counted)


def _used(source: Source) -> tuple[int, ...]:
    """Free variables that an atom or an equality has."""
    parts = (source.formula.body, *(case for c in source.counted for case in c.cases))
    found = set().union(*(variables_of(a.arguments) for a in source.formula.atoms))
    for part in parts:
        found |= set().union(*(variables_of((e.left, e.right)) for e in equalities_in(part)))
    return tuple(sorted(found))


@dataclass(frozen=True, slots=True)
class State:
    """The state as digits: of each proposition its place value, and the truth at each state."""

    plain: tuple[Proposition, ...]
    plain_steps: tuple[int, ...]
    counted_steps: tuple[int, ...]
    true: Int64


def counting_groups(source: Source, rows: Relation) -> list[Group] | None:
    """All rows, gathered by what evidence leaves of the formula; None if a case leaves more than a literal.

    Args:
        source: of a formula with counted propositions.
        rows: the result of running `counting_plan`.

    Raises:
        LimitReached: if the formula has too many states.
    """
    state = state_of(source)
    n_rows = len(next(iter(rows.values()))) if rows else 1
    step = max(1, AT_ONCE // max(1, len(source.formula.atoms)))
    found = []
    for start in range(0, n_rows, step):
        chunk = {name: c[start : start + step] for name, c in rows.items()}
        moves = _columns(source, state, chunk, min(step, n_rows - start))
        if moves is None:
            return None
        for part in reduced(*moves, state.true):
            shape = Decided(part.certain == 1) if isinstance(part.shape, Decided) else part.shape
            found.append(Group(part.index + start, shape, part.atoms))
    return found


def state_of(source: Source) -> State:
    """The digits of a formula with counted propositions.

    Raises:
        LimitReached: if it has too many states.
    """
    body = source.formula.body
    plain: tuple[Proposition, ...] = (
        *(AtomRef(i) for i in sorted(atoms_in(body)) if i >= 0),
        *dict.fromkeys(equalities_in(body)),
    )
    sizes = [2] * len(plain) + [len(c.cases) + 1 for c in source.counted]
    if prod(sizes) > MOST_STATES:
        message = f"a formula with counts and {len(plain)} further atoms has {prod(sizes):,} states"
        raise LimitReached(message, hint="split it into several formulas")
    propositions: tuple[Proposition, ...] = (*plain, *(AtomRef(~i) for i in range(len(source.counted))))
    truth = truth_table(body, propositions)
    for i, counted in enumerate(source.counted):
        n_true = np.arange(len(counted.cases) + 1)
        truth = truth.take(((n_true >= counted.low) & (n_true <= counted.high)).astype(int), axis=len(plain) + i)
    steps = [prod(sizes[i + 1 :]) for i in range(len(sizes))]
    return State(plain, tuple(steps[: len(plain)]), tuple(steps[len(plain) :]), truth.ravel().astype(np.int64))


def _columns(source: Source, state: State, rows: Relation, n: int) -> tuple[Int64, Int64, Int64] | None:
    """Unknown atoms of each row, their steps, and the state where all are false; None as `counting_groups`."""
    numbers = _numbers(source, rows, n)
    columns = [*_plain_columns(source, state, rows, numbers)]
    for counted, step in zip(source.counted, state.counted_steps, strict=True):
        literals = [(i, *_literal(case)) for i, case in enumerate(counted.cases)]
        index = [a for _, a, _ in literals if a is not None]
        sign = np.array([s for _, a, s in literals if a is not None], np.bool_)
        atoms = numbers[:, index]
        columns.append(_moves(atoms, np.broadcast_to(sign, atoms.shape), step))
        for i in (i for i, a, _ in literals if a is None):
            literal = _case_literal(counted.cases[i], rows, numbers)
            if literal is None:
                return None
            columns.append(_moves(*literal, step))
    every, steps, offsets = zip(*columns, strict=True)
    return np.concatenate(every, axis=1), np.concatenate(steps, axis=1), np.sum(offsets, axis=0)


def _plain_columns(
    source: Source, state: State, rows: Relation, numbers: Int64
) -> Iterator[tuple[Int64, Int64, Int64]]:
    yield np.empty((len(numbers), 0), np.int64), np.empty((len(numbers), 0), np.int64), np.zeros(len(numbers), np.int64)
    for proposition, step in zip(state.plain, state.plain_steps, strict=True):
        if isinstance(proposition, AtomRef):
            atoms = numbers[:, [proposition.index]]
        else:
            atoms = np.where(holds(proposition, rows, len(numbers)), KNOWN_TRUE, KNOWN_FALSE)[:, None]
        yield _moves(atoms, np.ones(atoms.shape, np.bool_), step)


def _moves(atoms: Int64, sign: Bool, step: int) -> tuple[Int64, Int64, Int64]:
    """What literals add to the state, as atoms, their steps, and the sum where unknown atoms are false.

    Args:
        atoms: shape (n, k), numbers of atoms, or `KNOWN_TRUE`, or `KNOWN_FALSE`.
        sign: shape (n, k), whether the literal is the atom itself or its negation.
        step: what a true literal adds.
    """
    certain = np.where(sign, atoms == KNOWN_TRUE, atoms != KNOWN_TRUE).sum(axis=1) * step
    return np.maximum(atoms, NONE), np.where(sign, step, -step), certain


def _literal(case: Expression) -> tuple[int | None, bool]:
    """Atom and sign of a literal; no atom for any other expression."""
    atom = case.operand if isinstance(case, Not) else case
    return (atom.index if isinstance(atom, AtomRef) else None), not isinstance(case, Not)


def _case_literal(case: Expression, rows: Relation, numbers: Int64) -> tuple[Int64, Bool] | None:
    """The literal that each row leaves of a case: atoms and signs, shapes (n, 1); None if some row leaves more."""
    n = len(numbers)
    propositions: list[Proposition] = [*map(AtomRef, sorted(atoms_in(case))), *dict.fromkeys(equalities_in(case))]
    if len(propositions) > WIDEST_CASE:
        return None
    code = np.zeros(n, np.int16)
    for p in propositions:
        code *= 3
        if isinstance(p, AtomRef):
            code += np.clip(-numbers[:, p.index], 0, 2).astype(np.int16)
        else:
            code += np.where(holds(p, rows, n), np.int16(-KNOWN_TRUE), np.int16(-KNOWN_FALSE))
    atoms, sign = np.empty(n, np.int64), np.ones(n, np.bool_)
    for value in np.flatnonzero(np.bincount(code)).tolist():
        mine = code == value
        known: dict[Proposition, bool] = {}
        for p in reversed(propositions):
            value, digit = divmod(value, 3)
            if digit:
                known[p] = digit == -KNOWN_TRUE
        left = simplified(case, known)
        if left in (TRUE, FALSE):
            atoms[mine] = KNOWN_TRUE if left == TRUE else KNOWN_FALSE
            continue
        index, positive = _literal(left)
        if index is None:
            return None
        atoms[mine], sign[mine] = numbers[mine, index], positive
    return atoms[:, None], sign[:, None]


def holds(equality: Equal, rows: Relation, n: int) -> Bool:
    """Whether an equality holds in each of `n` bindings."""

    def value(term: Argument) -> Int64 | int:
        at = side(term)
        return rows[at] if isinstance(at, str) else at

    return np.broadcast_to(np.equal(value(equality.left), value(equality.right)), (n,))


def _numbers(source: Source, rows: Relation, n: int) -> Int64:
    """For each row and atom its number, or `KNOWN_TRUE`, or `KNOWN_FALSE`, shape (n, n_atoms)."""
    evidence = source.evidence
    variables = _used(source)
    place = {column(v): i for i, v in enumerate(variables)}
    bound = np.stack([rows[column(v)] for v in variables], axis=1) if variables else np.empty((n, 0), np.int64)
    constant = np.empty(len(source.formula.atoms), np.int64)
    factor = np.zeros((len(variables), len(source.formula.atoms)), np.int64)
    by_predicate: dict[str, list[int]] = {}
    first = first_numbers(evidence)
    for i, schema in enumerate(source.formula.atoms):
        terms, constant[i] = affine(evidence, schema, first)
        for name, stride in terms.items():
            factor[place[name], i] = stride
        by_predicate.setdefault(schema.predicate, []).append(i)
    numbers = bound @ factor + constant
    for name, atoms in by_predicate.items():
        numbers[:, atoms] = _known(evidence, name, numbers[:, atoms])
    return numbers


def _known(evidence: Evidence, predicate: str, numbers: Int64) -> Int64:
    """Numbers of atoms of a predicate with `KNOWN_TRUE` or `KNOWN_FALSE` in place of those that are known."""
    facts = evidence.facts[predicate]
    known = known_numbers(predicate, evidence)
    value = np.where(facts.truth, KNOWN_TRUE, KNOWN_FALSE)
    low, high = int(numbers.min(initial=0)), int(numbers.max(initial=0)) + 1
    inside = (known >= low) & (known < high)
    known, value = known[inside], value[inside]
    if high - low <= DENSEST:
        status = np.zeros(high - low, np.int8)
        status[known - low] = value
        found = status[numbers - low]
    else:
        order = np.argsort(known)
        at = order[np.minimum(np.searchsorted(known, numbers, sorter=order), max(len(known) - 1, 0))]
        found = np.where(known[at] == numbers, value[at], 0) if len(known) else np.zeros(numbers.shape, np.int64)
    unknown = KNOWN_FALSE if evidence.predicates[predicate].closed else numbers
    return np.where(found == 0, unknown, found)
