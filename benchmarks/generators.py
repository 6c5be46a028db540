"""Networks of the kinds that the field measures itself on, of any size, as arrays and not as files."""

from __future__ import annotations

import numpy as np

import mlnlite as ml
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.model import Model
from mlnlite.model.symbols import Type

SMOKERS = """*Friends(person, person)
*Stress(person)
*Sport(person)
Smokes(person)
Cancer(person)
0.12 Friends(x, y) ^ Smokes(x) => Smokes(y)
1.6 Stress(x) => Smokes(x)
1.5 Sport(x) => !Smokes(x)
0.2 Smokes(x)
1.5 Smokes(x) => Cancer(x)
-0.4 Cancer(x)
"""

RIVALS = """*Friends(person, person)
*Rivals(person, person)
*Stress(person)
*Sport(person)
Smokes(person)
1.6 Stress(x) => Smokes(x)
1.5 Sport(x) => !Smokes(x)
0.2 Smokes(x)
"""

PULLS = "1.1 Friends(x, y) ^ Smokes(x) => Smokes(y)\n1.1 Rivals(x, y) ^ Smokes(x) => !Smokes(y)\n"
OPPOSES = "1.1 Friends(x, y) => (Smokes(x) <=> Smokes(y))\n1.1 Rivals(x, y) => !(Smokes(x) <=> Smokes(y))\n"


def evidence_of(model: Model, sizes: dict[str, int], facts: dict[str, np.ndarray]) -> Evidence:
    """Evidence of true facts: for each type how many constants, for each predicate rows of constant ids."""
    types = {
        name: t if t.constants else Type(name, tuple(f"{name[0].upper()}{i}" for i in range(sizes[name])))
        for name, t in model.types.items()
    }
    tables = {}
    for name, predicate in model.predicates.items():
        rows = _distinct(np.asarray(facts.get(name, np.empty((0, predicate.arity))), np.int64))
        tables[name] = Facts(np.zeros(len(rows), np.int32), rows, np.ones(len(rows), np.bool_))
    present = {name: np.ones((1, len(t.constants)), np.bool_) for name, t in types.items()}
    return Evidence(types, dict(model.predicates), tables, present)


