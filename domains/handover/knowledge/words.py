"""The vocabulary: the data files of this folder in, look-ups between the words of people, plugin and models out.

Levels and methods have the constants of the published data: `level_1` (high) to `level_4` (low), and `far` (A),
`midway` (B), `ours`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

import mlnlite as ml
from mlnlite.domains.handover.scene.objects import AFFORDANCES, CATEGORIES, MATERIALS, SHAPES, TEXTURES, HandoverObject
from mlnlite.domains.handover.tables import choose, read_table

FOLDER: Traversable = files("mlnlite.domains.handover.knowledge")
VARIANTS = ("handover", "backoff", "pairs", "paper", "affordance")
"""Models of this folder: the domain's own; the published words with lower-order templates, and with all pairs; the
authors' single conjunction; the templates of 2019."""
LEVELS = {"H": "level_1", "H-M": "level_2", "L-M": "level_3", "L": "level_4"}
METHODS = {"A": "far", "B": "midway", "ours": "ours"}
ASKED = ("graspRegion", "handover")
"""What is asked of a model."""


@lru_cache(maxsize=8)
def read_knowledge(variant: str = "handover") -> ml.Model:
    """A model of this folder, without weights.

    Raises:
        MlnError: unknown variant.
    """
    name = choose(variant, VARIANTS, "model")
    return ml.model_from_text((FOLDER / f"{name}.mln").read_text(encoding="utf-8"))


def known_predicates(model: ml.Model) -> tuple[str, ...]:
    """Predicates that facts tell all about: all but what is asked."""
    return tuple(name for name in model.predicates if name not in ASKED)


def vocabulary(model: ml.Model, n_regions: int = 9) -> dict[str, Sequence[str]]:
    """Constants that facts about any object may use, by type, for `mlnlite.compile`."""
    words: dict[str, Sequence[str]] = {
        "object": ("x",),
        "shape": SHAPES,
        "category": CATEGORIES,
        "material": MATERIALS,
        "texture": TEXTURES,
        "affordance": AFFORDANCES,
        "environment": sorted({place for places in _places() for place in places}),
        "role": tuple(roles_table()["roles"]),
        "region": [str(i + 1) for i in range(n_regions)],
        "level": tuple(LEVELS.values()),
        "method": tuple(METHODS.values()),
    }
    return {name: names for name, names in words.items() if name in model.types}


def _places() -> list[list[str]]:
    table = roles_table()
    return [*table["environments"].values(), *table["found"].values()]


def asked_predicates(model: ml.Model) -> tuple[str, ...]:
    """What can be asked of a model."""
    return tuple(name for name in ASKED if name in model.predicates)


@lru_cache(maxsize=1)
def roles_table() -> dict[str, Any]:
    """The table of roles and places."""
    return read_table(FOLDER / "roles.toml")


@lru_cache(maxsize=1)
def words_table() -> dict[str, Any]:
    """The table of phrases."""
    return read_table(FOLDER / "words.toml")


def role_of(thing: HandoverObject, region: str) -> str:
    """The role of a region of an object, by its name."""
    table = roles_table()
    own = table["objects"].get(thing.name, {})
    by_name = {name: role for role, names in table["names"].items() for name in names}
    return str(own.get(region, by_name.get(region, "body")))


def made_for(role: str, task: str) -> bool:
    """Whether parts of a role are made for a task."""
    return task in roles_table()["suits"].get(role, ())


def environments_of(thing: HandoverObject) -> tuple[str, ...]:
    """Where an object is found."""
    table = roles_table()
    return tuple(table["found"].get(thing.name, table["environments"][thing.category]))


def level_constant(level: str) -> str:
    """`level_4` of `L`.

    Raises:
        MlnError: unknown level.
    """
    return LEVELS[choose(level, LEVELS, "mobility level")]


def level_name(constant: str) -> str:
    """`L` of `level_4`."""
    return {v: k for k, v in LEVELS.items()}[constant]


def method_name(constant: str) -> str:
    """`A` of `far`."""
    return {v: k for k, v in METHODS.items()}[constant]
