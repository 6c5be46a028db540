"""Two models side by side: formulas matched by what they say, weights row by row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mlnlite.model.model import Model
from mlnlite.model.unparse import row_formula, template_formula
from mlnlite.syntax import tree
from mlnlite.syntax.lower import parts
from mlnlite.syntax.walk import map_terms, variables_of
from mlnlite.syntax.write import write_formula


@dataclass(frozen=True, slots=True)
class Difference:
    """One formula in two models; None where a model does not have it, NaN where it has no weight there."""

    text: str
    left: float | None
    right: float | None


def differences(left: Model, right: Model, *, tolerance: float = 0.0) -> list[Difference]:
    """The formulas that only one model has, or whose weights differ by more than `tolerance`.

    Formulas are the same if they read the same with variables renamed in order of appearance and `!a v b` written as
    `a => b`.
    """
    tables = [dict(_rows(model)) for model in (left, right)]
    found = []
    for text in dict.fromkeys([*tables[0], *tables[1]]):
        a, b = (table.get(text) for table in tables)
        if a is None or b is None or not _close(a, b, tolerance):
            found.append(Difference(text, a, b))
    return found


def _close(a: float, b: float, tolerance: float) -> bool:
    return a == b or (a != a and b != b) or abs(a - b) <= tolerance


def declarations(left: Model, right: Model) -> Iterator[str]:
    """Declarations that only one model has: `- P(a)`, `+ P(a, b)`."""
    texts = [[str(p) for p in m.predicates.values() if not p.comparison] for m in (left, right)]
    yield from (f"- {t}" for t in texts[0] if t not in texts[1])
    yield from (f"+ {t}" for t in texts[1] if t not in texts[0])


def _rows(model: Model) -> Iterator[tuple[str, float]]:
    """The formula and weight of each row; equal formulas add their weights, as they do in the distribution."""
    sums: dict[str, float] = {}
    for template in model.templates:
        by_row = template.rows is not None and template.keys
        text = renamed(template_formula(template, model))
        for row, weight in enumerate(template.weights.tolist()):
            text = renamed(row_formula(template, model, row)) if by_row else text
            sums[text] = sums.get(text, 0.0) + weight
    yield from sums.items()


def renamed(formula: tree.Formula) -> str:
    """The text of a formula with its free variables called x1, x2, ... in order of appearance."""
    bound = set(_bound(formula))
    plus = {v.name for v in variables_of(formula) if v.plus}
    names: dict[str, str] = {}
    for variable in variables_of(formula):
        if variable.name not in bound:
            names.setdefault(variable.name, f"x{len(names) + 1}")

    def change(term: tree.Term) -> tree.Term:
        if not isinstance(term, tree.Variable):
            return term
        return tree.Variable(names.get(term.name, term.name), term.name in plus)

    return write_formula(map_terms(formula, change), "standard")


def _bound(formula: tree.Formula) -> Iterator[str]:
    if isinstance(formula, tree.Quantified | tree.Count):
        yield from formula.variables
    for part in parts(formula):
        yield from _bound(part)
