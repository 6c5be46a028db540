"""Labelled instances: objects and preferences in, rows of who gets what how out. No poses yet; those are in `poses.py`.

Two ways to label, because the paper does not say which it took:

* `sampled`: each row's method is drawn from the preferences of its level. No model can beat the Bayes ceiling.
* `preferred`: each row gets the method that most of its level prefer. A model of the level alone can be perfect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mlnlite.domains.handover.knowledge.facts import Fact, label_facts, level_facts, object_facts
from mlnlite.domains.handover.knowledge.words import METHODS
from mlnlite.domains.handover.scene.objects import HandoverObject, object_names, read_object, region_of
from mlnlite.domains.handover.study.preferences import Preferences, level_shares, published, shares
from mlnlite.domains.handover.tables import choose

Labels = Literal["sampled", "preferred"]
LABELS: tuple[Labels, ...] = ("sampled", "preferred")
N_SYNTHETIC = 1398
"""Rows of the paper's extension; with the 259 participants they make 1,657."""


@dataclass(frozen=True, slots=True)
class Instance:
    """One person who gets one object for one task.

    Attributes:
        source: `study`, a participant with one of the objects that were shown, or `synthetic`.
        thing: name of the object.
        task: what the receiver will do with it.
        level: of their mobility.
        method: `A`, `B` or `ours`: the label.
        region: number of the region that the receiver needs, from 1, as in the published data: the label.
    """

    source: str
    thing: str
    task: str
    level: str
    method: str
    region: int


def generate(labels: str = "sampled", *, seed: int = 0, n_synthetic: int = N_SYNTHETIC) -> tuple[Instance, ...]:
    """The 259 study rows, then synthetic rows spread evenly over the other objects.

    Study rows carry the exact published counts: 250 answers, and nine people without one whose method is drawn
    (`sampled`) or preferred. The object that a participant is taken to mean, and every task, are drawn evenly.

    Args:
        labels: `sampled` or `preferred`.
        seed: of the draws.
        n_synthetic: rows beyond the study.

    Raises:
        MlnError: unknown way to label.
    """
    choose(labels, LABELS, "way to label")
    rng, table = np.random.default_rng(seed), published()
    study = _study_rows(table, labels, rng)
    others = [name for name in object_names() if name not in table.objects]
    names = [others[i % len(others)] for i in range(n_synthetic)]
    levels = rng.choice(len(table.levels), n_synthetic, p=level_shares(table))
    rows = zip(names, levels.tolist(), strict=True)
    return (*study, *(_row("synthetic", n, i, _method(table, i, labels, rng), rng) for n, i in rows))


def _study_rows(table: Preferences, labels: str, rng: np.random.Generator) -> list[Instance]:
    rows = []
    for i, n in enumerate(table.participants.tolist()):
        told = np.repeat(np.arange(len(table.methods)), table.counts[i]).tolist()
        methods = [table.methods[m] for m in told] + [_method(table, i, labels, rng) for _ in range(n - len(told))]
        if labels == "preferred":
            methods = [_method(table, i, labels, rng)] * n
        rows += [_row("study", str(rng.choice(table.objects)), i, method, rng) for method in methods]
    return rows


def _method(table: Preferences, level: int, labels: str, rng: np.random.Generator) -> str:
    probabilities = shares(table)[level]
    chosen = rng.choice(len(probabilities), p=probabilities) if labels == "sampled" else probabilities.argmax()
    return table.methods[int(chosen)]


def _row(source: str, name: str, level: int, method: str, rng: np.random.Generator) -> Instance:
    thing = read_object(name)
    task = thing.affordances[int(rng.integers(len(thing.affordances)))][0]
    return Instance(source, name, task, published().levels[level], method, region_of(thing, task) + 1)


def instance_facts(instance: Instance, thing: HandoverObject | None = None) -> tuple[Fact, ...]:
    """All facts of an instance, its label among them."""
    thing = thing or read_object(instance.thing)
    known = object_facts(thing, instance.task) + level_facts(instance.level)
    return known + label_facts(instance.region, METHODS[instance.method])


def facts_of(instances: Sequence[Instance]) -> list[tuple[Fact, ...]]:
    """Facts of each instance."""
    return [instance_facts(instance) for instance in instances]
