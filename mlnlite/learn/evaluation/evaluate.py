"""Model and labelled databases to scores: how well the model predicts labels that it is not shown."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, QueryMistake, did_you_mean
from mlnlite.infer.answer import marginal
from mlnlite.learn.data.content import content
from mlnlite.learn.data.missing import closed_but, every_atom, has_marks, marks_of
from mlnlite.learn.evaluation import metrics
from mlnlite.learn.evaluation.metrics import Calibration, Predictions
from mlnlite.learn.objectives.exact import without
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import closed
from mlnlite.model.model import Model
from mlnlite.model.read import one_database
from mlnlite.model.symbols import Predicate

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]


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
        auc_pr: average precision of single statements: each atom, or each value of each block; nan if none is true.
        auc_roc: chance that a true statement gets more than a false one; nan if all are alike.
        calibration_error: mean distance of what is said and how often it is so, in bins.
        majority: accuracy of always saying the most frequent label.
        calibration: the bins.
    """

    predicate: str
    unit: Literal["atoms", "blocks"]
    n: int
    accuracy: float
    balanced_accuracy: float
    log_loss: float
    brier: float
    auc_pr: float
    auc_roc: float
    calibration_error: float
    majority: float
    calibration: Calibration


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
        numbers = ("accuracy", "balanced", "log-loss", "Brier", "AUC-PR", "AUC-ROC", "calib.", "majority")
        head = ("predicate", "labels", *numbers)
        rows = [head, *map(_row, self.scores)]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join(_padded(row, widths)).rstrip() for row in rows]
        return "\n".join([*lines, f"{self.n_databases:,} database{'s' * (self.n_databases != 1)} with labels"])

    def to_dict(self) -> dict[str, object]:
        """Plain data; what is not a number is None."""
        return {"n_databases": self.n_databases, "scores": [_data(score) for score in self.scores]}

    def to_json(self, indent: int | None = 2) -> str:
        """JSON text."""
        return json.dumps(self.to_dict(), indent=indent, allow_nan=False)


def _data(score: Score) -> dict[str, object]:
    plain = {name: getattr(score, name) for name in Score.__slots__ if name != "calibration"}
    bins = score.calibration
    columns = {"confidence": bins.confidence.tolist(), "share": bins.share.tolist(), "n": bins.n.tolist()}
    numbers = {k: None if isinstance(v, float) and np.isnan(v) else v for k, v in plain.items()}
    return {**numbers, "calibration": {k: [None if x != x else x for x in v] for k, v in columns.items()}}


def _row(score: Score) -> tuple[str, ...]:
    names = ("accuracy", "balanced_accuracy", "log_loss", "brier", "auc_pr", "auc_roc", "calibration_error", "majority")
    numbers = [getattr(score, name) for name in names]
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
    targets = target_names(evidence, predicates)
    found = predictions(model, evidence, targets, closed_world)
    scores = []
    for name in targets:
        parts = [of[name] for of in found.values() if name in of]
        scores.append(_score(evidence.predicates[name], together(evidence.predicates[name], parts)))
    return Evaluation(tuple(scores), len(found))


def predictions(
    model: Model, evidence: Evidence, targets: Sequence[str], closed_world: Iterable[str] | Literal["all"] = "all"
) -> dict[int, dict[str, Predictions]]:
    """What is predicted of each database that has labels, by its number and the predicate. Arguments as `evaluate`."""
    others = [name for name in evidence.predicates if name not in targets]
    closing = set(_closable(evidence, others) if closed_world == "all" else closed_world)
    marked = has_marks(evidence) if (closing | set(targets)) & set(evidence.soft) else False
    evidence = closed(evidence, closing - set(evidence.soft) if marked else closing)
    explicit = {name for name in targets if not evidence.facts[name].truth.all()}
    found: dict[int, dict[str, Predictions]] = {}
    answers: dict[tuple[bytes, ...], Mapping[str, float]] = {}
    for i in np.unique(np.concatenate([evidence.facts[name].database for name in targets])).tolist():
        one, marks = marks_of(one_database(evidence, i)) if marked else (one_database(evidence, i), {})
        one = closed_but(one, closing & set(marks), marks)
        same = content(one, others)
        if same not in answers:
            answers[same] = marginal(model, without(one, targets), targets)
        answer = answers[same]
        found[i] = {
            name: _predictions(one, name, answer, marks.get(name), explicit=name in explicit)
            for name in targets
            if len(one.facts[name].truth)
        }
    return found


