"""Decomposers: comes in a model, go out groups of formulas, each with variables that stand in all of its open atoms.

Where every open atom of a formula has the same variable, and every predicate has it at the same argument in all
formulas, worlds fall apart by the constant that it stands for (Poole 2003; De Salvo Braz, Amir and Roth 2005).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod

from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import (
    Argument,
    AtomSchema,
    Const,
    Equal,
    Var,
    parts_of,
)
from mlnlite.model.symbols import Predicate
from mlnlite.model.templates import Template


@dataclass(frozen=True, slots=True)
class Group:
    """Formulas that hang together by predicates that are not wholly known.

    Attributes:
        templates: with weights other than zero.
        open: names of those predicates.
    """

    templates: tuple[Template, ...]
    open: frozenset[str]


@dataclass(frozen=True, slots=True)
class Separator:
    """A term for each formula of a group that is in all of its open atoms.

    Attributes:
        type: of its constants.
        at: for each open predicate, the argument at which it stands.
        terms: for each formula, a free variable of it or a constant.
    """

    type: str
    at: Mapping[str, int]
    terms: tuple[Argument, ...]


def is_known(predicate: Predicate, evidence: Evidence) -> bool:
    """Whether evidence decides all atoms of a predicate."""
    n_atoms = prod(int(evidence.present[t][0].sum()) for t in predicate.types)
    return predicate.closed or predicate.comparison is not None or len(evidence.facts[predicate.name].truth) == n_atoms


def groups_of(templates: Sequence[Template], evidence: Evidence) -> list[Group]:
    """The groups of formulas that evidence does not decide by itself.

    Args:
        templates: with weights.
        evidence: about one database.
    """
    known = {name for name, p in evidence.predicates.items() if is_known(p, evidence)}
    groups: list[Group] = []
    for template in templates:
        names = frozenset(a.predicate for a in template.formula.atoms) - known
        if not names or not template.weights.any():
            continue
        touched = [g for g in groups if g.open & names]
        merged = [t for g in touched for t in g.templates]
        groups = [g for g in groups if not g.open & names]
        groups.append(Group((*merged, template), names.union(*(g.open for g in touched))))
    return groups


def separators_of(group: Group, predicates: Mapping[str, Predicate]) -> tuple[Separator, ...]:
    """Separators of a group that have no argument in common.

    Args:
        group: of formulas.
        predicates: by name.
    """
    chosen: list[Separator] = []
    start = open_atoms(group, group.templates[0])[0]
    for term in dict.fromkeys(start.arguments):
        found = _separator(group, start, term, predicates)
        if found is not None and all(found.at[name] != s.at[name] for s in chosen for name in group.open):
            chosen.append(found)
    return tuple(chosen)


def open_atoms(group: Group, template: Template) -> list[AtomSchema]:
    """Atoms of predicates that are not wholly known."""
    return [a for a in template.formula.atoms if a.predicate in group.open]


def places_of(atom: AtomSchema, term: Argument, type_name: str, predicates: Mapping[str, Predicate]) -> tuple[int, ...]:
    """Arguments of an atom at which a term of some type stands."""
    types = predicates[atom.predicate].types
    return tuple(i for i, (a, t) in enumerate(zip(atom.arguments, types, strict=True)) if (a, t) == (term, type_name))


def _separator(
    group: Group, start: AtomSchema, term: Argument, predicates: Mapping[str, Predicate]
) -> Separator | None:
    """The separator that has a term of the first formula, if there is one."""
    type_name = predicates[start.predicate].types[start.arguments.index(term)]
    at = {start.predicate: start.arguments.index(term)}
    terms: dict[int, Argument] = {}
    n_before = -1
    while n_before < len(at) + len(terms):
        n_before = len(at) + len(terms)
        for i, template in enumerate(group.templates):
            if not _spread(i, open_atoms(group, template), type_name, at, terms, predicates):
                return None
    if any(predicates[name].value == place for name, place in at.items()):
        return None
    if not all(_separates(t, terms[i]) for i, t in enumerate(group.templates)):
        return None
    return Separator(type_name, at, tuple(terms[i] for i in range(len(group.templates))))


def _spread(
    number: int,
    atoms: Sequence[AtomSchema],
    type_name: str,
    at: dict[str, int],
    terms: dict[int, Argument],
    predicates: Mapping[str, Predicate],
) -> bool:
    """Draws what follows from one formula; false if that cannot be."""
    for atom in atoms:
        if atom.predicate in at:
            term = atom.arguments[at[atom.predicate]]
            if terms.setdefault(number, term) != term:
                return False
    for atom in atoms if number in terms else ():
        places = places_of(atom, terms[number], type_name, predicates)
        if atom.predicate not in at and len(places) == 1:
            at[atom.predicate] = places[0]
        if at.get(atom.predicate) not in places or (len(places) > 1 and isinstance(terms[number], Var)):
            return False
    return True


def _separates(template: Template, term: Argument) -> bool:
    """Whether a formula is about one constant at a time: its variable is free, and compared with few constants only."""
    if isinstance(term, Const):
        return True
    return not template.formula.variables[term.index].bound and compared_with(template, term) is not None


def compared_with(template: Template, term: Argument) -> set[int] | None:
    """The constants that a term is compared with, by name or as keys of rows; None if it is with a variable."""
    constants: set[int] = set()
    for part in parts_of(template.formula.body):
        if not isinstance(part, Equal) or term not in (part.left, part.right):
            continue
        other = part.right if part.left == term else part.left
        if isinstance(other, Const):
            constants.add(other.id)
        elif other.index in template.keys and template.rows is not None:
            constants |= set(template.rows[:, template.keys.index(other.index)].tolist())
        else:
            return None
    return constants
