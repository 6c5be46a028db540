"""Questions: a learnt model, an object, a task and what is known of the receiver in, an answer with its reasons out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isclose
from pathlib import Path
from typing import Any, cast

import mlnlite as ml
from mlnlite.domains.handover.knowledge.facts import THING, Fact, fact_text, kept, level_facts, object_facts
from mlnlite.domains.handover.knowledge.reasons import Reason, reasons_for
from mlnlite.domains.handover.knowledge.words import (
    ASKED,
    LEVELS,
    METHODS,
    asked_predicates,
    known_predicates,
    method_name,
    role_of,
    vocabulary,
)
from mlnlite.domains.handover.scene.objects import HandoverObject
from mlnlite.domains.handover.study.preferences import level_shares, published
from mlnlite.domains.handover.tables import choose

Level = str | Mapping[str, float]
"""A mobility level; or a probability for each of several; or `unknown`: then as common as in the study."""


@dataclass(frozen=True, slots=True, eq=False)
class Knowledge:
    """A learnt model, ground once for all questions.

    Attributes:
        model: with weights.
        session: waits for facts.
    """

    model: ml.Model
    session: ml.Session


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Where and how, as the model sees it.

    Attributes:
        region: name of the part that the receiver needs; the robot holds elsewhere.
        role: of that part.
        method: `A`, `B` or `ours`.
        regions: probability of each region by name, most probable first.
        methods: probability of each method, most probable first.
        levels: what was assumed of the receiver.
        error: largest standard error of the probabilities; 0 if they are exact.
    """

    region: str
    role: str
    method: str
    regions: Mapping[str, float]
    methods: Mapping[str, float]
    levels: Mapping[str, float]
    error: float

    @property
    def confidence(self) -> float:
        """Probability of the region times that of the method."""
        return self.regions[self.region] * self.methods[self.method]


def open_knowledge(model: ml.Model) -> Knowledge:
    """Prepares a learnt model for questions.

    Raises:
        MlnError: the model does not speak of `graspRegion` and `handover`.
    """
    for name in ASKED:
        if name not in model.predicates:
            raise ml.MlnError(f"the model says nothing of {name}", hint="train one of the models of `read_knowledge`")
    known = known_predicates(model)
    session = ml.compile(model, query=asked_predicates(model), evidence_predicates=known, constants=vocabulary(model))
    return Knowledge(model, session)


def ask(knowledge: Knowledge, thing: HandoverObject, task: str, level: Level = "H") -> Answer:
    """The most probable region and method for an object, known or never seen.

    Uncertain levels count as Jeffrey (1965) has it: the answers for each level, mixed by their probabilities.

    Raises:
        MlnError: a task that the object does not afford, an unknown level, probabilities that do not sum to 1.
    """
    levels = level_distribution(level)
    facts = kept(object_facts(thing, task), knowledge.model.predicates)
    known = [(p, kept(facts + level_facts(name), knowledge.model.predicates)) for name, p in levels.items() if p > 0]
    found = [(p, knowledge.session.query(given)) for p, given in known]
    regions = {name: sum(p * q[f"graspRegion({THING}, {i + 1})"] for p, q in found)
               for i, name in enumerate(thing.regions)}  # fmt: skip
    methods = {m: sum(p * q[f"handover({THING}, {c})"] for p, q in found) for c, m in _methods(knowledge.model)}
    region, method = _best(regions), _best(methods)
    error = max(float(q.error.max()) for _, q in found)
    return Answer(region, role_of(thing, region), method, _ranked(regions), _ranked(methods), levels, error)


def certify(
    knowledge: Knowledge, thing: HandoverObject, task: str, level: Level, *, method: str = "auto"
) -> ml.MapState:
    """Region and method together as the most probable world, with a bound that proves it; for the likeliest level.

    Args:
        knowledge: of `open_knowledge`.
        thing: the object.
        task: what the receiver will do with it.
        level: of mobility.
        method: of `mlnlite.map_state`: `auto`, `wcsp` and so on.
    """
    facts = kept(object_facts(thing, task) + level_facts(likeliest(level)), knowledge.model.predicates)
    text = "".join(f"{fact_text(fact)}\n" for fact in facts)
    evidence = ml.evidence_from_text(text, model=knowledge.model)
    known = known_predicates(knowledge.model)
    return ml.map_state(knowledge.model, evidence, ASKED, closed_world=known, method=cast(Any, method))


def read_learnt(path: str | Path) -> Knowledge:
    """A model that `train` wrote, ready for questions.

    Raises:
        MlnError: no such file, or not a model of this domain.
    """
    return open_knowledge(ml.read_model(path))


def explain(knowledge: Knowledge, thing: HandoverObject, task: str, answer: Answer) -> tuple[Reason, ...]:
    """Why not the second best: see `reasons_for`. Where the level is uncertain, for the likeliest one."""
    facts = kept(object_facts(thing, task) + level_facts(likeliest(answer.levels)), knowledge.model.predicates)
    out: list[Reason] = []
    for predicate, ranked in (("graspRegion", answer.regions), ("handover", answer.methods)):
        names = list(ranked)[:2]
        if len(names) == 2:
            worlds = [_world(thing, facts, answer, predicate, name) for name in names]
            out += reasons_for(knowledge.model, facts, predicate, (names[0], names[1]), (worlds[0], worlds[1]))
    return tuple(out)


def level_distribution(level: Level) -> dict[str, float]:
    """A probability for each level that may be.

    Raises:
        MlnError: unknown level, or probabilities that do not sum to 1.
    """
    if level == "unknown":
        return dict(zip(published().levels, level_shares(published()).tolist(), strict=True))
    given = {level: 1.0} if isinstance(level, str) else dict(level)
    for name, p in given.items():
        choose(name, LEVELS, "mobility level")
        if not 0 <= p <= 1:
            raise ml.MlnError(f"the probability of level {name} is {p}", hint="give numbers from 0 to 1")
    if not isclose(sum(given.values()), 1.0, abs_tol=1e-6):
        raise ml.MlnError(f"the levels' probabilities sum to {sum(given.values()):g}", hint="let them sum to 1")
    return given


def likeliest(level: Level) -> str:
    """The most probable level."""
    levels = level_distribution(level)
    return max(levels, key=lambda name: levels[name])


def _methods(model: ml.Model) -> list[tuple[str, str]]:
    return [(constant, method_name(constant)) for constant in vocabulary(model)["method"]]


def _best(probabilities: Mapping[str, float]) -> str:
    return max(probabilities, key=lambda name: probabilities[name])


def _ranked(probabilities: Mapping[str, float]) -> dict[str, float]:
    return dict(sorted(probabilities.items(), key=lambda pair: -pair[1]))


def _world(thing: HandoverObject, facts: Sequence[Fact], answer: Answer, predicate: str, value: str) -> str:
    """The text of a world in which one of the answers is another."""
    region = value if predicate == "graspRegion" else answer.region
    method = value if predicate == "handover" else answer.method
    labels: tuple[Fact, ...] = (
        ("graspRegion", THING, str(thing.regions.index(region) + 1)),
        ("handover", THING, METHODS[method]),
    )
    return "".join(f"{fact_text(fact)}\n" for fact in (*facts, *labels))
