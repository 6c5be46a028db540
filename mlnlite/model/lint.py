"""What is allowed and probably not meant: warnings about a model that need no evidence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

from mlnlite.errors import Diagnostic, LimitReached
from mlnlite.model.compare import renamed
from mlnlite.model.model import Model
from mlnlite.model.propositional import cubes
from mlnlite.model.templates import Template
from mlnlite.model.unparse import template_formula
from mlnlite.source import Span
from mlnlite.syntax import tree
from mlnlite.syntax.lower import parts
from mlnlite.syntax.walk import variables_of


def lint(model: Model, program: tree.Program) -> list[Diagnostic]:
    """All warnings, those of the check included."""
    found = list(model.warnings)
    for rule in _RULES:
        found += rule(model, program)
    return found


def _warning(code: str, message: str, span: Span | None, hint: str) -> Diagnostic:
    return Diagnostic(code, message, span, hint, "warning")


def _spellings(model: Model, program: tree.Program) -> Iterator[Diagnostic]:
    """Predicates whose names differ in letter case or underscores only."""
    seen: dict[str, str] = {}
    for predicate in model.predicates.values():
        key = predicate.name.lower().replace("_", "")
        other = seen.setdefault(key, predicate.name)
        if other != predicate.name and not predicate.comparison:
            message = f"{predicate.name} and {other} are two predicates with nearly the same name"
            yield _warning("W205", message, predicate.span, "use one spelling")


def formulas(program: tree.Program) -> Iterator[tree.FormulaStatement | tree.FormulaTable]:
    """All formulas of a program, those of included files too."""
    for statement in program.statements:
        if isinstance(statement, tree.FormulaStatement | tree.FormulaTable):
            yield statement
        elif isinstance(statement, tree.Include):
            yield from formulas(statement.program)


def _once(model: Model, program: tree.Program) -> Iterator[Diagnostic]:
    """Variables that stand once in a formula of several atoms: often a slip, or a constant in lower case."""
    for statement in formulas(program):
        formula, span = statement.formula, statement.span
        variables = variables_of(formula)
        counts = Counter(v.name for v in variables) + Counter(_bound(formula))
        if isinstance(statement, tree.FormulaStatement) and isinstance(statement.weight, tree.NumberOf):
            counts[statement.weight.variable] += 1
        if len(counts) < 2:
            continue
        for variable in variables:
            if counts[variable.name] > 1 or variable.plus or variable.name.startswith(("_", "u1")):
                continue
            if program.dialect == "standard" and len(variable.name) > 3 and not variable.name[-1].isdigit():
                hint = f'write "{variable.name}" in quotes, or start it with a capital letter, if it is a constant'
                message = f"{variable.name} stands once in this formula and is read as a variable"
                yield _warning("W207", message, variable.span or span, hint)
            else:
                message = f"the variable {variable.name} stands once in this formula"
                hint = (
                    f"every constant of its type makes a grounding; write EXIST {variable.name} (...) if one is enough"
                )
                yield _warning("W206", message, variable.span or span, hint)


def _bound(formula: tree.Formula) -> Iterator[str]:
    """The variables that quantifiers and counts of a formula bind."""
    if isinstance(formula, tree.Quantified | tree.Count):
        yield from formula.variables
    for part in parts(formula):
        yield from _bound(part)


def _constant(model: Model, program: tree.Program) -> Iterator[Diagnostic]:
    """Formulas that are true, or false, whatever the atoms are."""
    for template in model.templates:
        truth = _always(template)
        if truth is not None:
            message = f"{template.name} is always {'true' if truth else 'false'}: {template.text}"
            yield _warning("W208", message, template.span, "its weight changes nothing; remove it or mend it")


def _always(template: Template) -> bool | None:
    if any(v.bound for v in template.formula.variables):
        return None
    try:
        true, false = (bool(cubes(template.formula.body, value)) for value in (True, False))
    except LimitReached:
        return None
    return None if true and false else true


def _twice(model: Model, program: tree.Program) -> Iterator[Diagnostic]:
    """Formulas that say the same up to names of variables."""
    seen: dict[str, Template] = {}
    for template in model.templates:
        yield from _same_rows(template)
        other = seen.setdefault(renamed(template_formula(template, model)), template)
        if other is not template:
            place = f" at {other.span.place}" if other.span else ""
            message = f"{template.name} says the same as {other.name}{place}: {template.text}"
            yield _warning("W209", message, template.span, "their weights add; keep one with the sum")


def _same_rows(template: Template) -> Iterator[Diagnostic]:
    seen: dict[tuple[int, ...], Span] = {}
    for row, span in zip([] if template.rows is None else template.rows.tolist(), template.row_spans, strict=False):
        other = seen.setdefault(tuple(row), span)
        if other is not span:
            message = f"this says the same as the formula at {other.place}"
            yield _warning("W209", message, span, "their weights add; keep one with the sum")


def _one_constant(model: Model, program: tree.Program) -> Iterator[Diagnostic]:
    """A weight for each constant of a type with one constant."""
    for template in model.templates:
        for key in template.keys if template.rows is None else ():
            variable = template.formula.variables[key]
            if len(model.types[variable.type].constants) == 1:
                message = f"+{variable.name} asks for one weight for each constant of {variable.type}, which has one"
                yield _warning("W210", message, template.span, "drop the plus sign, or declare the other constants")


def _mixed(model: Model, program: tree.Program) -> Iterator[Diagnostic]:
    """`^` and `v` side by side without parentheses, which dialects read in two ways."""
    for statement in formulas(program):
        if program.origin and program.origin.dialect in ("standard", "prac") and _mixes(statement.formula):
            text = "`a ^ (b v c)` here, `(a ^ b) v c` in Alchemy and prac"
            if program.dialect == "prac":
                text = "`(a ^ b) v c` here, `a ^ (b v c)` in the standard dialect"
            yield _warning("W211", f"`a ^ b v c` without parentheses is {text}", statement.span, "put parentheses")


def _mixes(formula: tree.Formula) -> bool:
    inner = tree.Or if isinstance(formula, tree.And) else tree.And if isinstance(formula, tree.Or) else ()
    for part in parts(formula):
        if isinstance(part, inner) and part.span and not _in_parentheses(part.span):
            return True
        if _mixes(part):
            return True
    return False


def _in_parentheses(span: Span) -> bool:
    return span.source.text[: span.start].rstrip().endswith("(")


_RULES: tuple[Callable[[Model, tree.Program], Iterator[Diagnostic]], ...] = (
    _spellings,
    _once,
    _constant,
    _twice,
    _one_constant,
    _mixed,
)
