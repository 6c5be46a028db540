"""From one dialect to another: what is rewritten, and what cannot be kept."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import prod

from mlnlite.source import Source, Span
from mlnlite.syntax import tree
from mlnlite.syntax.includes import load


def rewritten(program: tree.Program) -> tree.Program:
    """The program as one file: included files written out. The dialect only says how it is to be written."""
    return replace(program, statements=tuple(_flat(program.statements)))


def _flat(statements: Sequence[tree.Statement]) -> Iterator[tree.Statement]:
    for statement in statements:
        if isinstance(statement, tree.Include):
            yield from _flat(statement.program.statements)
        else:
            yield statement


# What is not kept as it is written: how it looks without quotes and comments, and what becomes of it.
_WRITTEN_OUT = tuple(
    (re.compile(pattern, re.MULTILINE), note)
    for pattern, note in (
        (r"\$\w+", "macros are written as their values"),
        (r"^[ \t]*#include\b", "included files are written out"),
        (r"^[ \t]*#(?:group|AdaptiveMLNDependency)\b", "these lines are dropped; they had no meaning"),
        (r"^[ \t]*#fixweight\b", "fixed weights are written `@w`"),
        (r"^[ \t]*[pP]\s*=\s*[\d.]+\s*:", "probabilities are written as `logit(p)`"),
        (r"\.\.\.", "ranges are written out"),
        (r"(?<=[\s(!\d])\*\s*[^\W\d][\w-]*\s*\(", "`*P(x)` makes two formulas, with `P(x)` and with `!P(x)`"),
        (r"[^\W\d]\w*(?:\|[^\W\d]\w*)+\(", "groups make one formula for each predicate"),
        (r":-", "rules are written as implications, and who has no other reason is false"),
        (
            r"^[ \t]*[^\W\d][\w-]*[ \t]+(?!v[ \t])[^\W\d][\w-]*\([^()\n]*\)[ \t]*$",
            "functions are predicates `f(x, y!)`",
        ),
        (
            r"\w(?:\+\+|--)|\b(?:succ|plus|minus|times|dividedBy|mod)[ \t]*\(",
            "functions of numbers are written + - * / %",
        ),
        (r"\[[^\]\n]*\]", "conditions in brackets stand among the others"),
        (r"^[ \t]*\|[\w ,]+\|", "counts are written `count(f | x) <= 2.`"),
    )
)
_COMMENT = re.compile(r'"(?:[^"\\\n]|\\[^\n])*"|(//[^\n]*|/\*.*?\*/)', re.DOTALL)
MOST_PLACES = 8


def losses(program: tree.Program, sources: Sequence[Source]) -> Iterator[str]:
    """What is not kept as it was written, and what means something else than in the system of the dialect; where."""
    origin = program.origin
    if origin:
        why = f" ({'; '.join(origin.reasons)})" if origin.reasons else ""
        yield f"read as {origin.dialect}{why}"
        for note in origin.notes:
            yield f"  differs: {note}"
        if origin.dialect in ("alchemy", "lomrf"):
            divided = [s.span for s in _flat(program.statements) if _is_divided(s) and s.span]
            yield from _placed("  differs: weights that these systems divide", divided)
    codes = [code for source in sources for code in load(source).codes()]
    comments = [Span(c.source, *m.span(1)) for c in codes for m in _COMMENT.finditer(c.source.text) if m[1]]
    yield from _placed("  not kept: comments", comments)
    for pattern, note in _WRITTEN_OUT:
        found = [Span(c.source, *m.span()) for c in codes for m in pattern.finditer(c.bare)]
        yield from _placed(f"  rewritten: {note}", [_without_blanks(span) for span in found])
    tables = [s.span for s in _flat(program.statements) if isinstance(s, tree.FormulaTable) and s.span]
    yield from _placed("  rewritten: formulas that differ only in constants stand together", tables)


def _without_blanks(span: Span) -> Span:
    return Span(span.source, span.start + len(span.text) - len(span.text.lstrip()), span.end)


def _placed(what: str, spans: Sequence[Span]) -> Iterator[str]:
    """One line with the places, if there are any."""
    if spans:
        more = f" and {len(spans) - MOST_PLACES} more" if len(spans) > MOST_PLACES else ""
        yield f"{what}: {', '.join(span.place for span in spans[:MOST_PLACES])}{more}"


def _is_divided(statement: tree.Statement) -> bool:
    """Whether a system that goes by clauses divides the weight of a statement."""
    if not isinstance(statement, tree.FormulaStatement | tree.FormulaTable):
        return False
    hard = isinstance(statement, tree.FormulaStatement) and statement.hard
    return not hard and _n_clauses(statement.formula, positive=True) > 1


def _n_clauses(formula: tree.Formula, *, positive: bool) -> int:
    """How many clauses the normal form of a formula, or of its negation, has."""
    match formula:
        case tree.Not(operand):
            return _n_clauses(operand, positive=not positive)
        case tree.Implies(body, head):
            sides = [_n_clauses(body, positive=not positive), _n_clauses(head, positive=positive)]
            return prod(sides) if positive else sum(sides)
        case tree.Iff(left, right):
            true = [_n_clauses(side, positive=True) for side in (left, right)]
            false = [_n_clauses(side, positive=False) for side in (left, right)]
            return true[0] * false[1] + false[0] * true[1] if positive else true[0] * true[1] + false[0] * false[1]
        case tree.And(operands) | tree.Or(operands):
            counts = [_n_clauses(operand, positive=positive) for operand in operands]
            return sum(counts) if isinstance(formula, tree.And) == positive else prod(counts)
        case tree.Quantified() | tree.Count():
            return _n_clauses(formula.body, positive=positive)
    return 1