def together(predicate: Predicate, parts: Sequence[Predictions]) -> Predictions:
    """Predictions of several databases.

    Raises:
        QueryMistake: if there is no label.
    """
    label = np.concatenate([o.label for o in parts]) if parts else np.empty(0, np.int64)
    if not len(label):
        raise QueryMistake(f"no block of {predicate} has a value among the facts", "give its values as facts")
    return Predictions(np.concatenate([o.p for o in parts]), label, predicate.value is None)


def target_names(evidence: Evidence, predicates: Iterable[str]) -> list[str]:
    """The predicates, each once.

    Raises:
        QueryMistake: if there is none, or one is unknown or without facts.
    """
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


def _atoms(evidence: Evidence, predicate: Predicate) -> NDArray[np.int32]:
    """All atoms of a predicate in one database, shape (n, arity), block by block."""
    atoms = every_atom(evidence, predicate)
    if predicate.value is None:
        return atoms
    return atoms[np.lexsort([atoms[:, predicate.value], *(atoms[:, k] for k in reversed(predicate.keys))])]


def _truth(evidence: Evidence, name: str, atoms: NDArray[np.int32]) -> Float:
    """For each atom 1 or 0 if it is a fact, nan if not."""
    facts = evidence.facts[name]
    known = dict(zip(map(tuple, facts.arguments.tolist()), facts.truth.tolist(), strict=True))
    return np.array([known.get(tuple(row), np.nan) for row in atoms.tolist()], np.float64)


# --- one predicate in one database


def _predictions(
    evidence: Evidence, name: str, answer: Mapping[str, float], marks: Int64 | None, *, explicit: bool
) -> Predictions:
    """Labels of one database; the values of a block are its constants' ids, and after them "none".

    Atoms marked `?` have no label.
    """
    predicate = evidence.predicates[name]
    atoms = _atoms(evidence, predicate)
    p = np.array([answer[text] for text in evidence.atom_texts(evidence.atom_number(name, atoms))])
    truth = _truth(evidence, name, atoms)
    if not explicit:
        truth = np.nan_to_num(truth)
    if marks is not None:
        truth[np.isin(evidence.atom_number(name, atoms), marks)] = np.nan
    if predicate.value is None:
        known = ~np.isnan(truth)
        return Predictions(np.stack([1 - p, p], axis=1)[known], truth[known].astype(np.int64), binary=True)
    n_values = len(evidence.types[predicate.types[predicate.value]].constants)
    values = np.unique(atoms[:, predicate.value])
    p, truth = p.reshape(-1, len(values)), truth.reshape(-1, len(values))
    spread = np.zeros((len(p), n_values + 1))
    spread[:, values] = p
    spread[:, -1] = np.maximum(0.0, 1 - p.sum(axis=1))
    has_value = (truth == 1).any(axis=1)
    label = np.where(has_value, values[np.nan_to_num(truth).argmax(axis=1)], n_values)
    known = has_value | ((truth == 0).all(axis=1) & (predicate.marker == "?"))
    return Predictions(spread[known], label[known], binary=False)


def _score(predicate: Predicate, found: Predictions) -> Score:
    bins = metrics.calibration(found)
    return Score(
        predicate=predicate.name,
        unit="atoms" if found.binary else "blocks",
        n=len(found.label),
        accuracy=metrics.accuracy(found),
        balanced_accuracy=metrics.balanced_accuracy(found),
        log_loss=metrics.log_loss(found),
        brier=metrics.brier(found),
        auc_pr=metrics.auc_pr(found),
        auc_roc=metrics.auc_roc(found),
        calibration_error=bins.error,
        majority=metrics.majority(found),
        calibration=bins,
    )
