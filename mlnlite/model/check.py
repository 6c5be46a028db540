"""Checks a syntax tree and makes a `Model` of it. Program in, Model out, or all mistakes at once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np

from mlnlite.errors import Diagnostic, ModelMistake, did_you_mean, in_order
from mlnlite.model.cardinality import at_most_as_clauses
from mlnlite.model.formulas import Formula
from mlnlite.model.model import Model
from mlnlite.model.symbols import Predicate, Type
from mlnlite.model.templates import Template
from mlnlite.model.typing import Constants, FormulaTyper, atoms_of
from mlnlite.model.weights import checked_weight
from mlnlite.syntax import tree
from mlnlite.syntax.walk import map_terms
from mlnlite.syntax.write import write_formula


@dataclass(slots=True)
class _Check:
    """What is known so far; grows statement by statement."""

    dialect: tree.Dialect
    predicates: dict[str, Predicate] = field(default_factory=dict)
    constants: Constants = field(default_factory=Constants)
    declared: dict[str, tree.TypeDeclaration] = field(default_factory=dict)
    comparisons: dict[str, Predicate] = field(default_factory=dict)
    sized: set[str] = field(default_factory=set)
    templates: list[Template] = field(default_factory=list)
    used: Counter[str] = field(default_factory=Counter)
    mistakes: list[Diagnostic] = field(default_factory=list)
    warnings: list[Diagnostic] = field(default_factory=list)


def check(program: tree.Program) -> Model:
    """The model that a program means.

    Raises:
        ModelMistake: with every mistake of the program.
    """
    state = _Check(program.dialect)
    statements = list(_flattened(program))
    for statement in statements:
        if isinstance(statement, tree.TypeDeclaration):
            _check_type(statement, state)
        elif isinstance(statement, tree.PredicateDeclaration):
            _check_predicate(statement, state)
    for statement in statements:
        if isinstance(statement, tree.FormulaStatement):
            _check_formula(statement, state)
        elif isinstance(statement, tree.FormulaTable):
            _check_table(statement, state)
    if not state.predicates and not state.mistakes:
        state.mistakes.append(_nothing_declared(program))
    if state.mistakes:
        raise ModelMistake(in_order(state.mistakes))
    _warn(state)
    predicates = state.predicates | state.comparisons
    templates, warnings = tuple(state.templates), tuple(state.warnings)
    return Model(
        _types(state), predicates, templates, program.dialect, warnings, frozenset(state.sized), program.origin
    )


def _nothing_declared(program: tree.Program) -> Diagnostic:
    hint = "declare at least one, like `Smokes(person)`"
    return Diagnostic("E200", "the model declares no predicate", program.span, hint)


def _flattened(program: tree.Program) -> Iterator[tree.Statement]:
    for statement in program.statements:
        if isinstance(statement, tree.Include):
            yield from _flattened(statement.program)
        else:
            yield statement


def _types(state: _Check) -> dict[str, Type]:
    names = dict.fromkeys(chain(state.declared, *(p.types for p in state.predicates.values())))
    return {name: Type(name, tuple(state.constants.ids.get(name, ()))) for name in names}


# --- declarations


def _check_type(statement: tree.TypeDeclaration, state: _Check) -> None:
    seen: set[str] = set()
    for constant in statement.constants:
        if constant.name in seen:
            message = f"the constant {constant.name} stands twice in the type {statement.name}"
            state.warnings.append(Diagnostic("W201", message, constant.span, "remove one", "warning"))
        seen.add(constant.name)
        state.constants.id(statement.name, constant.name)
    state.declared.setdefault(statement.name, statement)


def _check_predicate(statement: tree.PredicateDeclaration, state: _Check) -> None:
    marked = [i for i, a in enumerate(statement.arguments) if a.marker]
    if len(marked) > 1:
        hint = "mark the one argument whose values exclude each other"
        message = f"{statement.name} has {len(marked)} arguments marked ! or ?; one is possible"
        state.mistakes.append(Diagnostic("E207", message, statement.arguments[marked[1]].span or statement.span, hint))
    predicate = Predicate(
        statement.name,
        tuple(a.type for a in statement.arguments),
        marked[0] if marked else None,
        statement.arguments[marked[0]].marker if marked else "",
        statement.closed,
        statement.span,
    )
    earlier = state.predicates.setdefault(statement.name, predicate)
    if earlier != predicate:
        place = f" at {earlier.span.place}" if earlier.span else ""
        message = f"{statement.name} is declared again in another way: {predicate}"
        state.mistakes.append(
            Diagnostic("E201", message, statement.span, f"it was declared as {earlier}{place}", expected=str(earlier))
        )


# --- formulas


def _check_formula(statement: tree.FormulaStatement, state: _Check) -> None:
    typer = FormulaTyper(state.predicates, state.constants, state.mistakes, comparisons=state.comparisons)
    formula = typer.typed(at_most_as_clauses(statement.formula) if statement.hard else statement.formula)
    number = statement.weight if isinstance(statement.weight, tree.NumberOf) else None
    weight = np.inf if statement.hard else 0.0 if number else np.nan
    if statement.weight is not None and number is None:
        weight = checked_weight(_sized(statement.weight, state), statement.span, state.mistakes)
    if formula is None:
        return
    state.used.update(a.predicate for a in atoms_of(statement.formula))
    keys = typer.keys()
    if number:
        keys = _with_number(number, formula, keys, state)
    template = Template(
        name=f"formula {len(state.templates) + 1}",
        formula=formula,
        keys=keys,
        rows=None if keys else np.zeros((1, 0), np.int32),
        weights=np.array([weight]),
        fixed=statement.fixed,
        unique=_unique(statement, formula, keys, state),
        number=_place_of(number, formula, keys),
        text=write_formula(statement.formula, state.dialect),
        span=statement.span,
    )
    state.templates.append(template)


def _place_of(number: tree.NumberOf | None, formula: Formula, keys: tuple[int, ...]) -> int | None:
    return next((i for i, k in enumerate(keys) if number and formula.variables[k].name == number.variable), None)


def _sized(weight: tree.WeightExpression, state: _Check) -> tree.WeightExpression:
    """The weight with the sizes of types put in."""
    match weight:
        case tree.Size(name):
            if not state.constants.ids.get(name):
                message = f"domSize({name}) needs the constants of {name}, and the model does not declare them"
                state.mistakes.append(Diagnostic("E222", message, weight.span, f"declare them: {name} = {{...}}"))
                return tree.Number(1.0, weight.span)
            state.sized.add(name)
            return tree.Number(float(len(state.constants.ids[name])), weight.span)
        case tree.Call():
            return replace(weight, arguments=tuple(_sized(a, state) for a in weight.arguments))
        case tree.Arithmetic():
            left = None if weight.left is None else _sized(weight.left, state)
            return replace(weight, left=left, right=_sized(weight.right, state))
        case tree.Number() | tree.NumberOf():
            return weight


def _with_number(number: tree.NumberOf, formula: Formula, keys: tuple[int, ...], state: _Check) -> tuple[int, ...]:
    """The keys with the variable whose number is the weight."""
    free = {formula.variables[i].name: i for i in formula.free}
    if number.variable not in free:
        hint = did_you_mean(number.variable, list(free))
        message = f"the weight is the number of {number.variable}, which is not a free variable of the formula"
        state.mistakes.append(Diagnostic("E211", message, number.span, hint))
        return keys
    return tuple(sorted({*keys, free[number.variable]}))


def _unique(
    statement: tree.FormulaStatement, formula: Formula, keys: tuple[int, ...], state: _Check
) -> tuple[tuple[int, ...], ...]:
    """The groups of `#unique` as positions in `keys`, split by type: order only means something within one type."""
    position = {formula.variables[k].name: i for i, k in enumerate(keys)}
    groups: list[tuple[int, ...]] = []
    for names in statement.unique:
        for name in names:
            if name not in position:
                message = f"#unique names +{name}, which is not a + variable of the formula after it"
                hint = did_you_mean(name, list(position))
                state.mistakes.append(Diagnostic("E209", message, statement.span, hint))
        by_type: dict[str, list[int]] = {}
        for i in sorted(position[name] for name in names if name in position):
            by_type.setdefault(formula.variables[keys[i]].type, []).append(i)
        groups += [tuple(group) for group in by_type.values() if len(group) > 1]
    return tuple(groups)


def _check_table(statement: tree.FormulaTable, state: _Check) -> None:
    typer = FormulaTyper(state.predicates, state.constants, state.mistakes, comparisons=state.comparisons)
    formula = typer.typed(statement.formula)
    cache: dict[tree.WeightExpression, float] = {}
    for row, weight in enumerate(statement.weights):
        if weight not in cache:
            span = statement.spans[row] if statement.spans else statement.span
            cache[weight] = checked_weight(_sized(weight, state), span, state.mistakes)
    if formula is None:
        return
    n_rows = len(statement.weights)
    state.used.update({a.predicate: n_rows for a in atoms_of(statement.formula)})
    keys = tuple(typer.holes[i] for i in range(len(statement.columns)))
    rows = np.empty((n_rows, len(keys)), np.int32)
    for i, (key, column) in enumerate(zip(keys, statement.columns, strict=True)):
        rows[:, i] = _ids(column, formula.variables[key].type, state.constants)
    named, text = _named(statement, formula, keys, state.dialect)
    template = Template(
        name=f"formula {len(state.templates) + 1}",
        formula=named,
        keys=keys,
        rows=rows,
        weights=np.array([cache[w] for w in statement.weights]),
        text=text,
        span=statement.span,
        row_spans=statement.spans,
    )
    state.templates.append(template)


def _ids(column: tuple[str, ...], type_name: str, constants: Constants) -> list[int]:
    known = {name: constants.id(type_name, name) for name in dict.fromkeys(column)}
    return [known[name] for name in column]


def _named(
    statement: tree.FormulaTable, formula: Formula, keys: tuple[int, ...], dialect: tree.Dialect
) -> tuple[Formula, str]:
    """Gives holes the names of their types, in the typed formula and in its text."""
    taken = {v.name for i, v in enumerate(formula.variables) if i not in keys}
    variables, names = list(formula.variables), {}
    for hole, key in enumerate(keys):
        base = variables[key].type
        name = next(n for n in chain([base], (f"{base}{i}" for i in range(2, 10**9))) if n not in taken)
        taken.add(name)
        names[hole] = name
        variables[key] = replace(variables[key], name=name)
    filled = map_terms(
        statement.formula, lambda t: tree.Variable(names[t.index], plus=True) if isinstance(t, tree.Hole) else t
    )
    return replace(formula, variables=tuple(variables)), write_formula(filled, dialect)


# --- warnings


def _warn(state: _Check) -> None:
    for predicate in state.predicates.values():
        if not state.used[predicate.name]:
            message = f"the predicate {predicate.name} is declared and stands in no formula"
            state.warnings.append(Diagnostic("W202", message, predicate.span, "", "warning"))
    types_used = {t for p in state.predicates.values() for t in p.types}
    for name, declaration in state.declared.items():
        if name not in types_used:
            hint = did_you_mean(name, sorted(types_used))
            message = f"the type {name} has constants and no predicate uses it"
            state.warnings.append(Diagnostic("W203", message, declaration.span, hint, "warning"))
    _warn_of_strangers(state)


def _warn_of_strangers(state: _Check) -> None:
    """A constant that is not among the declared ones of its type, but nearly: probably misspelt."""
    for name, declaration in state.declared.items():
        declared = {c.name for c in declaration.constants}
        for constant in state.constants.ids.get(name, ()):
            hint = "" if constant in declared else did_you_mean(constant, sorted(declared))
            if hint:
                message = f"{constant} is not among the declared constants of the type {name}"
                state.warnings.append(Diagnostic("W204", message, declaration.span, hint, "warning"))
