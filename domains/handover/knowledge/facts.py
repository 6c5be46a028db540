"""Facts: an object, a task and a level in, tuples of a predicate and its constants out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from mlnlite.domains.handover.knowledge.words import environments_of, level_constant, made_for, role_of
from mlnlite.domains.handover.scene.objects import HandoverObject, region_of

Fact = tuple[str, ...]
"""A predicate and its constants."""
THING = "x"
"""The constant that stands for the object of an instance, as in the published data."""


def object_facts(thing: HandoverObject, task: str) -> tuple[Fact, ...]:
    """What is known of an object about to be used for a task.

    Raises:
        MlnError: the object does not afford the task.
    """
    region_of(thing, task)
    looks: list[Fact] = [
        ("hasShape", THING, thing.shape),
        ("isA", THING, thing.category),
        ("hasMaterial", THING, thing.material),
        ("hasTexture", THING, thing.texture),
        ("hasAffordance", THING, task),
    ]
    looks += [("canBeFound", THING, place) for place in environments_of(thing)]
    roles = [(str(i + 1), role_of(thing, region)) for i, region in enumerate(thing.regions)]
    looks += [("hasPart", THING, number, role) for number, role in roles]
    return (*looks, *(("suits", THING, number) for number, role in roles if made_for(role, task)))


def level_facts(level: str | None) -> tuple[Fact, ...]:
    """The receiver's mobility, or nothing if it is unknown."""
    return () if level is None else (("armMobility", level_constant(level)),)


def label_facts(region: int, method: str) -> tuple[Fact, ...]:
    """The answer of an instance: region counted from 1, method as a constant of the models."""
    return ("graspRegion", THING, str(region)), ("handover", THING, method)


def kept(facts: Iterable[Fact], predicates: Iterable[str]) -> tuple[Fact, ...]:
    """The facts whose predicate a model knows."""
    names = frozenset(predicates)
    return tuple(fact for fact in facts if fact[0] in names)


def fact_text(fact: Fact) -> str:
    """`hasShape(x, cube)`."""
    return f"{fact[0]}({', '.join(fact[1:])})"


def databases_text(instances: Sequence[Sequence[Fact]]) -> str:
    """The text of a `.db` file with one database for each instance."""
    return "---\n".join("".join(f"{fact_text(fact)}\n" for fact in facts) for facts in instances)


def about_receiver(facts: Iterable[Fact]) -> tuple[Fact, ...]:
    """The facts that are not about the object."""
    return tuple(fact for fact in facts if THING not in fact[1:2])


def gathered_text(instances: Sequence[Sequence[Fact]]) -> str:
    """The same instances in few databases, those of equal level together, each about an object of its own.

    No formula of the domain speaks of two objects, so this says the same in less text.
    """
    groups: dict[tuple[Fact, ...], list[str]] = {}
    for i, facts in enumerate(instances):
        shared = about_receiver(facts)
        lines = groups.setdefault(shared, [f"{fact_text(fact)}\n" for fact in shared])
        lines += [f"{fact_text((fact[0], f'{THING}{i}', *fact[2:]))}\n" for fact in facts if fact not in shared]
    return "---\n".join("".join(lines) for lines in groups.values())
