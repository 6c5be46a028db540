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
from mlnlite.domains.handover.knowledge.facts import THING, Fact, kept
from mlnlite.domains.handover.knowledge.train import train
from mlnlite.domains.handover.knowledge.words import known_predicates

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
    """Probabilities by a Markov logic model, for each question; equal test rows are asked once.

    Args:
        model: without weights.
        prior: see `mlnlite.learn`; None for the domain's own.
        training: rows with labels.
        tests: rows to predict.
        questions: what is predicted.
    """
    instances = [(*row.known, *((name, THING, label) for name, label in row.labels)) for row in training]
    learned = train(model, instances, prior=prior).model
    known = known_predicates(learned)
    asked = [q.predicate for q in questions if q.predicate in learned.predicates]
    session = ml.compile(learned, query=asked, evidence_predicates=known, constants=_constants(learned, tests))
    answers: dict[tuple[Fact, ...], ml.Marginals] = {}
    for row in tests:
        facts = kept(row.known, known)
        if facts not in answers:
            answers[facts] = session.query(facts)
    found = [answers[kept(row.known, known)] for row in tests]
    return {q.predicate: np.array([[a.get(f"{q.predicate}({THING}, {c})", 0.0) for c in q.classes] for a in found])
            for q in questions if q.predicate in asked}  # fmt: skip


def _constants(model: ml.Model, tests: Sequence[Row]) -> dict[str, list[str]]:
    """Constants that the test rows use, by type."""
    out: dict[str, set[str]] = {}
    for row in tests:
        for name, *arguments in kept(row.known, known_predicates(model)):
            for kind, constant in zip(model.predicates[name].types, arguments, strict=True):
                out.setdefault(kind, set()).add(constant)
    return {kind: sorted(names) for kind, names in out.items()}
