"""Model back to syntax tree, so that it can be written to a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import assert_never

import numpy as np

from mlnlite.model import formulas as typed
from mlnlite.model.model import Model
from mlnlite.model.templates import Template
from mlnlite.syntax import tree
from mlnlite.syntax.walk import map_comparison, map_terms
from mlnlite.syntax.write import write_formula, write_model


def model_text(model: Model) -> str:
    """The text of a model in its dialect; reading it gives the model back."""
    return write_model(program_of(model))


def program_of(model: Model) -> tree.Program:
    """The syntax tree of a model: types, predicates, formulas."""
    statements: list[tree.Statement] = []
    for t in model.types.values():
        if t.constants:
            statements.append(tree.TypeDeclaration(t.name, tuple(map(tree.Constant, t.constants))))
    for p in model.predicates.values():
        if p.comparison:
            continue
        arguments = (tree.Argument(name, p.marker if i == p.value else "") for i, name in enumerate(p.types))
        statements.append(tree.PredicateDeclaration(p.name, tuple(arguments), p.closed))
    for template in model.templates:
        statements += _statements(template, model)
    return tree.Program(tuple(statements), model.dialect)


def row_text(template: Template, model: Model, row: int) -> str:
    """One formula of a template, as text: its row number `row`."""
    return write_formula(row_formula(template, model, row), model.dialect)


def template_formula(template: Template, model: Model) -> tree.Formula:
    """The formula of a template, its keys as variables with `+`."""
    return _Untyper(template, model, None).formula()


def row_formula(template: Template, model: Model, row: int) -> tree.Formula:
    """One formula of a template: its row number `row`."""
    assert template.rows is not None
    holes: list[int] = []
    formula = _Untyper(template, model, holes).formula()
    constants = []
    for key in holes:
        type_name = template.formula.variables[template.keys[key]].type
        constants.append(tree.Constant(model.types[type_name].constants[template.rows[row, key]]))
    return _filled(formula, constants)


def _statements(template: Template, model: Model) -> Iterator[tree.Statement]:
    if template.rows is None:
        yield _statement(template, model)
        return
    holes: list[int] = []
    formula = _Untyper(template, model, holes).formula()
    names = [np.array(model.types[template.formula.variables[k].type].constants, object) for k in template.keys]
    columns = tuple(tuple(names[k][template.rows[:, k]].tolist()) for k in holes)
    one_by_one = template.hard or template.fixed or not template.keys or len(template.weights) == 1
    if one_by_one or np.isnan(template.weights).any():
        yield from _row_by_row(template, formula, columns)
    else:
        weights = tuple(tree.Number(w) for w in template.weights.tolist())
        yield tree.FormulaTable(formula, columns, weights)


def _statement(template: Template, model: Model) -> tree.FormulaStatement:
    names = [template.formula.variables[k].name for k in template.keys]
    unique = tuple(tuple(names[i] for i in group) for group in template.unique)
    formula = template_formula(template, model)
    if template.number is not None:
        weight = tree.NumberOf(names[template.number])
        return tree.FormulaStatement(formula, weight, fixed=True)
    return _weighted(template, formula, float(template.weights[0]), unique)


def _weighted(
    template: Template, formula: tree.Formula, weight: float, unique: tuple[tuple[str, ...], ...] = ()
) -> tree.FormulaStatement:
    number = None if np.isnan(weight) or np.isinf(weight) else tree.Number(weight)
    return tree.FormulaStatement(formula, number, bool(np.isinf(weight)), template.fixed, unique)


def _row_by_row(
    template: Template, formula: tree.Formula, columns: tuple[tuple[str, ...], ...]
) -> Iterator[tree.FormulaStatement]:
    for row, weight in enumerate(template.weights.tolist()):
        constants = [tree.Constant(column[row]) for column in columns]
        yield _weighted(template, _filled(formula, constants), weight)


def _filled(formula: tree.Formula, constants: Sequence[tree.Constant]) -> tree.Formula:
    return map_terms(formula, lambda t: constants[t.index] if isinstance(t, tree.Hole) else t)


class _Untyper:
    """Turns a typed formula back into syntax; keys become holes if `holes` is given, else `+` variables."""

    def __init__(self, template: Template, model: Model, holes: list[int] | None) -> None:
        self.template = template
        self.model = model
        self.holes = holes

    def formula(self) -> tree.Formula:
        return self._expression(self.template.formula.body)

    def _expression(self, expression: typed.Expression) -> tree.Formula:
        match expression:
            case typed.AtomRef(index):
                schema = self.template.formula.atoms[index]
                comparison = self.model.predicates[schema.predicate].comparison
                if comparison:
                    return self._comparison(comparison, schema)
                types = self.model.predicates[schema.predicate].types
                terms = tuple(self._term(a, t) for a, t in zip(schema.arguments, types, strict=True))
                return tree.Atom(schema.predicate, terms)
            case typed.Equal(left, right):
                variable = left if isinstance(left, typed.Var) else right
                assert isinstance(variable, typed.Var)
                type_name = self.template.formula.variables[variable.index].type
                return tree.Equality(self._term(left, type_name), self._term(right, type_name))
            case typed.Not(typed.Exists(variables, typed.Not(body))):
                return self._quantified("forall", variables, body)
            case typed.Not(operand):
                return tree.Not(self._expression(operand))
            case typed.All(operands):
                return tree.And(tuple(map(self._expression, operands)))
            case typed.Any((typed.Not(body), head)):
                return tree.Implies(self._expression(body), self._expression(head))
            case typed.Any(operands):
                return tree.Or(tuple(map(self._expression, operands)))
            case typed.Iff(left_side, right_side):
                return tree.Iff(self._expression(left_side), self._expression(right_side))
            case typed.Exists(variables, body):
                return self._quantified("exist", variables, body)
            case typed.Count(variables, body, low, high):
                return self._count(variables, body, low, high)
            case _:
                assert_never(expression)

    def _comparison(self, comparison: tree.Comparison, schema: typed.AtomSchema) -> tree.Formula:
        names = [self.template.formula.variables[a.index] for a in schema.arguments if isinstance(a, typed.Var)]
        indices = [a.index for a in schema.arguments if isinstance(a, typed.Var)]
        plus = [self.holes is None and i in self.template.keys and i != self._number() for i in indices]
        return map_comparison(comparison, lambda v: tree.Variable(names[int(v.name[1:])].name, plus[int(v.name[1:])]))

    def _number(self) -> int | None:
        """The variable whose number is the weight."""
        return None if self.template.number is None else self.template.keys[self.template.number]

    def _count(self, variables: tuple[int, ...], body: typed.Expression, low: int, high: int | None) -> tree.Formula:
        names = tuple(self.template.formula.variables[v].name for v in variables)
        inside = self._expression(body)
        if high is None or low == high:
            return tree.Count(names, inside, ">=" if high is None else "=", low)
        return tree.Count(names, inside, "<", high + 1) if high < 0 else tree.Count(names, inside, "<=", high)

    def _quantified(self, quantifier: str, variables: tuple[int, ...], body: typed.Expression) -> tree.Formula:
        names = tuple(self.template.formula.variables[v].name for v in variables)
        return tree.Quantified("exist" if quantifier == "exist" else "forall", names, self._expression(body))

    def _term(self, term: typed.Argument, type_name: str) -> tree.Term:
        if isinstance(term, typed.Const):
            return tree.Constant(self.model.types[type_name].constants[term.id])
        variable = self.template.formula.variables[term.index]
        if term.index not in self.template.keys:
            return tree.Variable(variable.name)
        if self.holes is None:
            return tree.Variable(variable.name, plus=term.index != self._number())
        self.holes.append(self.template.keys.index(term.index))
        return tree.Hole(len(self.holes) - 1)
