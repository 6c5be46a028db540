"""A template to a relational plan: which groundings evidence leaves open, as rows of atom numbers.

Evidence comes first: a literal that must be true of a closed predicate generates its rows, any other one filters. Only
variables that no literal generates range over the constants of their type.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from mlnlite.engines.plan import (
    AntiJoin,
    Compute,
    Count,
    Join,
    Lookup,
    One,
    Plan,
    Project,
    Scan,
    Union,
    Where,
    columns_of,
)
from mlnlite.ground.numbers import first_numbers
from mlnlite.ground.tables import KNOWN_FALSE, KNOWN_TRUE
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import Argument, AtomRef, AtomSchema, Const, Equal, Formula, Var
from mlnlite.model.propositional import Counted, Cube

WORLDS = "worlds"
"""Table of the numbers of the databases."""

TOUCHED = ".touched"
"""Ends the names of the tables of atoms about which evidence has changed."""


@dataclass(frozen=True, slots=True)
class Source:
    """What plans of one formula draw on.

    Attributes:
        formula: without quantifiers.
        evidence: completed.
        keys: the key variables.
        rows: name of the table of the template's rows (keys, then row number).
        n_rows: its length.
        world: the column of the database, or None where there is one database only.
        counted: the counted propositions of the formula.
        excluded: ends the names of the tables of facts that literals must not contradict; others only generate.
        touching: indices of atoms, the last of which is to be among those in `P.touched`, and the others not; so plans
            list the groundings that some atoms touch, each for the first atom of the formula that is one of them. What
            is known of the touched ones stands in tables of their own, `P.touched.true` and so on.
        state: ends the names of all tables of facts.
    """

    formula: Formula
    evidence: Evidence
    keys: tuple[int, ...]
    rows: str
    n_rows: int
    world: str | None = None
    counted: tuple[Counted, ...] = ()
    excluded: str = ""
    touching: tuple[int, ...] = ()
    state: str = ""

    @property
    def tabled(self) -> bool:
        """Whether plans have a column `row`; otherwise there is one row."""
        return bool(self.keys) or self.n_rows != 1

    def columns(self, schema: AtomSchema) -> tuple[str | int | None, ...]:
        """How a scan of a table of the atom's predicate binds its columns."""
        return (self.world, *map(side, schema.arguments))

    def table(self, index: int, kind: str) -> str:
        """Name of the table of what is known (`true`, `false`, or `known`) of the predicate of an atom."""
        touched = TOUCHED if self.touching and index == self.touching[-1] else ""
        return f"{self.formula.atoms[index].predicate}{touched}.{kind}{self.state}"

    def n_known(self, schema: AtomSchema, truth: bool) -> int:
        """Number of facts about the predicate of an atom."""
        known = self.evidence.facts[schema.predicate].truth
        n_true = int(np.count_nonzero(known))
        return n_true if truth else len(known) - n_true

    def is_closed(self, schema: AtomSchema) -> bool:
        """Whether every atom of the predicate is known."""
        return self.evidence.predicates[schema.predicate].closed


def column(variable: int) -> str:
    """Name of the column of a variable."""
    return f"v{variable}"


def side(argument: Argument) -> str | int:
    """A term in a plan: the column of a variable, or the id of a constant."""
    return column(argument.index) if isinstance(argument, Var) else argument.id


def variables_of(terms: Sequence[Argument]) -> set[int]:
    """The variables among terms."""
    return {t.index for t in terms if isinstance(t, Var)}


# --- bindings of a cube: generate, then filter as early as possible


@dataclass(frozen=True, slots=True)
class _Filter:
    needs: frozenset[int]
    apply: Callable[[Plan], Plan]


def bindings(source: Source, cube: Cube, needed: Sequence[int], *, with_atoms: bool = False) -> Plan:
    """Bindings of the `needed` variables (and the row, and the world) for which evidence contradicts no literal.

    Args:
        source: the formula and what is known.
        cube: literals that must be possible.
        needed: variables that must be bound even if no literal mentions them.
        with_atoms: literals of open predicates filter by the columns of their atoms, which stay; see `with_atom`.
    """
    generators, filters = _parts(source, cube, with_atoms)
    equal = [p for p, truth in cube.items() if isinstance(p, Equal) and truth]
    wanted = set(needed).union(*(f.needs for f in filters), *(g[1] for g in generators))
    wanted |= set().union(*(variables_of((e.left, e.right)) for e in equal))
    plan: Plan = One() if source.world is None else Scan(WORLDS, (source.world,))
    bound: set[int] = set()
    waiting = list(generators)
    while waiting or not wanted <= bound:
        plan, bound = _spread(plan, bound, equal)
        plan, filters = _filtered(plan, bound, filters)
        if waiting:
            best = min(waiting, key=lambda g: _growth(source, g, bound))
            waiting.remove(best)
            plan, bound = _joined(plan, best[0]), bound | best[1]
        elif not wanted <= bound:
            variable = min(wanted - bound, key=lambda v: _n_constants(source, v))
            plan, bound = _joined(plan, _domain(source, variable)), bound | {variable}
    plan, bound = _spread(plan, bound, equal)
    plan, filters = _filtered(plan, bound, filters)
    for equality in equal:
        plan = Where(plan, side(equality.left), "=", side(equality.right))
    return plan


