"""What statements need beyond themselves: the macros and functions of the program, and the rules of a predicate."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from mlnlite.errors import Diagnostic, SyntaxMistake
from mlnlite.source import Span
from mlnlite.syntax import raw, tree
from mlnlite.syntax.lower import names_of, predicates_of, statements_of, without_functions
from mlnlite.syntax.messages import mistake
from mlnlite.syntax.place import Place

_TEST = re.compile(
    r"@test\s+(?:given\s+(?P<given>.+?)\s+)?query\s+(?P<query>.+?)\s*=\s*(?P<p>[\d.eE+-]+?)\s*"
    r"(?:\+-|\+/-|±)\s*(?P<tolerance>[\d.eE-]+)"
)


@dataclass(slots=True)
class Vocabulary:
    """What statements have defined so far.

    Attributes:
        declared: the first declaration of each predicate, functions included.
        macros: values of `$name`.
        functions: names of functions.
        rules: the rules (`head :- body`) of each predicate.
    """

    declared: dict[str, tree.PredicateDeclaration] = field(default_factory=dict)
    macros: dict[str, Any] = field(default_factory=dict)
    functions: set[str] = field(default_factory=set)
    rules: dict[str, list[tuple[raw.Rule, Span]]] = field(default_factory=dict)


def read_test(text: str, place: Place) -> tree.Test:
    """The test that a line starting with `@test` is.

    Raises:
        SyntaxMistake: it is none.
    """
    match = _TEST.fullmatch(text)
    try:
        numbers = [float(match["p"]), float(match["tolerance"])] if match else []
    except ValueError:
        numbers = []
    if match is None or not numbers or not 0 <= numbers[0] <= 1 or numbers[1] < 0:
        hint = "write `@test query Cancer(Ann) = 0.44 +- 0.001`, or `@test given Smokes(Ann) query ...`"
        span = place.span(0, len(text))
        raise SyntaxMistake(
            [mistake("E112", span, hint, directive="@test", problem="needs a query, a number and `+-`")]
        )
    span = place.span(0, len(text))
    return tree.Test(match["query"].strip(), numbers[0], numbers[1], (match["given"] or "").strip(), span)


def finished(statement: Any, vocabulary: Vocabulary) -> Iterator[tree.Statement]:  # noqa: ANN401
    """The statements that a statement as it was read means.

    Raises:
        SyntaxMistake: it uses what is not defined, or has no meaning.
    """
    match statement:
        case raw.Definition(name, value):
            vocabulary.macros[name] = _without_macros(value, vocabulary)
        case raw.Function():
            yield _function(statement, vocabulary)
        case tree.FormulaStatement(raw.Rule() as rule):
            vocabulary.rules.setdefault(_head(rule).predicate, []).append((rule, statement.span or rule.span))
            yield from _ruled(statement, rule)
        case tree.FormulaStatement():
            if statement.weight is not None:
                statement = replace(statement, weight=_without_macros(statement.weight, vocabulary))
            yield from statements_of(statement)
        case _:
            if isinstance(statement, tree.PredicateDeclaration):
                vocabulary.declared.setdefault(statement.name, statement)
            yield statement


def _function(statement: raw.Function, vocabulary: Vocabulary) -> tree.PredicateDeclaration:
    """A function is a predicate with exactly one value."""
    arguments = (*statement.arguments, tree.Argument(statement.value, "!", statement.span))
    declaration = tree.PredicateDeclaration(statement.name, arguments, False, statement.span)
    vocabulary.declared.setdefault(statement.name, declaration)
    vocabulary.functions.add(statement.name)
    return declaration


def _without_macros(weight: Any, vocabulary: Vocabulary) -> Any:  # noqa: ANN401
    match weight:
        case raw.Macro(name, span):
            if name not in vocabulary.macros:
                hint = f"write `{name} = 0.5` on a line above"
                raise SyntaxMistake([mistake("E153", span, hint, found=name)])
            return vocabulary.macros[name]
        case tree.Call():
            return replace(weight, arguments=tuple(_without_macros(a, vocabulary) for a in weight.arguments))
        case tree.Arithmetic():
            left = None if weight.left is None else _without_macros(weight.left, vocabulary)
            return replace(weight, left=left, right=_without_macros(weight.right, vocabulary))
    return weight


# --- rules and their completion


def _head(rule: raw.Rule) -> tree.Atom:
    if not isinstance(rule.head, tree.Atom):
        hint = "the head of a rule is one atom"
        raise SyntaxMistake([mistake("E110", rule.span, hint, construct="a rule whose head is no atom")])
    return rule.head


def _ruled(statement: tree.FormulaStatement, rule: raw.Rule) -> Iterator[tree.FormulaStatement]:
    """The rule itself: `body => head`."""
    hard = statement.hard or statement.weight is None
    formula = tree.Implies(rule.body, rule.head, rule.span)
    yield from statements_of(replace(statement, formula=formula, hard=hard))


def completion(vocabulary: Vocabulary) -> Iterator[tree.FormulaStatement]:
    """For each predicate with rules a hard formula: it is true only if the body of some rule is.

    Raises:
        SyntaxMistake: a rule whose head is not plain.
    """
    for rules in vocabulary.rules.values():
        heads = [_head(rule) for rule, _ in rules]
        names = [f"h{i + 1}" for i in range(len(heads[0].arguments))]
        if all(head.arguments == heads[0].arguments for head in heads) and _plain(heads[0]):
            names = [t.name for t in heads[0].arguments if isinstance(t, tree.Variable)]
        span = rules[0][1]
        cases = [_case(head, rule, names) for head, (rule, _) in zip(heads, rules, strict=True)]
        head = tree.Atom(heads[0].predicate, tuple(tree.Variable(n, False, span) for n in names), span)
        some = cases[0] if len(cases) == 1 else tree.Or(tuple(cases), span)
        yield tree.FormulaStatement(tree.Implies(head, some, span), None, True, span=span)


def _plain(head: tree.Atom) -> bool:
    """Whether all arguments are distinct variables."""
    return all(isinstance(t, tree.Variable) for t in head.arguments) and len(set(head.arguments)) == len(head.arguments)


def _case(head: tree.Atom, rule: raw.Rule, names: Sequence[str]) -> tree.Formula:
    """The body of a rule for the arguments `names` of its head; its other variables are bound by EXIST."""
    equal = [
        _equal(tree.Variable(name), term, rule.span)
        for name, term in zip(names, head.arguments, strict=True)
        if not (isinstance(term, tree.Variable) and term.name == name)
    ]
    inside = without_functions(tree.And((*equal, rule.body), rule.span) if equal else rule.body, hard=False)
    bound = tuple(name for name in dict.fromkeys(names_of(inside)) if name not in names)
    return tree.Quantified("exist", bound, inside, rule.span) if bound else inside


def _equal(variable: tree.Variable, term: Any, span: Span) -> tree.Equality | tree.Comparison:  # noqa: ANN401
    if isinstance(term, tree.Operation):
        return tree.Comparison("=", variable, term, span)
    return tree.Equality(variable, term, span)


def recursive(vocabulary: Vocabulary) -> Iterator[Diagnostic]:
    """A mistake for each rule of a predicate that depends on itself."""
    needs = {
        name: {p for rule, _ in rules for p in predicates_of(rule.body)} for name, rules in vocabulary.rules.items()
    }
    for name, rules in vocabulary.rules.items():
        reached, waiting = set(), list(needs[name])
        while waiting:
            found = waiting.pop()
            if found not in reached:
                reached.add(found)
                waiting += needs.get(found, ())
        if name in reached:
            rule, span = next((r, s) for r, s in rules if reached & set(predicates_of(r.body)))
            hint = (
                f"work out what it derives beforehand and give it as facts of {name}, or write `body => {name}(...).`"
            )
            yield mistake("E110", span or rule.span, hint, construct=f"a recursive rule ({name} depends on itself)")
