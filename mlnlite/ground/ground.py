"""Model and evidence to network: runs the plan of each template and keeps what evidence leaves open."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import prod

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.choose import engine_for
from mlnlite.engines.plan import Column, Engine, Relation, Run
from mlnlite.errors import Contradiction, Diagnostic, LimitReached, QueryMistake
from mlnlite.ground.assemble import Part, Piece, network_of
from mlnlite.ground.compile import Compiled, Source, atom_column, bindings, column, compiled, with_atom
from mlnlite.ground.groups import Group, groups_of
from mlnlite.ground.network import Network
from mlnlite.ground.residual import Decided
from mlnlite.ground.tables import completed, tables_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import All, Any, AtomRef, Equal, Expression, Iff, Not
from mlnlite.model.model import Model
from mlnlite.model.propositional import Cube, cubes, without_quantifiers
from mlnlite.model.templates import Template

Int64 = NDArray[np.int64]


def ground(model: Model, evidence: Evidence, *, query: Int64 | None = None, engine: Engine | None = None) -> Network:
    """The network of a model given evidence.

    Args:
        model: the templates.
        evidence: one database.
        query: numbers of atoms that must be in the network even if no factor touches them (known ones are left out).
        engine: what runs the plans; by default chosen by the size of the input.

    Raises:
        QueryMistake: if the evidence has several databases, or a formula has no weight.
        Contradiction: if evidence makes a hard formula false.
        LimitReached: if a ground formula has no sensible representation.
    """
    if evidence.n_databases != 1:
        hint = "choose one of them: `one_database(evidence, 0)`, or `--database 1` on the command line"
        raise QueryMistake(f"the evidence has {evidence.n_databases} databases, and a question is about one", hint)
    _verify_weights(model)
    evidence = completed(evidence)
    model = replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))
    tables = {**tables_of(evidence), **row_tables(model)}
    run = (engine or engine_for(tables)).load(tables)
    parts = [_grounded(source_of(i, t, evidence), t, run) for i, t in enumerate(model.templates)]
    return network_of(model, evidence, parts, query)


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
    constants = {name: np.flatnonzero(p.any(axis=0)).tolist() for name, p in evidence.present.items()}
    formula = without_quantifiers(template.formula, constants)
    assert template.rows is not None
    return Source(formula, evidence, template.keys, f"rows:{index}", len(template.rows), world)


def _grounded(source: Source, template: Template, run: Run) -> Part:
    body = source.formula.body
    false, true = cubes(body, False), cubes(body, True)
    lists_true = len(true) < len(false)
    if not (false and true):
        return _constant(source, template, truth=bool(true))
    plan = compiled(source, true if lists_true else false, tuple(dict.fromkeys(_equalities(body))))
    rows = run(plan.plan)
    try:
        groups = groups_of(source.formula, plan, rows)
    except LimitReached as error:
        cause = error.diagnostics[0]
        message = f"{template.name} cannot be grounded: {cause.message}"
        raise LimitReached([Diagnostic("E402", message, template.span, cause.hint)]) from error
    part = _part(source, plan, rows, groups, lists_true=lists_true)
    if template.hard and (part.decided_false > 0).any():
        raise _violated(template, violation(source, false, run))
    return part


def _violated(template: Template, where: str) -> Contradiction:
    hint = "one of the two is wrong: change the facts, or give the formula a weight"
    message = f"the evidence makes {template.name} false, which is hard: {template.text}{where}"
    return Contradiction([Diagnostic("E403", message, template.span, hint)])


def violation(source: Source, false: Sequence[Cube], run: Run) -> str:
    """A binding for which evidence makes a formula false, as text: ` (x = Anna)`."""
    for cube in false:
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
    every = np.full(source.n_rows, _groundings_of_a_row(source), np.int64)
    none = np.zeros_like(every)
    if template.hard and not truth:
        raise _violated(template, "")
    return Part((), every, none) if truth else Part((), none, every)


def _equalities(expression: Expression) -> Iterator[Equal]:
    match expression:
        case Equal():
            yield expression
        case Not(operand):
            yield from _equalities(operand)
        case All(operands) | Any(operands):
            for operand in operands:
                yield from _equalities(operand)
        case Iff(left, right):
            yield from _equalities(left)
            yield from _equalities(right)


def _part(source: Source, plan: Compiled, rows: Relation, groups: list[Group], *, lists_true: bool) -> Part:
    """The pieces of a template, and how many groundings of each of its rows evidence decides."""
    n_rows = len(next(iter(rows.values()))) if rows else 1
    row = rows["row"] if source.tabled else np.zeros(n_rows, np.int64)
    count = rows["count"] if plan.counted else np.ones(n_rows, np.int64)
    total = np.full(source.n_rows, _groundings_of_a_row(source), np.int64)
    listed = {True: np.zeros(source.n_rows, np.int64), False: np.zeros(source.n_rows, np.int64)}
    open_ = np.zeros(source.n_rows, np.int64)
    pieces = []
    for group in groups:
        sums = np.bincount(row[group.index], count[group.index], source.n_rows).astype(np.int64)
        if isinstance(group.shape, Decided):
            listed[group.shape.truth] += sums
            continue
        open_ += sums
        atoms: Int64 = np.column_stack([rows[atom_column(i)][group.index] for i in group.shape.atoms])
        pieces.append(Piece(atoms, group.shape, row[group.index], count[group.index]))
    if lists_true:
        decided_true, decided_false = listed[True], total - open_ - listed[True]
    else:
        decided_true, decided_false = total - open_ - listed[False], listed[False]
    return Part(tuple(pieces), decided_true, decided_false)


def _groundings_of_a_row(source: Source) -> int:
    """Number of bindings of the free variables that are not keys."""
    sizes = [
        int(source.evidence.present[source.formula.variables[v].type].sum())
        for v in source.formula.free
        if v not in source.keys
    ]
    return prod(sizes)
