"""One statement: is it a type declaration, a predicate declaration or a formula, and which."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from mlnlite.errors import SyntaxMistake
from mlnlite.syntax import tree
from mlnlite.syntax.build_foreign import variable_name
from mlnlite.syntax.grammar import parse_node
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.nesting import refuse_long_chain
from mlnlite.syntax.place import Place

_TYPE = re.compile(r"[^\W\d][\w'-]*\s*=\s*\{")
# An atom whose arguments are plain words, with or without markers: a declaration or a formula without weight.
_PLAIN_ATOM = re.compile(
    r"([^\W\d][\w'-]*)\s*(?:\(\s*([^\W\d][\w'-]*\s*[!?]?(?:\s*,\s*[^\W\d][\w'-]*\s*[!?]?)*)\s*\))?"
)
# Marks that only a declaration has: a star in front, `!` or `?` after an argument.
_DECLARATION_MARK = re.compile(r"\*\s*\w|[^\W\d][\w'-]*\s*\([^()]*[\w']\s*[!?]\s*[!?,)]")


def read_statement(
    text: str, place: Place, dialect: tree.Dialect, declared: Mapping[str, tree.PredicateDeclaration]
) -> Any:  # noqa: ANN401
    """The statement `text`, which stands at `place`; it may have raw nodes.

    A bare atom with plain words as arguments declares its predicate the first time, and again if it is the same; after
    that `P(x)` with other words is a formula without weight.

    Raises:
        SyntaxMistake: it is no statement of the dialect.
    """
    rule = f"{dialect}_statement"
    if _MACRO.match(text):
        rule = "macro_definition"
    elif _TYPE.match(text):
        rule = "type_declaration"
    elif _DECLARATION_MARK.match(text) or declares(text, declared):
        rule = "declaration"
    return parse_node(rule, text, place, dialect)


_MACRO = re.compile(r"\$\w+\s*=")
_FUNCTION = re.compile(r"(?!(?i:exists?|forall|not|inf)\b)[^\W\d][\w-]*\s+(?!v\s)[^\W\d][\w-]*\s*\(")
_COUNT = re.compile(r"\|([\w\s,]+)\|(.+?)(<=|>=|<|>|=)\s*(\d+)\s*\.?")
_NAMED = re.compile(r"\*{0,2}[^\W\d][\w-]*\s*\(\s*\w+(?:\s+\w+)?\s*[!?]?(?:\s*,\s*\w+(?:\s+\w+)?\s*[!?]?)*\s*\)[*@+]*")
_QUOTED = re.compile(r'"(?:[^"\\\n]|\\[^\n])*"')
_ALL: tuple[tree.Foreign, ...] = ("alchemy", "tuffy", "rockit", "lomrf")
# Constructs that are not supported: the languages that have them, how they begin, their names, what to do instead.
_REFUSED: tuple[tuple[tuple[tree.Foreign, ...], re.Pattern[str], str, str], ...] = tuple(
    (languages, re.compile(pattern), construct, hint)
    for languages, pattern, construct, hint in (
        (_ALL, r"(?i:FD)\s*:", "a functional dependency (`FD:`)", "mark the argument with `!` in the declaration"),
        (_ALL, r"\w+\s*\(.*\)\s*:=\s*\[", "a computed predicate (`:= [...]`)", "compare in the formulas: `x + y = z`"),
        (_ALL, r".*:=", "scoping (`:=`)", "write the condition into each formula"),
        (
            _ALL,
            r"[\d.-]+\s*:\s*[\d.-]+\s|:[\d.-]+\s",
            "a utility",
            "utilities of decisions have no counterpart; drop them",
        ),
        (
            _ALL,
            r".*\)\s*\*\s*\(.*|[-+\d.\s]*\([^()]*\([^()]*\)[^()]*\)\s*\^\s*\d",
            "a numeric feature (`(f) * (P(x) = 3.0)`)",
            "divide the numbers into bins",
        ),
        (
            ("alchemy",),
            r"[-+\d.]*\s*\[.*\]\s*\.?$",
            "an indivisible formula (`[f]`)",
            "drop the brackets: no weight is divided",
        ),
        (_ALL, r"\[[\w\s=.+]*\].*", "a label or prior in front of a formula", "drop it; `@` fixes a weight"),
        (("tuffy",), r"\$\w+\s*\(.*:-", "a view (`$P(...) :-`)", "drop the `$`"),
        (("tuffy",), r"@\s*[^\W\d]\w*\s*\(.*:-", "a rule for afterwards (`@P(...) :-`)", "ask for its body instead"),
        (
            ("tuffy",),
            r".*(?:<<|>>|~|(?<!&)&(?!&)|(?<!\|)\|(?!\|))",
            "an operation on bits",
            "make the numbers beforehand, and give them as facts of a predicate",
        ),
        (
            ("tuffy", "rockit"),
            r"(?!(?i:exists?|forall|not|inf)\b)[^\W\d][\w-]*\s+(?!v\s)[^\W\d][\w-]*\s*\(",
            "a function (`type f(type)`)",
            "declare a predicate with exactly one value, `f(type, type!)`, and write `f(x, y) ^ ...`",
        ),
        (
            ("rockit",),
            r"[-+\d.]+\s*\|",
            "a weight in front of a count",
            "counts are hard in RockIt; `1.5 count(f | x) <= 2` is possible in the standard dialect",
        ),
        (("rockit",), r"[^\[]*\[", "a computed term (`[t + 1]`)", "write it without brackets: `P(t + 1)`"),
    )
)


def read_foreign(
    text: str, place: Place, dialect: tree.Foreign, declared: Mapping[str, tree.PredicateDeclaration]
) -> Any:  # noqa: ANN401
    """The statement `text` of another system's language, which may have raw nodes.

    Raises:
        SyntaxMistake: it is no statement of the language, or has no counterpart here.
    """
    refuse_long_chain(text, place)
    bare = _QUOTED.sub(lambda match: "_" * len(match[0]), text)
    for languages, pattern, construct, hint in _REFUSED:
        if dialect in languages and pattern.match(bare):
            raise SyntaxMistake([mistake("E110", place.span(0, len(text)), hint, construct=construct)])
    count = _COUNT.fullmatch(text)
    if count:
        return _count(count, place, dialect)
    if _TYPE.match(text):
        return parse_node("type_declaration", text, place, dialect)
    if _FUNCTION.match(text) and dialect in ("alchemy", "lomrf"):
        return parse_node("function", text, place, dialect)
    if _DECLARATION_MARK.match(text) or declares(text, declared) or (_NAMED.fullmatch(text) and _first(text, declared)):
        return parse_node("declaration", text.rstrip("*@+"), place, dialect)
    return parse_node("statement", text, place, dialect)


def _first(text: str, declared: Mapping[str, tree.PredicateDeclaration]) -> bool:
    return text.split("(")[0].strip("* ") not in declared


def _count(match: re.Match[str], place: Place, dialect: tree.Foreign) -> tree.FormulaStatement:
    """RockIt's `|x| f >= 2`: for each binding of the other variables, a hard bound."""
    inside = replace(place, offset=place.offset + match.start(2))
    body = parse_node("formula", match[2].rstrip(), inside, dialect)
    variables = tuple(variable_name(name.strip()) for name in match[1].split(","))
    span = place.span(0, len(match[0]))
    formula = tree.Count(variables, body, match[3], int(match[4]), span)
    return tree.FormulaStatement(formula, None, True, span=span)


def declares(text: str, declared: Mapping[str, tree.PredicateDeclaration]) -> bool:
    """Whether a statement without weight, dot and marks is a declaration after those in `declared`."""
    match = _PLAIN_ATOM.fullmatch(text)
    if match is None:
        return False
    known = declared.get(match[1])
    if known is None:
        return True
    words = tuple(re.sub(r"\s", "", word) for word in match[2].split(",")) if match[2] else ()
    return words == tuple(argument.type + argument.marker for argument in known.arguments)
