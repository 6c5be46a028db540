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
Smokes(person)
*Likes(person)
0.9 Friends(x, y) => (Smokes(x) <=> Smokes(y))
1.1 Rivals(x, y) => !(Smokes(x) <=> Smokes(y))
0.7 Likes(x) => Smokes(x)
-0.3 Smokes(x)
"""


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


def rivals(n_people: int = 1000, degree: float = 4.0, share: float = 0.3, seed: int = 0) -> tuple[Model, Evidence]:
    """Frustrated: a share of the edges makes people differ. `n_people` atoms of that mean degree."""
    rng = np.random.default_rng(seed)
    pairs = rng.integers(0, n_people, (int(n_people * degree / 2), 2))
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)
    rival = rng.random(len(pairs)) < share
    facts = {
        "Friends": pairs[~rival],
        "Rivals": pairs[rival],
        "Likes": np.arange(n_people)[rng.random(n_people) < 0.4][:, None],
    }
    model = ml.model_from_text(RIVALS)
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
