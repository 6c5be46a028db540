"""Vocabulary to candidate rules: connected clauses `B1 ^ B2 => H`, each once up to the names of variables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from typing import TypeAlias

from mlnlite.learn.structure.modes import Mode
from mlnlite.model.symbols import Predicate, Type
from mlnlite.syntax import tree
from mlnlite.syntax.write import write_formula

Atom: TypeAlias = tuple[str, tuple[int | str, ...]]
"""A predicate, and the numbers of its variables, or constants."""

Rule: TypeAlias = tuple[tuple[Atom, ...], Atom]
"""Body and head."""

NEW = -1
"""A variable before it has a number."""


@dataclass(frozen=True, slots=True)
class Language:
    """What rules may say.

    Attributes:
        predicates: the vocabulary.
        types: with the constants that rules may name.
        heads: what atoms may look like that rules conclude.
        bodies: what atoms may look like that rules ask about.
    """

    predicates: Mapping[str, Predicate]
    types: Mapping[str, Type]
    heads: Sequence[Mode]
    bodies: Sequence[Mode]


def candidates(language: Language, most_literals: int = 2) -> list[Rule]:
    """Rules whose body literals hang together with the head, `most_literals` of them at most."""
    found: dict[object, Rule] = {}
    for mode in language.heads:
        for head, types in _heads(language, mode):
            for body, all_types in _bodies(language, (head, types), most_literals):
                rule = (body, head)
                found.setdefault(_canonical(rule, len(types), len(all_types)), rule)
    return list(found.values())


def _heads(language: Language, mode: Mode) -> Iterator[tuple[Atom, list[str]]]:
    """Heads, with the types of their variables."""
    of = language.predicates[mode.predicate].types
    options: list[Sequence[int | str]] = [
        language.types[t].constants if sign == "#" else (NEW,) for sign, t in zip(mode.signs, of, strict=True)
    ]
    for arguments in product(*options):
        yield _numbered(mode.predicate, arguments, of, [])


def _bodies(
    language: Language, start: tuple[Atom, list[str]], depth: int
) -> Iterator[tuple[tuple[Atom, ...], list[str]]]:
    """Bodies of up to `depth` literals, with the types of all variables."""
    head, types = start
    level: list[tuple[tuple[Atom, ...], list[str]]] = [((), types)]
    for _ in range(depth):
        longer = []
        for body, known in level:
            for mode in language.bodies:
                for atom, grown in _atoms(language, mode, known):
                    if atom != head and atom not in body:
                        longer.append(((*body, atom), grown))
        yield from longer
        level = longer


def _atoms(language: Language, mode: Mode, known: list[str]) -> Iterator[tuple[Atom, list[str]]]:
    """Atoms over known and new variables that share one (unless there is none to share)."""
    of = language.predicates[mode.predicate].types
    options: list[Sequence[int | str]] = []
    for sign, t in zip(mode.signs, of, strict=True):
        bound: list[int | str] = [v for v, found in enumerate(known) if found == t]
        options.append(language.types[t].constants if sign == "#" else bound + [NEW] * (sign == "-"))
    for arguments in product(*options):
        variables = [v for v in arguments if not isinstance(v, str)]
        if variables.count(NEW) <= mode.most_new and (set(variables) - {NEW} or not variables):
            yield _numbered(mode.predicate, arguments, of, known)


def _numbered(
    name: str, arguments: Sequence[int | str], types: Sequence[str], known: list[str]
) -> tuple[Atom, list[str]]:
    """An atom whose new variables have numbers, and the types of all variables."""
    found: list[int | str] = []
    grown = list(known)
    for argument, t in zip(arguments, types, strict=True):
        if argument == NEW:
            argument = len(grown)
            grown.append(t)
        found.append(argument)
    return (name, tuple(found)), grown


def _canonical(rule: Rule, first: int, n_variables: int) -> object:
    """The least of all ways to number the variables from `first` on, which the head does not have, the body sorted."""
    body, head = rule
    ways = []
    for order in permutations(range(first, n_variables)):
        number = [*range(first), *order]
        ways.append(
            sorted(
                (name, tuple((True, v) if isinstance(v, str) else (False, number[v]) for v in arguments))
                for name, arguments in body
            )
        )
    return tuple(min(ways)), head


def rule_text(rule: Rule, dialect: tree.Dialect = "standard") -> str:
    """A rule as a model writes it.

    >>> rule_text(((("Friends", (0, 1)), ("Smokes", (1,))), ("Smokes", (0,))))
    'Friends(x, y) ^ Smokes(y) => Smokes(x)'
    """
    body, head = rule
    names = ("x", "y", "z", "u", "v", "w")

    def atom(found: Atom) -> tree.Atom:
        terms = [tree.Constant(v) if isinstance(v, str) else tree.Variable(variable(v)) for v in found[1]]
        return tree.Atom(found[0], tuple(terms))

    def variable(number: int) -> str:
        return names[number] if number < len(names) else f"x{number}"

    atoms = tuple(map(atom, body))
    return write_formula(tree.Implies(atoms[0] if len(atoms) == 1 else tree.And(atoms), atom(head)), dialect)
