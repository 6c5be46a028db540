"""Hard upper bounds on counts as clauses, which cost pairs of constants instead of all combinations."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

from mlnlite.syntax import tree
from mlnlite.syntax.walk import map_terms, variables_of

LARGEST_BOUND = 2


def at_most_as_clauses(formula: tree.Formula) -> tree.Formula:
    """A hard formula `count(f | x) <= k`, or one that implies it, without the count, if k is small.

    `count(f(x) | x) <= 1` says the same as `x1 != x2 => !f(x1) v !f(x2)`, for all x1 and x2. (As a soft formula it does
    not: there a violated count weighs once, not once for each pair.)
    """
    if isinstance(formula, tree.Implies) and isinstance(formula.head, tree.Count):
        head = at_most_as_clauses(formula.head)
        return formula if head is formula.head else replace(formula, head=head)
    if not isinstance(formula, tree.Count) or len(formula.variables) != 1 or _binds(formula.body):
        return formula
    bound = {"<=": formula.number, "<": formula.number - 1}.get(formula.operator, LARGEST_BOUND + 1)
    if not 0 <= bound <= LARGEST_BOUND:
        return formula
    variable, taken = formula.variables[0], {v.name for v in variables_of(formula.body)}
    names = _fresh(variable, bound + 1, taken)
    copies = [_renamed(formula.body, variable, name) for name in names]
    equal = [tree.Equality(tree.Variable(a), tree.Variable(b), formula.span) for a, b in combinations(names, 2)]
    parts: tuple[tree.Formula, ...] = (*equal, *(tree.Not(copy, formula.span) for copy in copies))
    return parts[0] if len(parts) == 1 else tree.Or(parts, formula.span)


def _binds(formula: tree.Formula) -> bool:
    match formula:
        case tree.Quantified() | tree.Count():
            return True
        case tree.Not(operand):
            return _binds(operand)
        case tree.And(operands) | tree.Or(operands):
            return any(map(_binds, operands))
        case tree.Implies(left, right) | tree.Iff(left, right):
            return _binds(left) or _binds(right)
        case _:
            return False


def _fresh(variable: str, n: int, taken: set[str]) -> list[str]:
    names: list[str] = []
    i = 1
    while len(names) < n:
        if (name := f"{variable}{i}") not in taken:
            names.append(name)
        i += 1
    return names


def _renamed(formula: tree.Formula, old: str, new: str) -> tree.Formula:
    def change(term: tree.Term) -> tree.Term:
        return replace(term, name=new) if isinstance(term, tree.Variable) and term.name == old else term

    return map_terms(formula, change)