def _distinct(rows: np.ndarray) -> np.ndarray:
    """Each row once, in rising order."""
    size = int(rows.max(initial=0)) + 1
    key = np.unique(rows @ (size ** np.arange(rows.shape[1])[::-1]))
    return np.stack([key // size**i % size for i in reversed(range(rows.shape[1]))], axis=1).astype(np.int32)


def smokers(n_people: int, n_friends: int = 10, seed: int = 0) -> tuple[Model, Evidence]:
    """Attractive: friends smoke alike. `2 n` atoms, about `(n_friends + 3) n` clauses."""
    rng = np.random.default_rng(seed)
    pairs = rng.integers(0, n_people, (n_people * n_friends // 2, 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    people = np.arange(n_people)[:, None]
    facts = {
        "Friends": np.concatenate([pairs, pairs[:, ::-1]]),
        "Stress": people[rng.random(n_people) < 0.5],
        "Sport": people[rng.random(n_people) < 0.4],
    }
    model = ml.model_from_text(SMOKERS)
    return model, evidence_of(model, {"person": n_people}, facts)


def rivals(
    n_people: int = 1000, degree: float = 4.0, share: float = 0.3, seed: int = 0, *, opposed: bool = False
) -> tuple[Model, Evidence]:
    """Frustrated: friends and rivals, both ways, at random. One atom for each person, of that mean degree.

    A friend of a smoker is to smoke, a rival of a smoker is not. `opposed`: a rival is to do the opposite, whatever
    that is, which is a spin glass in a random field.
    """
    rng = np.random.default_rng(seed)
    pairs = rng.integers(0, n_people, (int(n_people * degree / 2), 2))
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)
    rival = rng.random(len(pairs)) < share
    people = np.arange(n_people)[:, None]
    facts = {
        "Friends": np.concatenate([pairs[~rival], pairs[~rival][:, ::-1]]),
        "Rivals": np.concatenate([pairs[rival], pairs[rival][:, ::-1]]),
        "Stress": people[rng.random(n_people) < 0.5],
        "Sport": people[rng.random(n_people) < 0.4],
    }
    model = ml.model_from_text(RIVALS + (OPPOSES if opposed else PULLS))
    return model, evidence_of(model, {"person": n_people}, facts)


def entities(n: int = 100, noise: float = 0.05, hard: bool = True, seed: int = 0) -> tuple[Model, Evidence]:
    """Entity resolution: records of hidden entities, ten each, and similarities of which a share is wrong.

    `Same(x, y)` for every ordered pair, symmetric and transitive.
    """
    rng = np.random.default_rng(seed)
    entity = rng.integers(0, max(1, n // 10), n)
    same = entity[:, None] == entity[None, :]
    seen = np.triu(same ^ (rng.random((n, n)) < noise), 1)
    seen |= seen.T
    model = ml.model_from_text(
        "*Similar(record, record)\nSame(record, record)\n"
        "2.0 Similar(x, y) => Same(x, y)\n"
        "1.5 !Similar(x, y) => !Same(x, y)\n"
        "Same(x, y) => Same(y, x).\n"
        + ("" if hard else "1.0 ")
        + "Same(x, y) ^ Same(y, z) => Same(x, z)"
        + ("." if hard else "")
        + "\n"
    )
    facts = {"Similar": np.concatenate([np.argwhere(seen), np.stack([np.arange(n)] * 2, axis=1)])}
    return model, evidence_of(model, {"record": n}, facts)


def regions(n_objects: int = 32, n_regions: int = 6, share: float = 0.3, seed: int = 0) -> tuple[Model, Evidence]:
    """One region for each object; near objects want different regions, and some triples must not stand in a row."""
    rng = np.random.default_rng(seed)
    pairs = np.argwhere(np.triu(rng.random((n_objects, n_objects)) < share, 1))
    triples = np.array([rng.choice(n_objects, 3, replace=False) for _ in range(int(share * 4 * n_objects))])
    model = ml.model_from_text(
        "*Near(object, object)\n*Row(object, object, object)\n*Fits(object, region)\nAt(object, region!)\n"
        "1.2 Near(x, y) ^ At(x, r) => !At(y, r)\n"
        "2.0 Row(x, y, z) ^ At(x, r) ^ At(y, r) => At(z, r)\n"
        "0.9 Fits(x, r) => At(x, r)\n"
    )
    facts = {"Near": pairs, "Row": triples, "Fits": np.argwhere(rng.random((n_objects, n_regions)) < 0.4)}
    return model, evidence_of(model, {"object": n_objects, "region": n_regions}, facts)


def items(n_items: int = 1000, n_classes: int = 10, n_references: int = 3, seed: int = 0) -> tuple[Model, Evidence]:
    """One class for each item; items tend to share the class of those that they refer to, and words hint at classes."""
    rng = np.random.default_rng(seed)
    model = ml.model_from_text(
        "*Refers(item, item)\n*Hint(item, class)\nClass(item, class!)\n"
        "1.0 Refers(x, y) ^ Class(x, c) => Class(y, c)\n"
        "0.8 Hint(x, c) => Class(x, c)\n"
    )
    truth = rng.integers(0, n_classes, n_items)
    noisy = np.where(rng.random(n_items) < 0.3, rng.integers(0, n_classes, n_items), truth)
    pairs = rng.integers(0, n_items, (n_items * n_references, 2))
    facts = {
        "Refers": pairs[pairs[:, 0] != pairs[:, 1]],
        "Hint": np.concatenate(
            [
                np.stack([np.arange(n_items), noisy], axis=1),
                np.stack([np.arange(n_items), rng.integers(0, n_classes, n_items)], axis=1),
            ]
        ),
    }
    return model, evidence_of(model, {"item": n_items, "class": n_classes}, facts)
