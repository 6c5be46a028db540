"""The two-variable fragment as weights of cells: comes in a model, goes out what one constant, and two, contribute.

A cell says everything about one constant by itself: the truth of `P(x)` and `R(x, x)` for all predicates. Given their
cells, two constants share only the atoms `R(x, y)` and `R(y, x)`, and those of different pairs are independent
(Van den Broeck, Meert and Darwiche, "Skolemization for weighted first-order model counting", 2014; Van Bremen and
Kuzelka, "Faster lifting for two-variable logic using cell graphs", 2021).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import All, Any, Argument, AtomRef, Const, Equal, Expression, Formula, Iff, Not
from mlnlite.model.model import Model
from mlnlite.model.templates import Template

MOST_CELLS, MOST_PAIRS = 10, 6
WORTH_LIFTING = 400
"""Atoms from which on it is worth more than grounding."""
LIFTED = "lifted"
Value = Callable[[str, tuple[int, ...]], Bool]


@dataclass(frozen=True, slots=True)
class Fragment:
    """A model in the two-variable fragment over one type.

    Attributes:
        type: its name.
        unary: predicates of one argument.
        binary: predicates of two.
        cells: shape (n_cells, n_unary + n_binary), truth of `P(x)`, then of `R(x, x)`.
        own: shape (n_cells,), log-weight that a constant contributes by itself.
        shared: shape (n_pairs, n_binary, 2), truth of `R(x, y)` and `R(y, x)`.
        pair: shape (n_cells, n_cells, n_pairs), log-weight that two constants contribute together.
    """

    type: str
    unary: tuple[str, ...]
    binary: tuple[str, ...]
    cells: Bool
    own: Float
    shared: Bool
    pair: Float


def fragment_of(model: Model, evidence: Evidence) -> Fragment | str:
    """The cells of a model, or why it has none.

    Args:
        model: with weights.
        evidence: facts about unary predicates only, about one database.
    """
    templates = [t for t in model.templates if not (t.weights == 0).all()]
    names = {a.predicate for t in templates for a in t.formula.atoms}
    predicates = [p for n, p in evidence.predicates.items() if n in names]
    types = sorted({t for p in predicates for t in p.types})
    known = [p.name for p in predicates if p.arity != 1 and (p.closed or len(evidence.facts[p.name].truth))]
    if len(types) != 1 or any(p.arity not in (1, 2) or p.marker or p.comparison for p in predicates):
        return "it needs plain predicates of one or two arguments of one type"
    if known or evidence.soft or evidence.n_databases != 1:
        return f"evidence may be about predicates of one argument only{', not ' + known[0] if known else ''}"
    for t in templates:
        reason = _why_not(t)
        if reason:
            return f"{t.name}: {reason}"
    unary = tuple(p.name for p in predicates if p.arity == 1)
    binary = tuple(p.name for p in predicates if p.arity == 2)
    if len(unary) + len(binary) > MOST_CELLS or 2 * len(binary) > MOST_PAIRS:
        return "it has too many predicates"
    return _weighted(templates, types[0], unary, binary)


def _why_not(template: Template) -> str:
    """Why a formula is outside of the fragment; empty if it is not."""
    formula = template.formula
    if template.keys or np.isnan(template.weights).any():
        return "it has several weights, or none"
    if not 1 <= len(formula.free) <= 2 or len(formula.variables) > 2 or not _is_plain(formula.body):
        return "it needs one or two variables and no quantifier"
    if any(isinstance(x, Const) for a in formula.atoms for x in a.arguments):
        return "it mentions a constant"
    return ""


def _is_plain(expression: Expression) -> bool:
    """Whether there is no quantifier and no constant."""
    match expression:
        case AtomRef():
            return True
        case Equal(left, right):
            return not isinstance(left, Const) and not isinstance(right, Const)
        case Not(operand):
            return _is_plain(operand)
        case All(operands) | Any(operands):
            return all(map(_is_plain, operands))
        case Iff(left_side, right_side):
            return _is_plain(left_side) and _is_plain(right_side)
        case _:
            return False


def _weighted(templates: list[Template], type_name: str, unary: tuple[str, ...], binary: tuple[str, ...]) -> Fragment:
    """Works out all weights."""
    cells = np.array(list(product((False, True), repeat=len(unary) + len(binary))), np.bool_)
    shared = np.array(list(product((False, True), repeat=2 * len(binary))), np.bool_)
    shared = shared.reshape(len(shared), len(binary), 2)
    column = {name: i for i, name in enumerate((*unary, *binary))}

    def alone(name: str, _: tuple[int, ...]) -> Bool:
        return cells[:, column[name]]

    def together(name: str, who: tuple[int, ...]) -> Bool:
        if len(set(who)) == 1:
            return cells[:, column[name]].reshape((-1, 1, 1) if who[0] == 0 else (1, -1, 1))
        return shared[:, column[name] - len(unary), who[0]].reshape(1, 1, -1)

    own, pair = np.zeros(len(cells)), np.zeros((len(cells), len(cells), len(shared)))
    for t in templates:
        weight, free = float(t.weights.sum()), t.formula.free
        own += _gain(weight, _truth(t.formula, t.formula.body, dict.fromkeys(free, 0), alone))
        if len(free) == 2:
            for first in (0, 1):
                binding = {free[0]: first, free[1]: 1 - first}
                pair += _gain(weight, _truth(t.formula, t.formula.body, binding, together))
    return Fragment(type_name, unary, binary, cells, own, shared, pair)


def _gain(weight: float, truth: Bool) -> Float:
    """Log-weight of a grounding."""
    return np.where(truth, 0.0, -np.inf) if np.isposinf(weight) else np.where(truth, weight, 0.0)


def _truth(formula: Formula, expression: Expression, binding: dict[int, int], value: Value) -> Bool:
    """Truth of a formula whose variables stand for constant 0 or 1."""

    def inside(e: Expression) -> Bool:
        return _truth(formula, e, binding, value)

    def who(argument: Argument) -> int:
        return binding[argument.index] if not isinstance(argument, Const) else -1

    match expression:
        case AtomRef(index):
            atom = formula.atoms[index]
            return value(atom.predicate, tuple(map(who, atom.arguments)))
        case Equal(left, right):
            return np.array(who(left) == who(right))
        case Not(operand):
            return ~inside(operand)
        case Iff(left_side, right_side):
            return np.asarray(inside(left_side) == inside(right_side))
        case All(operands):
            return _joined(np.logical_and, [np.array(True), *map(inside, operands)])
        case Any(operands):
            return _joined(np.logical_or, [np.array(False), *map(inside, operands)])
        case _:
            raise TypeError(f"not in the fragment: {expression}")


def _joined(operation: np.ufunc, parts: list[Bool]) -> Bool:
    """Several truth values as one."""
    result = parts[0]
    for part in parts[1:]:
        result = operation(result, part)
    return result


def groups_of(fragment: Fragment) -> tuple[Int64, Float]:
    """Cells that behave alike towards others: group of each cell, and log-weight of two constants by their groups."""
    peak = fragment.pair.max(axis=2)
    peak = np.where(np.isneginf(peak), 0.0, peak)
    with np.errstate(divide="ignore"):
        both = peak + np.log(np.exp(fragment.pair - peak[:, :, None]).sum(axis=2))
    keys = np.where(np.isneginf(both), -np.inf, np.round(np.where(np.isneginf(both), 0.0, both), 10))
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return group.ravel().astype(np.int64), both[np.ix_(first, first)]
