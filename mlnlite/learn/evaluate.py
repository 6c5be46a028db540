"""Model and labelled databases to scores: how well the model predicts labels that it is not shown."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, QueryMistake, did_you_mean
from mlnlite.infer.answer import marginal
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.facts import closed
from mlnlite.model.model import Model
from mlnlite.model.read import one_database
from mlnlite.model.symbols import Predicate
from mlnlite.results import Marginals

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]

SMALLEST = 1e-12
"""Probabilities below are taken as this in the log-loss, so that one impossible label does not hide all others."""


@dataclass(frozen=True, slots=True)
class Score:
    """How well one predicate is predicted.

    Attributes:
        predicate: its name.
        unit: `atoms`, or `blocks` for a functional predicate: one choice among the values of each block.
        n: how many labels were compared.
        accuracy: share of labels that the most probable value hits.
        balanced_accuracy: mean over the label's values of the share that is hit.
        log_loss: mean of `-log p(label)`, natural logarithm.
        brier: mean of `(p - label)^2`, for blocks summed over the values.
        majority: accuracy of always saying the most frequent label.
    """

    predicate: str
    unit: Literal["atoms", "blocks"]
    n: int
    accuracy: float
    balanced_accuracy: float
    log_loss: float
    brier: float
    majority: float


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Scores of all predicates asked about.

    Attributes:
        scores: one for each predicate.
        n_databases: number of databases with labels.
    """

    scores: tuple[Score, ...]
    n_databases: int

    def __str__(self) -> str:
        """A table."""
        head = ("predicate", "labels", "accuracy", "balanced", "log-loss", "Brier", "majority")
        rows = [head, *map(_row, self.scores)]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join(_padded(row, widths)).rstrip() for row in rows]
        return "\n".join([*lines, f"{self.n_databases:,} database{'s' * (self.n_databases != 1)} with labels"])

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        names = Score.__slots__
        return {
            "n_databases": self.n_databases,
            "scores": [{name: getattr(score, name) for name in names} for score in self.scores],
        }

    def to_json(self, indent: int | None = 2) -> str:
        """JSON text."""
        return json.dumps(self.to_dict(), indent=indent, allow_nan=False)


def _row(score: Score) -> tuple[str, ...]:
    numbers = (score.accuracy, score.balanced_accuracy, score.log_loss, score.brier, score.majority)
    return (score.predicate, f"{score.n:,} {score.unit}", *(f"{x:.4f}" for x in numbers))


def _padded(row: Sequence[str], widths: Sequence[int]) -> Iterator[str]:
    yield row[0].ljust(widths[0])
    for cell, width in zip(row[1:], widths[1:], strict=True):
        yield cell.rjust(width)


def evaluate(
    model: Model,
    evidence: Evidence,
    *,
    predicates: Iterable[str],
    closed_world: Iterable[str] | Literal["all"] = "all",
) -> Evaluation:
    """Hides the facts about some predicates, asks for their marginals given the rest, and compares.

    Which atoms have a label: if some fact about the predicate in the evidence is negative (`!P(a)`), those that are
    facts; otherwise all atoms of every database that has a fact about it, those that are not facts being false. A
    block of a predicate `P(x, y!)` has a label if one of its values is a fact.

    Args:
        model: with weights.
        evidence: databases with labels.
        predicates: whose facts are the labels. They are hidden together.
        closed_world: predicates whose atoms are false unless they are facts; "all", as in learning: all others.

    Raises:
        QueryMistake: if there is no such predicate, or no label.
        LimitReached: if a marginal cannot be found within the limits.
    """
    targets = _targets(evidence, predicates)
    others = set(evidence.predicates) - set(targets)
    evidence = closed(evidence, _closable(evidence, others) if closed_world == "all" else closed_world)
    explicit = {name for name in targets if not evidence.facts[name].truth.all()}
    model = _without_zeros(model, evidence)
    outcomes: dict[str, list[_Outcomes]] = {name: [] for name in targets}
    answers: dict[bytes, Marginals] = {}
    labelled = np.unique(np.concatenate([evidence.facts[name].database for name in targets])).tolist()
    for i in labelled:
        one = one_database(evidence, i)
        hidden = _without(one, targets)
        key = _content(hidden)
        if key not in answers:
            answers[key] = marginal(model, hidden, targets)
        for name in targets:
            if len(one.facts[name].truth):
                outcomes[name].append(_outcomes(one, name, answers[key], explicit=name in explicit))
    return Evaluation(tuple(_score(evidence.predicates[name], outcomes[name]) for name in targets), len(labelled))


def _without_zeros(model: Model, evidence: Evidence) -> Model:
    """The model without formulas of weight 0, which change no probability; in a learnt template most do."""
    kept = []
    for template in (t.expanded(evidence.types) for t in model.templates):
        assert template.rows is not None
        rows = np.flatnonzero(template.weights != 0)
        if len(rows):
            kept.append(replace(template, rows=template.rows[rows], weights=template.weights[rows], row_spans=()))
    return replace(model, templates=tuple(kept))


def _content(evidence: Evidence) -> bytes:
    """What is known, as bytes: databases that say the same have the same answer."""
    facts = (array for f in evidence.facts.values() for array in (np.array(len(f.truth)), f.arguments, f.truth))
    return b"".join(array.tobytes() for array in (*facts, *evidence.present.values()))


