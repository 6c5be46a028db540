"""One builder for each rule of the grammars: the parts of a rule go in, a node of the tree comes out."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Span
from mlnlite.syntax import raw, tree
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.nesting import refuse_long_expression
from mlnlite.syntax.place import Place

# Children are finished nodes and tokens; a token is a string with a `type` and a `start_pos` in the statement.
Children = list[Any]

_VARIABLE = re.compile(r"_*[^\W\d_][\w']*|_+")


@dataclass(frozen=True, slots=True)
class Weight:
    """A weight in front of a formula; `fixed` if it was written with `@`."""

    value: tree.WeightExpression
    fixed: bool
    span: Span


@dataclass(frozen=True, slots=True)
class Fact:
    """One fact; `truth` is the number in front of it, if any; `unknown` if it has a question mark instead."""

    predicate: str
    arguments: tuple[str, ...]
    positive: bool
    truth: float | None
    span: Span
    unknown: bool = False


def unquote(text: str) -> str:
    r"""The text of a quoted constant: `\"` and `\\` stand for a quote and a backslash.

    >>> print(unquote('"a \\"b\\" c"'))
    a "b" c
    """
    return re.sub(r'\\(["\\])', r"\1", text[1:-1])


def is_variable(word: str) -> bool:
    """Whether the standard dialect takes a word for a variable: its first letter is lower case.

    >>> is_variable("x"), is_variable("Anna"), is_variable("3-2")
    (True, False, False)
    """
    return word.lstrip("_")[:1].islower() or not word.strip("_")


# --- terms


def _standard_term(place: Place, span: Span, children: Children) -> tree.Term:
    token, plus = children[-1], len(children) > 1
    if token.type == "STRING" or not is_variable(token):
        if plus:
            raise SyntaxMistake(
                [mistake("E125", span, "`+` stands before a variable, which starts in lower case", name=str(token))]
            )
        return tree.Constant(unquote(token) if token.type == "STRING" else str(token), span)
    if not _VARIABLE.fullmatch(token):
        hint = f'a variable has only letters, digits and _; write "{token}" in quotes if it is a constant'
        raise SyntaxMistake([mistake("E124", place.token(token), hint, found=str(token))])
    return tree.Variable(str(token), plus, span)


def _prac_term(place: Place, span: Span, children: Children) -> tree.Term:
    token = children[-1]
    if token.type == "VARIABLE":
        return tree.Variable(token[1:], len(children) > 1, span)
    return tree.Constant(unquote(token) if token.type == "STRING" else str(token), span)


def _constant(place: Place, span: Span, children: Children) -> tree.Constant:
    token = children[0]
    return tree.Constant(unquote(token) if token.type == "STRING" else str(token), span)


# --- formulas


def _nodes(children: Children) -> Children:
    return [child for child in children if not isinstance(child, str)]


def _atom(place: Place, span: Span, children: Children) -> tree.Atom:
    return tree.Atom(str(children[0]), tuple(_nodes(children)), span)


def _equality(place: Place, span: Span, children: Children) -> tree.Formula:
    """Terms that are the same constant; or numbers that compare, if there is arithmetic or an order."""
    left, right = _nodes(children)
    sign = next(str(c) for c in children if isinstance(c, str) and c not in ("(", ")", "+"))
    sign = "!=" if sign in ("=/=", "<>") else sign
    if sign in ("=", "!=") and not any(isinstance(side, tree.Operation) for side in (left, right)):
        equality = tree.Equality(left, right, span)
        return tree.Not(equality, span) if sign == "!=" else equality
    return tree.Comparison(sign, left, right, span)


def _operation(place: Place, span: Span, children: Children) -> tree.Operation:
    left, operator, right = children
    operation = tree.Operation(str(operator), left, right, span)
    refuse_long_expression(operation)
    return operation


def _both(place: Place, span: Span, children: Children) -> raw.Both:
    return raw.Both(tree.Atom(str(children[1]), tuple(_nodes(children)), span), span)


def _group(place: Place, span: Span, children: Children) -> raw.Group:
    names = tuple(name.strip() for name in str(children[0]).split("|"))
    return raw.Group(names, tuple(_nodes(children)), span)


def _count(place: Place, span: Span, children: Children) -> tree.Count:
    body, variables = _nodes(children)
    sign, number = str(children[-2]), children[-1]
    if not number.isdigit():
        hint = "write how many, like `count(P(x) | x) <= 2`"
        raise SyntaxMistake([mistake("E101", place.token(number), hint, found=f"`{number}`", expected="a number")])
    return tree.Count(variables, body, "!=" if sign == "=/=" else sign, int(number), span)


def _negation(place: Place, span: Span, children: Children) -> tree.Not:
    return tree.Not(children[-1], span)


def _conjunction(place: Place, span: Span, children: Children) -> tree.And:
    return tree.And(tuple(_nodes(children)), span)


def _disjunction(place: Place, span: Span, children: Children) -> tree.Or:
    return tree.Or(tuple(_nodes(children)), span)


def _implies(place: Place, span: Span, children: Children) -> tree.Implies:
    return tree.Implies(children[0], children[-1], span)


def _iff(place: Place, span: Span, children: Children) -> tree.Iff:
    return tree.Iff(children[0], children[-1], span)


def _variables(place: Place, span: Span, children: Children) -> tuple[str, ...]:
    words = [c for c in children if c != ","]
    for word in words:
        if word.type == "NAME" and not (is_variable(word) and _VARIABLE.fullmatch(word)):
            hint = "a variable starts with a lower-case letter"
            raise SyntaxMistake([mistake("E101", place.token(word), hint, found=f"`{word}`", expected="a variable")])
    return tuple(str(word).removeprefix("?") for word in words)


def _quantified(place: Place, span: Span, children: Children) -> tree.Quantified:
    variables, body = _nodes(children)
    return tree.Quantified("forall" if children[0].lower() == "forall" else "exist", variables, body, span)


def _parentheses(place: Place, span: Span, children: Children) -> Any:  # noqa: ANN401
    inner = children[1]
    return replace(inner, span=span) if isinstance(inner, tree.WeightExpression) else inner


# --- weights


def _number(place: Place, span: Span, children: Children) -> tree.Number:
    value = float(children[0])
    if math.isinf(value) and children[0] != "inf":
        raise SyntaxMistake([mistake("E123", span, "write `inf` for an infinite weight", found=str(children[0]))])
    return tree.Number(value, span)


def _binary(place: Place, span: Span, children: Children) -> tree.Arithmetic:
    left, operator, right = children
    return tree.Arithmetic(str(operator), left, right, span)


def _negative(place: Place, span: Span, children: Children) -> tree.WeightExpression:
    operand = children[1]
    if isinstance(operand, tree.Number) and operand.value >= 0 and not operand.span.text.startswith("("):  # type: ignore[union-attr]
        return tree.Number(-operand.value, span)
    return tree.Arithmetic("-", None, operand, span)


def _positive(place: Place, span: Span, children: Children) -> tree.WeightExpression:
    return children[1]  # type: ignore[no-any-return]


def _call(place: Place, span: Span, children: Children) -> tree.Call:
    return tree.Call(str(children[0]), tuple(_nodes(children)), span)


def _size(place: Place, span: Span, children: Children) -> tree.Size:
    return tree.Size(str(children[2]), span)


def _macro(place: Place, span: Span, children: Children) -> raw.Macro:
    return raw.Macro(str(children[0]), span)


def _macro_definition(place: Place, span: Span, children: Children) -> raw.Definition:
    return raw.Definition(str(children[0]), children[-1], span)


def _probability(place: Place, span: Span, children: Children) -> Weight:
    """The log-odds: with this weight alone, the formula has this probability whenever its body holds."""
    value = float(children[1])
    if not 0 < value < 1:
        hint = "a probability lies between 0 and 1; write a final dot for what is certain"
        raise SyntaxMistake([mistake("E129", span, hint, found=str(children[1]))])
    return Weight(tree.Call("logit", (tree.Number(value, span),), span), False, span)


def _number_of(place: Place, span: Span, children: Children) -> Weight:
    return Weight(tree.NumberOf(str(children[0]).removeprefix("?"), span), True, span)


def _weight(place: Place, span: Span, children: Children) -> Weight:
    refuse_long_expression(children[-1])
    return Weight(children[-1], len(children) > 1, span)


# --- statements


def statement(place: Place, span: Span, children: Children) -> tree.FormulaStatement:
    """A formula with its weight; the formula may still have raw nodes."""
    hard = isinstance(children[-1], str)
    weight = children[0] if isinstance(children[0], Weight) else None
    formula = next(c for c in children if not isinstance(c, Weight | str))
    if weight and hard:
        hint = "drop the weight, or drop the final dot"
        raise SyntaxMistake([mistake("E107", weight.span, hint)])
    if weight and weight.span.text[-1] != ":" and not place.source.text[weight.span.end].isspace():
        hint = f"put a space after it: `{weight.span.text} {_begin(place.source.text[weight.span.end : span.end])}`"
        raise SyntaxMistake([mistake("E108", weight.span, hint, number=weight.span.text)])
    if weight is None:
        return tree.FormulaStatement(formula, None, hard, span=span)
    return tree.FormulaStatement(formula, weight.value, False, weight.fixed, span=span)


def _begin(text: str) -> str:
    return text if len(text) <= 20 else text[:20] + "..."


def _declaration(place: Place, span: Span, children: Children) -> tree.PredicateDeclaration:
    closed = children[0] == "*"
    name = next(c for c in children if c != "*")
    if name.lower() in ("exist", "exists", "forall"):
        hint = f"write `{name.upper()} x (...)`; a predicate cannot have this name"
        raise SyntaxMistake([mistake("E127", place.token(name), hint, quantifier=name)])
    return tree.PredicateDeclaration(str(name), tuple(_nodes(children)), closed, span)


def _argument(place: Place, span: Span, children: Children) -> tree.Argument:
    marker: Any = str(children[-1]) if children[-1] in ("!", "?") else ""
    return tree.Argument(str(children[0]), marker, span)


def _type_declaration(place: Place, span: Span, children: Children) -> tree.TypeDeclaration:
    return tree.TypeDeclaration(str(children[0]), tuple(_ranges(place, children)), span)


MOST_IN_RANGE = 1_000_000


def _ranges(place: Place, children: Children) -> Iterator[tree.Constant]:
    """The constants, those of ranges `1, ..., 5` written out."""
    elements = [c for c in children if isinstance(c, tree.Constant) or getattr(c, "type", "") == "ELLIPSIS"]
    for i, element in enumerate(elements):
        if isinstance(element, tree.Constant):
            yield element
            continue
        ends = [
            c.name for c in (*elements[max(0, i - 1) : i], *elements[i + 1 : i + 2]) if isinstance(c, tree.Constant)
        ]
        numbers = [int(e) for e in ends if re.fullmatch(r"-?\d{1,9}", e)]
        if len(numbers) < 2 or not 0 < numbers[1] - numbers[0] <= MOST_IN_RANGE:
            hint = "write `1, ..., 10`: whole numbers, the first one smaller"
            raise SyntaxMistake([mistake("E151", place.token(element), hint, limit=MOST_IN_RANGE)])
        span = place.token(element)
        yield from (tree.Constant(str(n), span) for n in range(numbers[0] + 1, numbers[1]))


def _start(token: Any) -> int:  # noqa: ANN401
    return int(token.start_pos)


def _fact(place: Place, span: Span, children: Children) -> Fact:
    types = [getattr(child, "type", "") for child in children]
    if types[0] == "NUMBER" and place.token(children[0]).end == place.offset + _start(children[1]):
        hint = f"put a space after it: `{children[0]} {_begin(span.text[len(children[0]) :])}`"
        raise SyntaxMistake([mistake("E108", place.token(children[0]), hint, number=children[0])])
    truth = float(children[0]) if types[0] == "NUMBER" else None
    arguments = tuple(constant.name for constant in _nodes(children))
    return Fact(str(children[types.index("NAME")]), arguments, "NOT" not in types, truth, span, "QUESTION" in types)


def _value(place: Place, span: Span, children: Children) -> Fact:
    value, *arguments = (constant.name for constant in _nodes(children))
    return Fact(str(children[2]), (*arguments, value), True, None, span)


BUILDERS: dict[str, Callable[[Place, Span, Children], Any]] = {
    "standard_term": _standard_term,
    "prac_term": _prac_term,
    "constant": _constant,
    "atom": _atom,
    "equality": _equality,
    "plus_equality": _equality,
    "negation": _negation,
    "conjunction": _conjunction,
    "disjunction": _disjunction,
    "implies": _implies,
    "iff": _iff,
    "variables": _variables,
    "quantified": _quantified,
    "parentheses": _parentheses,
    "number": _number,
    "binary": _binary,
    "negative": _negative,
    "positive": _positive,
    "call": _call,
    "weight": _weight,
    "standard_statement": statement,
    "prac_statement": statement,
    "operation": _operation,
    "both": _both,
    "group": _group,
    "count": _count,
    "size": _size,
    "macro": _macro,
    "macro_definition": _macro_definition,
    "probability": _probability,
    "number_of": _number_of,
    "declaration": _declaration,
    "argument": _argument,
    "type_declaration": _type_declaration,
    "fact": _fact,
    "value": _value,
}
