"""Model and evidence to network: runs the plan of each template and keeps what evidence leaves open."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.choose import engine_for
from mlnlite.engines.parts import in_parts, most_rows
from mlnlite.engines.plan import Column, Engine, Plan, Relation, Run, Tables
from mlnlite.errors import Contradiction, Diagnostic, LimitReached, QueryMistake
from mlnlite.ground.assemble import Part, network_of, sums_by
from mlnlite.ground.blocks import Piece
from mlnlite.ground.compile import Compiled, Source, atom_column, bindings, column, compiled, with_atom
from mlnlite.ground.counting import counting_groups, counting_plan, plain_cubes
from mlnlite.ground.forecast import Forecast, Limits, advice, forecast, machine_limits, too_large, verify, within
from mlnlite.ground.groups import Group, groups_of, taken
from mlnlite.ground.network import Network
from mlnlite.ground.residual import Decided, equalities_in
from mlnlite.ground.room import Cut, room
from mlnlite.ground.states import NARROW
from mlnlite.ground.tables import completed, tables_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import AtomRef, AtomSchema
from mlnlite.model.model import Model
from mlnlite.model.numbers import comparison_truth
from mlnlite.model.propositional import Cube, cubes, with_counted, without_quantifiers
from mlnlite.model.soft import soft_templates
from mlnlite.model.templates import Template

Int64 = NDArray[np.int64]

NO_LIMITS = Limits()

UNCHECKED = 10_000_000
"""Rows that no machine minds: what cannot have more is not forecast."""


def ground(
    model: Model,
    evidence: Evidence,
    *,
    query: Int64 | None = None,
    engine: Engine | None = None,
    limits: Limits = NO_LIMITS,
) -> Network:
    """The network of a model given evidence.

    Args:
        model: the templates.
        evidence: one database.
        query: numbers of atoms that must be in the network even if no factor touches them (known ones are left out).
        engine: what runs the plans; by default chosen by the size of the input.
        limits: what it may take; by default the machine's memory.

    Raises:
        QueryMistake: if the evidence has several databases, or a formula has no weight.
        Contradiction: if evidence makes a hard formula false.
        LimitReached: if a ground formula has no sensible representation, or a template needs more than the limits.
    """
    model, evidence, tables = prepared(model, evidence)
    run = (engine or engine_for(memory=limits.memory)).load(tables)
    parts = [ground_template(i, t, evidence, run, tables, limits) for i, t in enumerate(model.templates)]
    return network_of(model, evidence, parts, query)


def ground_template(
    index: int, template: Template, evidence: Evidence, run: Run, tables: Tables, limits: Limits = NO_LIMITS
) -> Part:
    """What an (expanded) template gives. Raises as `ground`."""
    with blamed(template):
        counting = counting_source(index, template, evidence)
        part = None if counting is None else _ground_source(counting, template, run, tables, limits)
        if part is None:
            part = _ground_source(source_of(index, template, evidence), template, run, tables, limits)
    assert part is not None  # nothing is counted
    return part


def _ground_source(source: Source, template: Template, run: Run, tables: Tables, limits: Limits) -> Part | None:
    """What a template gives; None if what it counts cannot be told from counts."""
    plan = plan_of(source)
    if isinstance(plan, bool):
        return _constant(source, template, truth=plan)
    if limits == NO_LIMITS and most_rows(plan.compiled.plan, tables) > UNCHECKED:
        limits = machine_limits()
    if limits != NO_LIMITS:
        verify(forecast(template, plan.compiled, tables), source, limits)
        run = within(limits, plan.compiled, run)
    return _grounded(source, template, plan, run, tables)


@contextmanager
def blamed(template: Template) -> Iterator[None]:
    """Says of limits that are reached within which template that was."""
    try:
        yield
    except LimitReached as error:
        cause = error.diagnostics[0]
        if cause.span is not None:
            raise
        message = f"{template.name} cannot be grounded: {cause.message}"
        raise LimitReached([Diagnostic("E402", message, template.span, cause.hint)]) from error


def forecasts(model: Model, evidence: Evidence) -> list[Forecast]:
    """What grounding will take, template by template, without doing it. Raises as `ground`."""
    model, evidence, tables = prepared(model, evidence)
    found = []
    for i, template in enumerate(model.templates):
        plan = plan_of(counting_source(i, template, evidence) or source_of(i, template, evidence))
        found.append(
            Forecast(template, 0.0, 0.0, 0.0, 0.0)
            if isinstance(plan, bool)
            else forecast(template, plan.compiled, tables)
        )
    return found


def prepared(model: Model, evidence: Evidence) -> tuple[Model, Evidence, Tables]:
    """The model with expanded templates, the evidence completed, and both as tables. Raises as `ground`."""
    if evidence.n_databases != 1:
        hint = "choose one of them: `one_database(evidence, 0)`, or `--database 1` on the command line"
        raise QueryMistake(f"the evidence has {evidence.n_databases} databases, and a question is about one", hint)
    verify_same_vocabulary(model, evidence)
    _verify_weights(model)
    evidence = completed(evidence)
    templates = (*model.templates, *soft_templates(evidence))
    model = replace(model, types=evidence.types, templates=tuple(t.expanded(evidence.types) for t in templates))
    return model, evidence, {**tables_of(evidence), **row_tables(model)}


def verify_same_vocabulary(model: Model, evidence: Evidence) -> None:
    """Refuses evidence that was read for another model: its numbers would mean other constants.

    Raises:
        QueryMistake: naming the first type or predicate that differs.
    """
    hint = "read the evidence with this model: `read_evidence(path, model=model)`"
    for name, t in model.types.items():
        known = evidence.types[name].constants if name in evidence.types else ()
        if known[: len(t.constants)] != t.constants:
            raise QueryMistake(f"the evidence was read for another model: the constants of {name} differ", hint)
    for name, predicate in model.predicates.items():
        if name not in evidence.predicates or evidence.predicates[name].types != predicate.types:
            raise QueryMistake(f"the evidence was read for another model: the predicate {name} differs", hint)


def _verify_weights(model: Model) -> None:
    missing = [t for t in model.templates if np.isnan(t.weights).any()]
    if missing:
        hint = "put a weight in front, or a dot behind for a hard formula, or learn the weights: `mlnlite learn`"
        raise QueryMistake([Diagnostic("E501", f"{t.name} has no weight: {t.text}", t.span, hint) for t in missing])


def row_tables(model: Model) -> dict[str, tuple[Column, ...]]:
    """For each (expanded) template `i` the table `rows:i`: its keys, then the number of the row."""
    tables: dict[str, tuple[Column, ...]] = {}
    for i, template in enumerate(model.templates):
        assert template.rows is not None
        keys = (np.ascontiguousarray(c) for c in template.rows.T)
        tables[f"rows:{i}"] = (*keys, np.arange(len(template.rows), dtype=np.int32))
    return tables


def source_of(index: int, template: Template, evidence: Evidence, world: str | None = None) -> Source:
    """What plans of an (expanded) template draw on: its formula without quantifiers, and what is known."""
    assert template.rows is not None
    formula = template.formula
    if any(v.bound for v in formula.variables):
        formula = without_quantifiers(formula, _constants(evidence), _comparisons(evidence))
    return Source(formula, evidence, template.keys, f"rows:{index}", len(template.rows), world)


def counting_source(index: int, template: Template, evidence: Evidence) -> Source | None:
    """As `source_of`, with quantifiers counted; None if there are none, or over few atoms only."""
    assert template.rows is not None
    if not any(v.bound for v in template.formula.variables):
        return None
    source = counted_source(index, template, evidence)
    return source if source.counted and len(source.formula.atoms) > NARROW else None


def counted_source(index: int, template: Template, evidence: Evidence) -> Source:
    """As `source_of`, with quantifiers counted."""
    assert template.rows is not None
    formula, counted = with_counted(template.formula, _constants(evidence), _comparisons(evidence))
    return Source(formula, evidence, template.keys, f"rows:{index}", len(template.rows), None, counted)


def _constants(evidence: Evidence) -> dict[str, list[int]]:
    return {name: np.flatnonzero(p.any(axis=0)).tolist() for name, p in evidence.present.items()}


def _comparisons(evidence: Evidence) -> Callable[[AtomSchema], bool | None]:
    return lambda schema: comparison_truth(schema, evidence.predicates, evidence.types)


@dataclass(frozen=True, slots=True)
class TemplatePlan:
    """How to list the open groundings of a template.

    Attributes:
        compiled: the plan.
        lists_true: it lists where the formula can be true; otherwise where it can be false.
        false: disjoint cubes that cover where the formula is false.
    """

    compiled: Compiled
    lists_true: bool
    false: tuple[Cube, ...]


def plan_of(source: Source) -> TemplatePlan | bool:
    """The plan of a formula, or the truth value that it always has."""
    body = source.formula.body
    false, true = cubes(body, False), cubes(body, True)
    if not (false and true):
        return bool(true)
    if source.counted:
        chosen, other = plain_cubes(true), plain_cubes(false)
        lists_true = {} not in chosen and (len(chosen) < len(other) or {} in other)
        return TemplatePlan(counting_plan(source, chosen if lists_true else other), lists_true, false)
    lists_true = len(true) < len(false)
    equalities = tuple(dict.fromkeys(equalities_in(body)))
    return TemplatePlan(compiled(source, true if lists_true else false, equalities), lists_true, false)


def part_of(source: Source, planned: TemplatePlan, run: Run, tables: Tables) -> Part | None:
    """What a template gives; None if what it counts cannot be told from counts. Raises `LimitReached`, unnamed."""
    tally = tally_of(source, planned, run, in_parts(planned.compiled.plan, tables))
    if tally is None:
        return None
    total = np.full(source.n_rows, groundings_of_a_row(source), np.int64)
    true = tally.true if planned.lists_true else total - tally.open - tally.false
    return Part(tuple(tally.pieces), true, total - tally.open - true, tally.open)


def tally_of(source: Source, planned: TemplatePlan, run: Run, parts: Sequence[Plan]) -> Tally | None:
    """What the plan of a template lists, which several plans list together; None and raises as `part_of`."""
    plan = planned.compiled
    tally = Tally([], *(np.zeros(source.n_rows, np.int64) for _ in range(3)))
    cut = room()
    for part in parts:
        rows = run(part)
        groups = counting_groups(source, rows) if source.counted else groups_of(source.formula, plan, rows, cut)
        if groups is None:
            return None
        _add(tally, source, plan, rows, groups, cut)
    return tally


def _grounded(source: Source, template: Template, planned: TemplatePlan, run: Run, tables: Tables) -> Part | None:
    try:
        part = part_of(source, planned, run, tables)
    except MemoryError as error:
        raise too_large(template, source, "more memory than there is") from error
    except LimitReached as error:
        cause = error.diagnostics[0]
        message = f"{template.name} cannot be grounded: {cause.message}"
        raise LimitReached([Diagnostic("E402", message, template.span, cause.hint or advice(source))]) from error
    if part is not None and template.hard and (part.decided_false > 0).any():
        raise violated(template, violation(source, planned, run))
    return part


def _listed(source: Source, planned: TemplatePlan, run: Run) -> str:
    """The binding of a row that evidence makes false, as text, if one is listed."""
    rows = run(planned.compiled.plan)
    for group in counting_groups(source, rows) or []:
        if group.shape == Decided(truth=False):
            row = group.index.start or 0 if isinstance(group.index, slice) else group.index[0]
            bound = [v for v in source.formula.free if column(v) in rows]
            return _binding_text(source, {v: int(rows[column(v)][row]) for v in bound})
    return ""


def violated(template: Template, where: str) -> Contradiction:
    """The error that names a hard template which evidence makes false."""
    hint = "one of the two is wrong: change the facts, or give the formula a weight"
    message = f"the evidence makes {template.name} false, which is hard: {template.text}{where}"
    return Contradiction([Diagnostic("E403", message, template.span, hint)])


def violation(source: Source, planned: TemplatePlan, run: Run) -> str:
    """A binding for which evidence makes a formula false, as text: ` (x = Anna)`; empty if none is listed."""
    if source.counted:
        return _listed(source, planned, run)
    for cube in planned.false:
        atoms = [p.index for p in cube if isinstance(p, AtomRef)]
        plan = bindings(source, cube, source.formula.free)
        for index in atoms:
            plan = with_atom(plan, source, index)
        rows = run(plan)
        n_rows = len(next(iter(rows.values()))) if rows else 0
        known = np.all([rows[atom_column(i)] < 0 for i in atoms], axis=0) if atoms else np.ones(n_rows, bool)
        for row in np.flatnonzero(known)[:1]:
            return _binding_text(source, {v: int(rows[column(v)][row]) for v in source.formula.free})
    return ""


def _binding_text(source: Source, binding: dict[int, int]) -> str:
    variables = source.formula.variables
    texts = [
        f"{variables[v].name} = {source.evidence.types[variables[v].type].constants[c]}" for v, c in binding.items()
    ]
    return f" ({', '.join(texts)})" if texts else ""


def _constant(source: Source, template: Template, *, truth: bool) -> Part:
    """A formula that is always true, or never."""
    every = np.full(source.n_rows, groundings_of_a_row(source), np.int64)
    none = np.zeros_like(every)
    if template.hard and not truth:
        raise violated(template, "")
    return Part((), every, none, none) if truth else Part((), none, every, none)


@dataclass(frozen=True, slots=True)
class Tally:
    """What was listed so far: pieces, and for each row of the template how many groundings are true, false, open."""

    pieces: list[Piece]
    true: Int64
    false: Int64
    open: Int64


def _add(tally: Tally, source: Source, plan: Compiled, rows: Relation, groups: Sequence[Group], cut: Cut) -> None:
    """Adds groups of rows to a tally."""
    n_rows = len(next(iter(rows.values()))) if rows else 1
    for group in groups:
        n = n_rows if isinstance(group.index, slice) else len(group.index)
        row = taken(rows["row"], group.index, cut) if source.tabled else np.broadcast_to(np.int32(0), n)
        count = taken(rows["count"], group.index, cut) if plan.counted else np.broadcast_to(np.int64(1), n)
        sums = sums_by(row, count, source.n_rows)
        if isinstance(group.shape, Decided):
            decided = tally.true if group.shape.truth else tally.false
            np.add(decided, sums, out=decided)
            continue
        np.add(tally.open, sums, out=tally.open)
        tally.pieces.append(Piece(group.atoms, group.shape, row, count))


def groundings_of_a_row(source: Source) -> int:
    """Number of bindings of the free variables that are not keys."""
    sizes = [
        int(source.evidence.present[source.formula.variables[v].type].sum())
        for v in source.formula.free
        if v not in source.keys
    ]
    return prod(sizes)
