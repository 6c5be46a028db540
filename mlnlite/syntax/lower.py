"""From what was written to what it means: raw nodes of a statement become formulas of the tree.

A term that is not a variable or a constant (`P(t + 1)`, `P(motherOf(x))`) becomes a variable `u` with a condition
(`u = t + 1`, `motherOf(x, u)`). The condition joins the formula that binds the term's variables: with `^` where the
formula is soft, so that a grounding counts as true only if the term has a value, and with `=>` where it is hard, so
that one without a value forbids nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Span
from mlnlite.syntax import raw, tree
from mlnlite.syntax.messages import mistake

MOST_COPIES = 256


def statements_of(statement: Any) -> list[tree.FormulaStatement]:  # noqa: ANN401
    """The statements that a statement with raw nodes means: one, unless it has `*P(x)` or `p|q(x)`.

    Raises:
        SyntaxMistake: it means too many.
    """
    copies = list(_copies(statement.formula, statement.span))
    return [replace(statement, formula=without_functions(f, hard=statement.hard)) for f in copies]


def _copies(formula: Any, span: Span) -> Iterator[Any]:  # noqa: ANN401
    found: list[Any] = [formula]
    while (choice := _first_choice(found[0])) is not None:
        options = _options(choice)
        if len(found) * len(options) > MOST_COPIES:
            raise SyntaxMistake([mistake("E152", span, "write fewer of them", limit=MOST_COPIES)])
        # equal choices at other places are other choices: only the first one is replaced
        found = [_replaced(f, _first_choice(f), option) for f in found for option in _options(_first_choice(f))]
    yield from found


def _options(choice: Any) -> list[Any]:  # noqa: ANN401
    if isinstance(choice, raw.Both):
        return [choice.atom, tree.Not(choice.atom, choice.span)]
    return [tree.Atom(name, choice.arguments, choice.span) for name in choice.predicates]


def _first_choice(formula: Any) -> Any:  # noqa: ANN401
    if isinstance(formula, raw.Both | raw.Group):
        return formula
    return next((c for part in parts(formula) if (c := _first_choice(part)) is not None), None)


def _replaced(formula: Any, old: Any, new: Any) -> Any:  # noqa: ANN401
    return new if formula is old else with_parts(formula, [_replaced(p, old, new) for p in parts(formula)])


def parts(formula: Any) -> list[Any]:  # noqa: ANN401
    """The formulas right inside a formula."""
    match formula:
        case tree.Not(operand):
            return [operand]
        case tree.And(operands) | tree.Or(operands):
            return list(operands)
        case tree.Implies(left, right) | tree.Iff(left, right):
            return [left, right]
        case tree.Quantified() | tree.Count():
            return [formula.body]
    return []


def with_parts(formula: Any, new: list[Any]) -> Any:  # noqa: ANN401
    """The formula with others in place of its `parts`."""
    match formula:
        case tree.Not():
            return replace(formula, operand=new[0])
        case tree.And() | tree.Or():
            return replace(formula, operands=tuple(new))
        case tree.Implies():
            return replace(formula, body=new[0], head=new[1])
        case tree.Iff():
            return replace(formula, left=new[0], right=new[1])
        case tree.Quantified() | tree.Count():
            return replace(formula, body=new[0])
    return formula


# --- functions and arithmetic in arguments


@dataclass(slots=True)
class _Lifting:
    """Conditions that wait for the formula that binds their variables, and names for new variables."""

    taken: set[str]
    conditions: list[tuple[str, tree.Formula]] = field(default_factory=list)

    def fresh(self) -> str:
        """A variable that no one uses."""
        name = next(n for i in count(1) if (n := f"u{i}") not in self.taken)
        self.taken.add(name)
        return name


def without_functions(formula: Any, *, hard: bool) -> tree.Formula:  # noqa: ANN401
    """The formula with variables and conditions in place of values of functions and of arithmetic."""
    lifting = _Lifting(set(names_of(formula)))
    inside: tree.Formula = _lifted(formula, lifting)
    conditions = tuple(c for _, c in lifting.conditions)
    if not conditions:
        return inside
    if hard:
        body = conditions[0] if len(conditions) == 1 else tree.And(conditions, formula.span)
        return tree.Implies(body, inside, formula.span)
    return tree.And((*conditions, inside), formula.span)


def _lifted(formula: Any, lifting: _Lifting) -> Any:  # noqa: ANN401
    match formula:
        case tree.Atom():
            return replace(formula, arguments=tuple(_variable(a, lifting) for a in formula.arguments))
        case tree.Equality() | tree.Comparison():
            return _lifted_equality(formula, lifting)
        case tree.Quantified() | tree.Count():
            return _lifted_quantifier(formula, lifting)
    return with_parts(formula, [_lifted(part, lifting) for part in parts(formula)])


def _lifted_equality(formula: tree.Equality | tree.Comparison, lifting: _Lifting) -> tree.Formula:
    left, right = formula.left, formula.right
    if isinstance(formula, tree.Equality):
        for a, b in ((left, right), (right, left)):
            if isinstance(a, raw.Apply) and not isinstance(b, raw.Apply):
                arguments = (*(_variable(x, lifting) for x in a.arguments), b)
                return tree.Atom(a.function, arguments, formula.span)
    return replace(formula, left=_operand(left, lifting), right=_operand(right, lifting))


def _operand(term: Any, lifting: _Lifting) -> Any:  # noqa: ANN401
    """A side of a comparison: arithmetic stays, values of functions become variables."""
    if isinstance(term, tree.Operation):
        return replace(term, left=_operand(term.left, lifting), right=_operand(term.right, lifting))
    return _variable(term, lifting)


def _variable(term: Any, lifting: _Lifting) -> tree.Term:  # noqa: ANN401
    if isinstance(term, tree.Variable | tree.Constant | tree.Hole):
        return term
    name = lifting.fresh()
    variable = tree.Variable(name, False, term.span)
    condition: tree.Formula
    if isinstance(term, raw.Apply):
        arguments = tuple(_variable(a, lifting) for a in term.arguments)
        condition = tree.Atom(term.function, (*arguments, variable), term.span)
    else:
        condition = tree.Comparison("=", variable, _operand(term, lifting), term.span)
    lifting.conditions.append((name, condition))
    return variable


def _lifted_quantifier(formula: Any, lifting: _Lifting) -> Any:  # noqa: ANN401
    outer = lifting.conditions
    lifting.conditions = []
    body = _lifted(formula.body, lifting)
    bound, mine = set(formula.variables), []
    for name, condition in lifting.conditions:
        if bound & set(names_of(condition)):
            bound.add(name)
            mine.append((name, condition))
        else:
            outer.append((name, condition))
    lifting.conditions = outer
    if not mine:
        return replace(formula, body=body)
    if isinstance(formula, tree.Count):
        hint = "write the value as a variable that is bound by EXIST inside"
        raise SyntaxMistake([mistake("E110", formula.span, hint, construct="a function or arithmetic inside `count`")])
    conditions = tuple(condition for _, condition in mine)
    variables = (*formula.variables, *(name for name, _ in mine))
    if formula.quantifier == "exist":
        return replace(formula, variables=variables, body=tree.And((*conditions, body), formula.span))
    all_of = conditions[0] if len(conditions) == 1 else tree.And(conditions, formula.span)
    return replace(formula, variables=variables, body=tree.Implies(all_of, body, formula.span))


def predicates_of(formula: Any) -> Iterator[str]:  # noqa: ANN401
    """The predicates of a formula with raw nodes."""
    match formula:
        case tree.Atom(predicate):
            yield predicate
        case raw.Both(atom):
            yield atom.predicate
        case raw.Group(predicates):
            yield from predicates
        case _:
            for part in parts(formula):
                yield from predicates_of(part)


def names_of(node: Any) -> Iterator[str]:  # noqa: ANN401
    """The variables of a formula or a term, raw ones included."""
    match node:
        case tree.Variable(name):
            yield name
        case tree.Atom() | raw.Apply() | raw.Group():
            for argument in node.arguments:
                yield from names_of(argument)
        case raw.Both(atom):
            yield from names_of(atom)
        case tree.Equality() | tree.Comparison() | tree.Operation():
            yield from names_of(node.left)
            yield from names_of(node.right)
        case tree.Quantified() | tree.Count():
            yield from node.variables
            yield from names_of(node.body)
        case _:
            for part in parts(node):
                yield from names_of(part)
