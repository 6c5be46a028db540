"""What is left of a group once constants stand for its separators: predicates lose arguments, formulas variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mlnlite.infer.exact.alike import Alike
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.formulas import (
    All,
    Any,
    Argument,
    AtomRef,
    AtomSchema,
    Const,
    Equal,
    Expression,
    Formula,
    Iff,
    Not,
    Var,
)
from mlnlite.model.model import Model
from mlnlite.model.propositional import FALSE, TRUE
from mlnlite.model.symbols import Predicate
from mlnlite.model.templates import Template

Constants = Mapping[int, int]
"""By variable, what stands for it; by argument, what is known to stand there."""


@dataclass(frozen=True, slots=True)
class _Making:
    """Predicates and facts of the remainder so far."""

    evidence: Evidence
    predicates: dict[str, Predicate]
    facts: dict[str, Facts]


def remainder(alike: Alike, number: int, model: Model, evidence: Evidence) -> tuple[Model, Evidence] | None:
    """What the formulas of a group say of the first tuple of a class; None if there are quantifiers.

    Args:
        alike: the group and its classes.
        number: of the class.
        model: of the group.
        evidence: about one database.
    """
    if any(v.bound for t in alike.group.templates for v in t.formula.variables):
        return None
    if not alike.separators:
        return replace(model, templates=alike.group.templates), evidence
    making, templates = _Making(evidence, {}, {}), []
    for i, template in enumerate(alike.group.templates):
        pairs = [(s.terms[i], c) for s, c in zip(alike.separators, alike.first[number].tolist(), strict=True)]
        if all(isinstance(term, Var) or term.id == c for term, c in pairs):
            put_in = {term.index: c for term, c in pairs if isinstance(term, Var)}
            templates.append(_template(template.expanded(evidence.types), put_in, alike, making))
    left = replace(model, predicates=making.predicates, templates=tuple(templates))
    return left, replace(evidence, predicates=making.predicates, facts=making.facts)


def _template(template: Template, put_in: Constants, alike: Alike, making: _Making) -> Template:
    """A template with constants for some variables."""
    assert template.rows is not None
    formula, stay = template.formula, [i for i, k in enumerate(template.keys) if k not in put_in]
    fits = np.ones(len(template.weights), np.bool_)
    for i, key in enumerate(template.keys):
        fits &= (template.rows[:, i] == put_in[key]) if key in put_in else True
    left = [v for v in range(len(formula.variables)) if v not in put_in]
    number = {v: i for i, v in enumerate(left)}
    atoms: dict[AtomSchema, int] = {}
    parts: list[Expression] = []
    for atom in formula.atoms:
        moved = _atom(atom, put_in, number, alike, making)
        parts.append(moved if isinstance(moved, Any | All) else AtomRef(atoms.setdefault(moved, len(atoms))))
    body = _expression(formula.body, put_in, number, parts)
    return replace(
        template,
        formula=Formula(tuple(formula.variables[v] for v in left), tuple(atoms), body),
        keys=tuple(number[template.keys[i]] for i in stay),
        rows=template.rows[fits][:, stay],
        weights=template.weights[fits],
        unique=(),
        row_spans=(),
    )


def _atom(
    atom: AtomSchema, put_in: Constants, number: Constants, alike: Alike, making: _Making
) -> AtomSchema | Any | All:
    """An atom without the arguments at which constants stand now; its truth, if that is known and none are left."""
    name = atom.predicate
    if name in alike.group.open:
        places: Sequence[int] = [s.at[name] for s in alike.separators]
    else:
        places = [i for i, a in enumerate(atom.arguments) if isinstance(a, Var) and a.index in put_in]
        name += "".join(f"/{p + 1}" for p in places)
    if name not in making.predicates:
        there = {
            p: a.id if isinstance(a, Const) else put_in[a.index] for p, a in enumerate(atom.arguments) if p in places
        }
        _add_predicate(name, making.evidence.predicates[atom.predicate], there, making)
    left = [_moved(a, number) for i, a in enumerate(atom.arguments) if i not in places]
    if not left and atom.predicate not in alike.group.open:
        return TRUE if making.facts[name].truth.any() else FALSE
    return AtomSchema(name, tuple(left))


def _add_predicate(name: str, old: Predicate, there: Constants, making: _Making) -> None:
    """A predicate that has lost arguments, and what is known of it where given constants stand there."""
    stay = [i for i in range(old.arity) if i not in there]
    value = stay.index(old.value) if old.value in stay else None
    types, marker = tuple(old.types[i] for i in stay), old.marker if value is not None else ""
    making.predicates[name] = replace(old, name=name, types=types, value=value, marker=marker)
    facts = making.evidence.facts[old.name]
    fits = np.ones(len(facts.truth), np.bool_)
    for place, constant in there.items():
        fits &= facts.arguments[:, place] == constant
    making.facts[name] = Facts(facts.database[fits], facts.arguments[fits][:, stay], facts.truth[fits])


def _moved(term: Argument, number: Constants) -> Argument:
    """A term by its new number."""
    return Var(number[term.index]) if isinstance(term, Var) else term


def _expression(
    expression: Expression, put_in: Constants, number: Constants, atoms: Sequence[Expression]
) -> Expression:
    """An expression without quantifiers with constants for some variables, and others for the rest and the atoms."""

    def inside(e: Expression) -> Expression:
        return _expression(e, put_in, number, atoms)

    def term(t: Argument) -> Argument:
        return Const(put_in[t.index]) if isinstance(t, Var) and t.index in put_in else _moved(t, number)

    match expression:
        case AtomRef(index):
            return atoms[index]
        case Equal(left, right):
            sides = term(left), term(right)
            if all(isinstance(s, Const) for s in sides):
                return TRUE if sides[0] == sides[1] else FALSE
            return Equal(*sides)
        case Not(operand):
            return Not(inside(operand))
        case All(operands):
            return All(tuple(map(inside, operands)))
        case Any(operands):
            return Any(tuple(map(inside, operands)))
        case Iff(first, second):
            return Iff(inside(first), inside(second))
        case _:
            raise AssertionError("there are no quantifiers")
