"""Vocabulary to candidate rules: connected clauses `B1 ^ B2 => H`, each once up to the names of variables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations, product
from typing import TypeAlias

from mlnlite.model.symbols import Predicate

Atom: TypeAlias = tuple[str, tuple[int, ...]]
"""A predicate and the numbers of its variables."""

Rule: TypeAlias = tuple[tuple[Atom, ...], Atom]
"""Body and head."""


def candidates(
    predicates: Mapping[str, Predicate], heads: Sequence[str], bodies: Sequence[str], most_literals: int = 2
) -> list[Rule]:
    """Rules whose body literals hang together with the head, each bringing in at most one new variable.

    Args:
        predicates: the vocabulary.
        heads: predicates that rules conclude.
        bodies: predicates that rules may ask about.
        most_literals: of a body.
    """
    found: dict[Rule, Rule] = {}
    for name in heads:
        types = list(predicates[name].types)
        head = (name, tuple(range(len(types))))
        for body, all_types in _bodies(predicates, bodies, (head, types), most_literals):
            rule = (body, head)
            found.setdefault(_canonical(rule, len(all_types)), rule)
    return list(found.values())


def _bodies(
    predicates: Mapping[str, Predicate], names: Sequence[str], start: tuple[Atom, list[str]], depth: int
) -> Iterator[tuple[tuple[Atom, ...], list[str]]]:
    """Bodies of up to `depth` literals, with the types of all variables."""
    head, types = start
    level: list[tuple[tuple[Atom, ...], list[str]]] = [((), types)]
    for _ in range(depth):
        longer = []
        for body, known in level:
            for name in names:
                for atom, grown in _atoms(predicates[name], known):
                    if atom != head and atom not in body:
                        longer.append(((*body, atom), grown))
        yield from longer
        level = longer


def _atoms(predicate: Predicate, types: list[str]) -> Iterator[tuple[Atom, list[str]]]:
    """Atoms over known variables and at most one new one, sharing at least one (unless there is none to share)."""
    new = len(types)
    options = [[v for v, t in enumerate(types) if t == of] + [new] for of in predicate.types]
    for arguments in product(*options):
        fresh = {predicate.types[i] for i, v in enumerate(arguments) if v == new}
        shares = any(v < new for v in arguments) or not predicate.types
        if len(fresh) <= 1 and arguments.count(new) <= 1 and shares:
            yield (predicate.name, arguments), [*types, *fresh]


def _canonical(rule: Rule, n_variables: int) -> Rule:
    """The least of all ways to number the variables that the head does not have, the body sorted."""
    body, head = rule
    first = len(head[1])
    ways = []
    for order in permutations(range(first, n_variables)):
        number = [*range(first), *order]
        ways.append(tuple(sorted((name, tuple(number[v] for v in arguments)) for name, arguments in body)))
    return min(ways), head


def rule_text(rule: Rule) -> str:
    """A rule as a model writes it.

    >>> rule_text(((("Friends", (0, 1)), ("Smokes", (1,))), ("Smokes", (0,))))
    'Friends(x, y) ^ Smokes(y) => Smokes(x)'
    """
    body, head = rule
    names = ("x", "y", "z", "u", "v", "w")

    def text(atom: Atom) -> str:
        inside = ", ".join(names[v] if v < len(names) else f"x{v}" for v in atom[1])
        return f"{atom[0]}({inside})" if inside else atom[0]

    return f"{' ^ '.join(map(text, body))} => {text(head)}"
