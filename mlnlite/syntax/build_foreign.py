"""Builders of the rules that only other systems' languages have."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Span
from mlnlite.syntax import raw, tree
from mlnlite.syntax.build import Children, Weight, is_variable, statement, unquote
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.place import Place

_SUMS = {"succ": "+", "plus": "+", "minus": "-", "times": "*", "dividedBy": "/", "mod": "%"}
_ORDERS = {"greaterThan": ">", "lessThan": "<", "greaterThanEq": ">=", "lessThanEq": "<="}
# fmt: off
_TEXT_FUNCTIONS = (
    "concat", "substr", "lower", "upper", "length", "contains", "startsWith", "endsWith", "trim", "initcap", "md5",
    "strpos", "repeat", "replace", "split_part", "regex_replace",
)
# fmt: on


def _term(place: Place, span: Span, children: Children) -> tree.Variable | tree.Constant:
    token, plus = children[-1], len(children) > 1
    if token.type == "STRING":
        return tree.Constant(unquote(token), span)
    number = token[0].isdigit() or token[0] == "-"
    if number or not (place.language == "rockit" or is_variable(token)):
        return tree.Constant(str(token), span)
    return tree.Variable(variable_name(token), plus, span)


def variable_name(word: str) -> str:
    """The name of a variable in our dialect: it starts in lower case and has no hyphens.

    >>> variable_name("x"), variable_name("X"), variable_name("first-name")
    ('x', 'v_X', "first'name")
    """
    name = str(word).replace("-", "'")
    return name if is_variable(name) else f"v_{name}"


def _successor(place: Place, span: Span, children: Children) -> tree.Operation:
    return tree.Operation(children[1][0], _term(place, span, children[:1]), tree.Constant("1", span), span)


def _apply(place: Place, span: Span, children: Children) -> tree.Operation | raw.Apply:
    name, arguments = str(children[0]), tuple(c for c in children if not isinstance(c, str))
    _refuse_text_function(name, span)
    if name in _SUMS and len(arguments) == (1 if name == "succ" else 2):
        right = arguments[1] if len(arguments) > 1 else tree.Constant("1", span)
        return tree.Operation(_SUMS[name], arguments[0], right, span)
    if place.language in ("tuffy", "rockit"):
        hint = "compute its values beforehand, and give them as facts of a predicate"
        raise SyntaxMistake([mistake("E110", span, hint, construct=f"`{name}(...)`, a function,")])
    return raw.Apply(name, arguments, span)


def _refuse_text_function(name: str, span: Span) -> None:
    if name in _TEXT_FUNCTIONS:
        hint = "make the text beforehand, and give it as a constant or as facts of a predicate"
        raise SyntaxMistake([mistake("E110", span, hint, construct=f"`{name}(...)`, a function of texts,")])


def _atom(place: Place, span: Span, children: Children) -> tree.Atom | tree.Comparison:
    name, terms = str(children[0]), tuple(c for c in children if not isinstance(c, str))
    _refuse_text_function(name, span)
    if name in _ORDERS and len(terms) == 2:
        return tree.Comparison(_ORDERS[name], terms[0], terms[1], span)
    return tree.Atom(name, terms, span)


def _list(place: Place, span: Span, children: Children) -> tree.And:
    if place.language not in ("tuffy", "lomrf"):
        comma = next(c for c in children if c == ",")
        hint = "conjunction is written `^`"
        raise SyntaxMistake([mistake("E101", place.token(comma), hint, found="`,`", expected="a connective")])
    return tree.And(tuple(c for c in children if not isinstance(c, str)), span)


def _implies_chain(place: Place, span: Span, children: Children) -> tree.Implies:
    """`a => b => c` is `(a => b) => c` in Alchemy; the others have no such chain."""
    body, head = children[0], children[-1]
    if isinstance(body, tree.Implies) and place.language != "alchemy" and not _in_parentheses(body, place):
        hint = "write `a => (b => c)` or `(a => b) => c`"
        raise SyntaxMistake([mistake("E106", place.token(children[1]), hint, operator="=>")])
    return tree.Implies(body, head, span)


def _in_parentheses(node: Any, place: Place) -> bool:  # noqa: ANN401
    return place.source.text[: node.span.start].rstrip().endswith("(")


def _iff_chain(place: Place, span: Span, children: Children) -> tree.Iff:
    return tree.Iff(children[0], children[-1], span)


def _quantified(place: Place, span: Span, children: Children) -> tree.Quantified:
    variables, body = children[1:]
    return tree.Quantified("forall" if children[0].lower() == "forall" else "exist", variables, body, span)


def _variables(place: Place, span: Span, children: Children) -> tuple[str, ...]:
    return tuple(variable_name(word) for word in children if word != ",")


def _number_of(place: Place, span: Span, children: Children) -> Weight:
    return Weight(tree.NumberOf(variable_name(children[0]), span), True, span)


def _guard(place: Place, span: Span, children: Children) -> Any:  # noqa: ANN401
    return children[1]


def _rule(place: Place, span: Span, children: Children) -> raw.Rule:
    if place.language not in ("tuffy", "lomrf"):
        raise SyntaxMistake([mistake("E110", span, "write `body => head`", construct="a rule (`head :- body`)")])
    return raw.Rule(children[0], children[-1], span)


def _foreign_weight(place: Place, span: Span, children: Children) -> Weight:
    """A weight is fixed by `@`, in Alchemy by a dot right behind it."""
    dotted = place.language == "alchemy" and span.text.endswith(".")
    return Weight(children[-1], len(children) > 1 or dotted, span)


def _function(place: Place, span: Span, children: Children) -> raw.Function:
    arguments = tuple(c for c in children if isinstance(c, tree.Argument))
    return raw.Function(str(children[1]), arguments, str(children[0]), span)


FOREIGN_BUILDERS: dict[str, Callable[[Place, Span, Children], Any]] = {
    "foreign_term": _term,
    "successor": _successor,
    "apply": _apply,
    "atom": _atom,
    "list": _list,
    "implies_chain": _implies_chain,
    "iff_chain": _iff_chain,
    "quantified": _quantified,
    "variables": _variables,
    "guard": _guard,
    "rule": _rule,
    "weight": _foreign_weight,
    "function": _function,
    "number_of": _number_of,
    "statement": statement,
}
