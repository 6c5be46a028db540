"""Models under comparison: training rows and test rows in, probabilities of the label of each test row out.

A row is what is known of it, as facts; a label is a constant. All models see the same facts.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import mlnlite as ml
from mlnlite.domains.handover.knowledge.facts import THING, Fact, about_receiver, gathered_text, kept
from mlnlite.domains.handover.knowledge.train import train
from mlnlite.domains.handover.knowledge.words import asked_predicates, known_predicates

Float = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Row:
    """What is known of something, and its labels by predicate, such as `handover`: `ours`."""

    known: tuple[Fact, ...]
    labels: tuple[tuple[str, str], ...]

    def label(self, predicate: str) -> str:
        """The label of a predicate."""
        return dict(self.labels)[predicate]


@dataclass(frozen=True, slots=True)
class Question:
    """What is predicted from what.

    Attributes:
        predicate: `graspRegion` or `handover`.
        classes: its constants.
        given: predicates that the baselines look at.
    """

    predicate: str
    classes: tuple[str, ...]
    given: tuple[str, ...]


def majority(training: Sequence[Row], tests: Sequence[Row], question: Question) -> Float:
    """Shares of the labels in training, whatever the row (plus one of each)."""
    return np.tile(_shares(Counter(row.label(question.predicate) for row in training), question), (len(tests), 1))


def lookup(training: Sequence[Row], tests: Sequence[Row], question: Question) -> Float:
    """Shares within the cell of equal facts; an unseen cell gets those of all (one pseudo-count in all)."""
    prior = majority(training, [training[0]], question)[0]
    cells: dict[tuple[Fact, ...], Counter[str]] = defaultdict(Counter)
    for row in training:
        cells[kept(row.known, question.given)][row.label(question.predicate)] += 1
    return np.array([_cell(cells.get(kept(row.known, question.given)), prior, question) for row in tests])


def _cell(counts: Counter[str] | None, prior: Float, question: Question) -> Float:
    found = np.array([(0 if counts is None else counts[c]) for c in question.classes], dtype=np.float64) + prior
    out: Float = found / found.sum()
    return out


def naive_bayes(training: Sequence[Row], tests: Sequence[Row], question: Question) -> Float:
    """Facts independent given the label; plus one of each."""
    values: dict[str, set[Fact]] = defaultdict(set)
    counts: dict[str, Counter[Fact]] = defaultdict(Counter)
    of_class = Counter(row.label(question.predicate) for row in training)
    for row in training:
        for fact in kept(row.known, question.given):
            values[fact[0]].add(fact)
            counts[row.label(question.predicate)][fact] += 1
    logs = np.tile(np.log(_shares(of_class, question)), (len(tests), 1))
    for i, row in enumerate(tests):
        for fact in kept(row.known, question.given):
            logs[i] += [np.log((counts[c][fact] + 1) / (of_class[c] + len(values[fact[0]]) + 1))
                        for c in question.classes]  # fmt: skip
    return _normalised(logs)


def _shares(counts: Mapping[str, int], question: Question) -> Float:
    found = np.array([counts.get(c, 0) + 1 for c in question.classes], dtype=np.float64)
    out: Float = found / found.sum()
    return out


def _normalised(logs: Float) -> Float:
    weights = np.exp(logs - logs.max(axis=1, keepdims=True))
    out: Float = weights / weights.sum(axis=1, keepdims=True)
    return out


def pairwise_text(question: Question) -> str:
    """Logistic regression on all facts and pairs of facts, as a Markov logic model."""
    atoms = {
        name: (f"{name}(+v_{name})" if name == "armMobility" else f"{name}(o, +v_{name})") for name in question.given
    }
    lines = [f"{name}(t_{name}?)" if name == "armMobility" else f"{name}(object, t_{name})" for name in question.given]
    target = f"{question.predicate}(o, +label)"
    lines += [f"{question.predicate}(object, label!)", target]
    singles = list(atoms.values())
    pairs = [f"{a} ^ {b}" for i, a in enumerate(singles) for b in singles[i + 1 :]]
    return "\n".join([*lines, *(f"{body} ^ {target}" for body in (*singles, *pairs))])


def logistic_pairwise(training: Sequence[Row], tests: Sequence[Row], question: Question) -> Float:
    """Logistic regression on facts and pairs, each weight with a Gaussian prior of standard deviation 1."""
    model = ml.model_from_text(pairwise_text(question))
    return predicted(model, 1.0, training, tests, (question,))[question.predicate]


def predicted(
    model: ml.Model, prior: float | None, training: Sequence[Row], tests: Sequence[Row], questions: Sequence[Question]
) -> dict[str, Float]:
    """Probabilities by a Markov logic model, for each question.

    Args:
        model: without weights.
        prior: see `mlnlite.learn`; None for the domain's own.
        training: rows with labels.
        tests: rows to predict.
        questions: what is predicted.
    """
    instances = [(*row.known, *((name, THING, label) for name, label in row.labels)) for row in training]
    found = answer_all(train(model, instances, prior=prior).model, [row.known for row in tests])
    return {q.predicate: np.array([[a[q.predicate].get(c, 0.0) for c in q.classes] for a in found])
            for q in questions if q.predicate in model.predicates}  # fmt: skip


def answer_all(model: ml.Model, instances: Sequence[Sequence[Fact]]) -> list[dict[str, dict[str, float]]]:
    """Of each instance the probability of each value of what is asked, by predicate.

    One inference answers all instances that share the facts about their receiver: no formula of the domain speaks of
    two objects. Equal instances are asked once.
    """
    known, asked = known_predicates(model), asked_predicates(model)
    groups: dict[tuple[Fact, ...], dict[tuple[Fact, ...], None]] = defaultdict(dict)
    rows = [kept(facts, known) for facts in instances]
    for facts in rows:
        groups[about_receiver(facts)][facts] = None
    answers: dict[tuple[Fact, ...], dict[str, dict[str, float]]] = {}
    for group in groups.values():
        evidence = ml.evidence_from_text(gathered_text(list(group)), model=model)
        found = ml.marginal(model, evidence, asked, closed_world=known)
        answers |= zip(group, _by_thing(found, len(group), asked), strict=True)
    return [answers[facts] for facts in rows]


def _by_thing(found: ml.Marginals, n: int, asked: Sequence[str]) -> list[dict[str, dict[str, float]]]:
    """Probabilities of atoms such as `handover(x7, ours)`, sorted by thing, predicate and value."""
    out: list[dict[str, dict[str, float]]] = [{name: {} for name in asked} for _ in range(n)]
    for atom, p in zip(found.names, found.probabilities.tolist(), strict=True):
        predicate, _, arguments = atom.rstrip(")").partition("(")
        thing, value = arguments.split(", ")
        out[int(thing.removeprefix(THING))][predicate][value] = p
    return out