def _parts(source: Source, cube: Cube, with_atoms: bool) -> tuple[list[tuple[Plan, set[int], int]], list[_Filter]]:
    """Generators (plan, variables, size) and filters of a cube."""
    generators: list[tuple[Plan, set[int], int]] = []
    filters: list[_Filter] = []
    if source.tabled:
        rows = Scan(source.rows, (*map(column, source.keys), "row"))
        generators.append((rows, set(source.keys), source.n_rows))
    for index in source.touching:
        schema = source.formula.atoms[index]
        scan = Scan(f"{schema.predicate}{TOUCHED}", source.columns(schema))
        if index == source.touching[-1]:
            generators.append((scan, variables_of(schema.arguments), 0))
        else:
            filters.append(_without(schema, scan))
    for proposition, truth in cube.items():
        if isinstance(proposition, Equal):
            if not truth:
                filters.append(_different(proposition))
            continue
        schema = source.formula.atoms[proposition.index]
        n_true = source.n_known(schema, True)
        if truth and source.is_closed(schema):
            scan = Scan(source.table(proposition.index, "true"), source.columns(schema))
            generators.append((scan, variables_of(schema.arguments), n_true))
        elif source.n_known(schema, not truth):
            looked_up = with_atoms and not source.is_closed(schema)
            filters.append((_looked_up if looked_up else _excluded)(source, proposition.index, not truth))
    return generators, filters


def _excluded(source: Source, index: int, truth: bool) -> _Filter:
    schema = source.formula.atoms[index]
    table = source.table(index, "true" if truth else "false") + source.excluded
    return _without(schema, Scan(table, source.columns(schema)))


def _looked_up(source: Source, index: int, truth: bool) -> _Filter:
    needs = frozenset(variables_of(source.formula.atoms[index].arguments))
    return _Filter(needs, lambda plan: with_atom(plan, source, index, KNOWN_TRUE if truth else KNOWN_FALSE))


def _without(schema: AtomSchema, scan: Scan) -> _Filter:
    return _Filter(frozenset(variables_of(schema.arguments)), lambda plan: AntiJoin(plan, scan))


def _different(equality: Equal) -> _Filter:
    needs = frozenset(variables_of((equality.left, equality.right)))
    return _Filter(needs, lambda plan: Where(plan, side(equality.left), "!=", side(equality.right)))


def _filtered(plan: Plan, bound: set[int], filters: list[_Filter]) -> tuple[Plan, list[_Filter]]:
    later = []
    for item in filters:
        if item.needs <= bound:
            plan = item.apply(plan)
        else:
            later.append(item)
    return plan, later


def _spread(plan: Plan, bound: set[int], equal: list[Equal]) -> tuple[Plan, set[int]]:
    """Binds variables that a cube makes equal to a bound variable or a constant."""
    changed = True
    while changed:
        changed = False
        for equality in equal:
            for to, value in ((equality.left, equality.right), (equality.right, equality.left)):
                if isinstance(to, Var) and to.index not in bound and variables_of([value]) <= bound:
                    if isinstance(value, Const):
                        plan = Compute(plan, column(to.index), (), value.id)
                    else:
                        plan = Compute(plan, column(to.index), ((column(value.index), 1),))
                    bound = bound | {to.index}
                    changed = True
    return plan, bound


def _growth(source: Source, generator: tuple[Plan, set[int], int], bound: set[int]) -> float:
    """About how many rows of a generator fit a binding: its rows are spread evenly over constants and databases."""
    plan, variables, size = generator
    n_worlds = source.evidence.n_databases if source.world in columns_of(plan) else 1
    return size / (n_worlds * prod(max(1, _n_constants(source, v)) for v in variables & bound))


def _joined(plan: Plan, other: Plan) -> Plan:
    return other if isinstance(plan, One) else Join(plan, other)


def _n_constants(source: Source, variable: int) -> int:
    return len(source.evidence.types[source.formula.variables[variable].type].constants)


def _domain(source: Source, variable: int) -> Plan:
    return Scan(f"type:{source.formula.variables[variable].type}", (source.world, column(variable)))


# --- the open groundings of a template


def atom_column(index: int) -> str:
    """Name of the column of atom `index`: its number, or `KNOWN_TRUE`, or `KNOWN_FALSE`."""
    return f"a{index}"


def equality_column(index: int) -> str:
    """Name of the column that is 0 where equality `index` holds."""
    return f"e{index}"


