"""Going through formulas: their terms in the order in which they stand, and holes in place of constants."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count

from mlnlite.syntax import tree


def terms_of(formula: tree.Formula) -> Iterator[tree.Term]:
    """The terms of a formula, from left to right."""
    stack: list[tree.Formula] = [formula]
    while stack:
        node = stack.pop()
        match node:
            case tree.Atom():
                yield from node.arguments
            case tree.Equality():
                yield node.left
                yield node.right
            case tree.Comparison():
                yield from comparison_variables(node)
            case tree.Not():
                stack.append(node.operand)
            case tree.And() | tree.Or():
                stack.extend(reversed(node.operands))
            case tree.Implies():
                stack += (node.head, node.body)
            case tree.Iff():
                stack += (node.right, node.left)
            case tree.Quantified() | tree.Count():
                stack.append(node.body)


def comparison_variables(node: tree.Comparison | tree.TermExpression) -> Iterator[tree.Variable]:
    """The variables of a comparison, from left to right. Its constants are part of its shape, never holes."""
    if isinstance(node, tree.Variable):
        yield node
    elif isinstance(node, tree.Comparison | tree.Operation):
        yield from comparison_variables(node.left)
        yield from comparison_variables(node.right)


def map_comparison(node: tree.Comparison, change: Callable[[tree.Variable], tree.Term]) -> tree.Comparison:
    """The comparison with its variables changed."""

    def side(term: tree.TermExpression) -> tree.TermExpression:
        if isinstance(term, tree.Operation):
            return replace(term, left=side(term.left), right=side(term.right))
        new = change(term) if isinstance(term, tree.Variable) else term
        assert not isinstance(new, tree.Hole)
        return new

    return replace(node, left=side(node.left), right=side(node.right))


def constants_of(formula: tree.Formula) -> list[tree.Constant]:
    """The constants of a formula, from left to right, as often as they stand there."""
    return [term for term in terms_of(formula) if isinstance(term, tree.Constant)]


def variables_of(formula: tree.Formula) -> list[tree.Variable]:
    """The variables that stand as terms in a formula, from left to right."""
    return [term for term in terms_of(formula) if isinstance(term, tree.Variable)]


def with_holes(formula: tree.Formula) -> tree.Formula:
    """The formula with `Hole(0)`, `Hole(1)`, ... in place of its constants.

    >>> with_holes(tree.Atom("P", (tree.Constant("A"), tree.Variable("x"), tree.Constant("A")))).arguments
    (Hole(index=0), Variable(name='x', plus=False), Hole(index=1))
    """
    numbers = count()
    return map_terms(formula, lambda t: tree.Hole(next(numbers), t.span) if isinstance(t, tree.Constant) else t)


def map_terms(formula: tree.Formula, change: Callable[[tree.Term], tree.Term]) -> tree.Formula:
    """The formula with every term changed, from left to right."""

    def walk(node: tree.Formula) -> tree.Formula:
        match node:
            case tree.Atom():
                return replace(node, arguments=tuple(map(change, node.arguments)))
            case tree.Equality():
                return replace(node, left=change(node.left), right=change(node.right))
            case tree.Not():
                return replace(node, operand=walk(node.operand))
            case tree.And() | tree.Or():
                return replace(node, operands=tuple(map(walk, node.operands)))
            case tree.Implies():
                return replace(node, body=walk(node.body), head=walk(node.head))
            case tree.Iff():
                return replace(node, left=walk(node.left), right=walk(node.right))
            case tree.Quantified() | tree.Count():
                return replace(node, body=walk(node.body))
            case tree.Comparison():
                return map_comparison(node, change)

    return walk(formula)