def _targets(evidence: Evidence, predicates: Iterable[str]) -> list[str]:
    targets = list(dict.fromkeys(predicates))
    if not targets:
        raise QueryMistake("nothing is evaluated", "name the predicates whose facts are the labels")
    for name in targets:
        if name not in evidence.predicates:
            hint = did_you_mean(name, list(evidence.predicates))
            raise QueryMistake([Diagnostic("E510", f"there is no predicate {name} to evaluate", hint=hint)])
        if not len(evidence.facts[name].truth):
            hint = "give evidence that says what is true of it; it is hidden from the model"
            raise QueryMistake(
                [Diagnostic("E511", f"the evidence has no fact about {name} to compare with", hint=hint)]
            )
    return targets


def _closable(evidence: Evidence, names: Iterable[str]) -> list[str]:
    """Those of some predicates whose world can be closed: `P(x, y!)` always has a true value, known or not."""
    return [name for name in names if evidence.predicates[name].marker != "!"]


def _without(evidence: Evidence, names: Iterable[str]) -> Evidence:
    """The evidence without the facts of some predicates, whose worlds are open."""
    facts, predicates = dict(evidence.facts), dict(evidence.predicates)
    for name in names:
        predicate = predicates[name]
        facts[name] = Facts(np.empty(0, np.int32), np.empty((0, predicate.arity), np.int32), np.empty(0, np.bool_))
        predicates[name] = replace(predicate, closed=False)
    return replace(evidence, facts=facts, predicates=predicates)


def _atoms(evidence: Evidence, predicate: Predicate) -> NDArray[np.int32]:
    """All atoms of a predicate in one database, shape (n, arity), block by block."""
    present = [np.flatnonzero(evidence.present[t][0]).astype(np.int32) for t in predicate.types]
    atoms = np.stack(np.meshgrid(*present, indexing="ij"), axis=-1).reshape(-1, predicate.arity)
    if predicate.value is None:
        return atoms
    return atoms[np.lexsort([atoms[:, predicate.value], *(atoms[:, k] for k in reversed(predicate.keys))])]


def _truth(evidence: Evidence, name: str, atoms: NDArray[np.int32]) -> Float:
    """For each atom 1 or 0 if it is a fact, nan if not."""
    facts = evidence.facts[name]
    known = dict(zip(map(tuple, facts.arguments.tolist()), facts.truth.tolist(), strict=True))
    return np.array([known.get(tuple(row), np.nan) for row in atoms.tolist()], np.float64)


# --- one predicate in one database


@dataclass(frozen=True, slots=True)
class _Outcomes:
    """Labels and their predicted distributions.

    Attributes:
        p: shape (n, n_values), probability of each value.
        label: shape (n,), the true value.
    """

    p: Float
    label: Int64


def _outcomes(evidence: Evidence, name: str, answer: Mapping[str, float], *, explicit: bool) -> _Outcomes:
    """Labels of one database; the values of a block are its constants' ids, and after them "none"."""
    predicate = evidence.predicates[name]
    atoms = _atoms(evidence, predicate)
    p = np.array([answer[text] for text in evidence.atom_texts(evidence.atom_number(name, atoms))])
    truth = _truth(evidence, name, atoms)
    if not explicit:
        truth = np.nan_to_num(truth)
    if predicate.value is None:
        known = ~np.isnan(truth)
        return _Outcomes(np.stack([1 - p, p], axis=1)[known], truth[known].astype(np.int64))
    n_values = len(evidence.types[predicate.types[predicate.value]].constants)
    values = np.unique(atoms[:, predicate.value])
    p, truth = p.reshape(-1, len(values)), truth.reshape(-1, len(values))
    spread = np.zeros((len(p), n_values + 1))
    spread[:, values] = p
    spread[:, -1] = np.maximum(0.0, 1 - p.sum(axis=1))
    has_value = (truth == 1).any(axis=1)
    label = np.where(has_value, values[np.nan_to_num(truth).argmax(axis=1)], n_values)
    known = has_value | ((truth == 0).all(axis=1) & (predicate.marker == "?"))
    return _Outcomes(spread[known], label[known])


def _score(predicate: Predicate, found: Sequence[_Outcomes]) -> Score:
    p = np.concatenate([o.p for o in found])
    label = np.concatenate([o.label for o in found])
    if not len(label):
        raise QueryMistake(f"no block of {predicate} has a value among the facts", "give its values as facts")
    hit = p.argmax(axis=1) == label
    n_values = np.bincount(label, minlength=1)
    recalls = np.bincount(label, hit)[n_values > 0] / n_values[n_values > 0]
    given = p[np.arange(len(label)), label]
    brier = ((p - np.eye(p.shape[1])[label]) ** 2).sum(axis=1)
    return Score(
        predicate=predicate.name,
        unit="atoms" if predicate.value is None else "blocks",
        n=len(label),
        accuracy=float(hit.mean()),
        balanced_accuracy=float(recalls.mean()),
        log_loss=float(-np.log(np.maximum(given, SMALLEST)).mean()),
        brier=float(brier.mean()) / (2 if predicate.value is None else 1),
        majority=float(n_values.max() / len(label)),
    )