@dataclass(frozen=True, slots=True)
class Compiled:
    """The plan of a template's open groundings.

    Attributes:
        plan: columns `row` (if there are keys), those of `atoms` and of `equalities`, and `count` if `counted`.
        atoms: atoms that have a column.
        known: truth of the atoms that have none, the same in all rows.
        equalities: equalities that have a column; the others are in `known`.
        counted: rows stand for several groundings.
    """

    plan: Plan
    atoms: tuple[int, ...]
    known: Cube
    equalities: tuple[Equal, ...]
    counted: bool


def compiled(source: Source, cubes: Sequence[Cube], equalities: Sequence[Equal]) -> Compiled:
    """The plan that lists the groundings in which some cube is possible.

    Args:
        source: the formula and what is known.
        cubes: disjoint cubes of the formula or of its negation.
        equalities: all equalities of the formula.
    """
    free = source.formula.free
    plan: Plan
    known: dict[AtomRef | Equal, bool] = {}
    if len(cubes) == 1:
        plan = bindings(source, cubes[0], free, with_atoms=True)
        known = {p: t for p, t in cubes[0].items() if isinstance(p, Equal) or _decided(source, p)}
    else:
        columns = (*map(column, free), *(("row",) if source.tabled else ()))
        plan = Union(tuple(Project(bindings(source, cube, free), columns) for cube in cubes))
    atoms = tuple(i for i in range(len(source.formula.atoms)) if AtomRef(i) not in known)
    there = columns_of(plan)
    for i in atoms:
        plan = plan if atom_column(i) in there else with_atom(plan, source, i)
    open_equalities = tuple(e for e in equalities if e not in known)
    for i, equality in enumerate(open_equalities):
        plan = _with_equality(plan, i, equality)
    kept = [*(["row"] if source.tabled else []), *map(atom_column, atoms)]
    kept += [equality_column(i) for i in range(len(open_equalities))]
    seen = set(source.keys).union(*(variables_of(source.formula.atoms[i].arguments) for i in atoms))
    counted = not kept or not set(free) <= seen
    final = Count(plan, tuple(kept)) if counted else Project(plan, tuple(kept))
    return Compiled(final, atoms, known, open_equalities, counted)


def _decided(source: Source, atom: AtomRef) -> bool:
    return source.is_closed(source.formula.atoms[atom.index])


def strides(evidence: Evidence, predicate: str) -> list[int]:
    """Factor of each argument in an atom's number."""
    sizes = evidence.sizes(predicate)
    return [prod(sizes[i + 1 :]) for i in range(len(sizes))]


def affine(evidence: Evidence, schema: AtomSchema, first: Mapping[str, int]) -> tuple[dict[str, int], int]:
    """The number of an atom as a sum: the factors of columns of variables, and a constant.

    Args:
        evidence: has the types.
        schema: the atom.
        first: number of the first atom of each predicate.
    """
    terms: dict[str, int] = {}
    constant = first[schema.predicate]
    for argument, stride in zip(schema.arguments, strides(evidence, schema.predicate), strict=True):
        if isinstance(argument, Const):
            constant += argument.id * stride
        else:
            terms[column(argument.index)] = terms.get(column(argument.index), 0) + stride
    return terms, constant


def with_number(plan: Plan, evidence: Evidence, schema: AtomSchema, name: str, first: Mapping[str, int]) -> Plan:
    """Adds the number of an atom as column `name`; see `affine`."""
    terms, constant = affine(evidence, schema, first)
    return Compute(plan, name, tuple(terms.items()), constant)


def with_atom(plan: Plan, source: Source, index: int, dropped: int | None = None) -> Plan:
    """Adds the column of atom `index`: its number (see `ground.numbers`), or `KNOWN_TRUE`, or `KNOWN_FALSE`.

    Args:
        plan: binds the variables of the atom.
        source: the formula and what is known.
        index: of the atom in the formula.
        dropped: `KNOWN_TRUE` or `KNOWN_FALSE`: rows in which that is known of the atom go.
    """
    schema = source.formula.atoms[index]
    has_facts = bool(len(source.evidence.facts[schema.predicate].truth))
    table = source.table(index, "known")
    key = (0 if source.world is None else source.world, *map(side, schema.arguments))
    if source.is_closed(schema):
        return Lookup(plan, table, key, atom_column(index), KNOWN_FALSE)
    name = f"n{index}" if has_facts else atom_column(index)
    plan = with_number(plan, source.evidence, schema, name, first_numbers(source.evidence))
    return Lookup(plan, table, key, atom_column(index), name, dropped) if has_facts else plan


def _with_equality(plan: Plan, index: int, equality: Equal) -> Plan:
    terms: dict[str, int] = {}
    constant = 0
    for argument, sign in ((equality.left, 1), (equality.right, -1)):
        if isinstance(argument, Const):
            constant += sign * argument.id
        else:
            terms[column(argument.index)] = terms.get(column(argument.index), 0) + sign
    return Compute(plan, equality_column(index), tuple(terms.items()), constant)
