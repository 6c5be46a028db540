"""The authors' rows: rows and a scheme in, held-out predictions of our model and of the baselines out.

Which templates and prior our model takes is chosen inside each training half, by an inner cross-validation that holds
out whole groups as the outer one does; the test half never plays a part.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from mlnlite.domains.handover.evaluation import models
from mlnlite.domains.handover.evaluation.metrics import log_loss
from mlnlite.domains.handover.evaluation.models import Float, Question, Row
from mlnlite.domains.handover.evaluation.published import LOOKS, PublishedRow, blocks, keys, known_facts, labels
from mlnlite.domains.handover.evaluation.schemes import grouped_folds
from mlnlite.domains.handover.knowledge.facts import Fact, kept
from mlnlite.domains.handover.knowledge.words import read_knowledge

_BASE = ("hasShape", "isA", "hasAffordance")
REGION = Question("graspRegion", ("1", "2", "3"), _BASE + LOOKS)
METHOD = Question("handover", ("far", "midway", "ours"), _BASE + LOOKS + ("armMobility",))
GRID: tuple[tuple[str, float], ...] = (("backoff", 0.1), ("backoff", 0.15), ("backoff", 0.3), ("pairs", 0.2),
                                       ("pairs", 0.4))  # fmt: skip
"""Templates and standard deviations of the prior that the inner cross-validation chooses from, for the method; the
region has the backoff templates under a hierarchical prior."""
BASELINES = {"majority": models.majority, "look-up table": models.lookup, "naive Bayes": models.naive_bayes,
             "pairwise logistic": models.logistic_pairwise}  # fmt: skip
OURS = "ours"
LEVELS = ("filled", "unknown where missing", "left out")
"""What to do about the 74 missing levels."""


@dataclass(frozen=True, slots=True, eq=False)
class HeldOut:
    """Held-out predictions of one question.

    Attributes:
        scheme: `key` or `block`.
        question: what was predicted.
        truth: class of each row, shape (n,).
        groups: what was held out together.
        folds: number of the fold that held each row out, shape (n,).
        found: probabilities by model, shape (n, classes).
        chosen: how often each entry of the grid was chosen.
        memory: accuracy of the best rule of the known facts on rows that it has seen.
    """

    scheme: str
    question: Question
    truth: np.ndarray
    groups: tuple[str, ...]
    folds: np.ndarray
    found: Mapping[str, Float]
    chosen: Mapping[str, int]
    memory: float


def rows_of(published: Sequence[PublishedRow], *, without: Collection[str] = (), levels: str = "filled") -> list[Row]:
    """Rows for the models, without some predicates; see `LEVELS`."""
    out = []
    for row in published:
        known = levels == "filled" or (levels == "unknown where missing" and not row.gap)
        facts = known_facts(row, without=without, level=known)
        out.append(Row(facts, tuple((name, value) for name, _, value in labels(row))))
    return out


def held_out(
    published: Sequence[PublishedRow],
    scheme: str,
    *,
    seed: int = 0,
    workers: int = 2,
    rows: Sequence[Row] | None = None,
) -> tuple[HeldOut, HeldOut]:
    """Ten-fold predictions of region and method, all models on the same folds.

    Args:
        published: the authors' rows.
        scheme: `key`, held-out combinations of shape, category and task; or `block`, held-out runs.
        seed: of the folds.
        workers: processes.
        rows: what the models see; by default everything.
    """
    rows = rows_of(published) if rows is None else rows
    groups = (keys if scheme == "key" else blocks)(published)
    folds = grouped_folds(groups, [row.method for row in published], seed=seed)
    work = partial(_fold, list(rows), groups)
    with ProcessPoolExecutor(workers) as pool:
        parts = list(pool.map(work, folds))
    return _gathered(scheme, REGION, rows, groups, parts), _gathered(scheme, METHOD, rows, groups, parts)


_Part = tuple[np.ndarray, dict[tuple[str, str], Float], dict[str, str]]


def _fold(rows: list[Row], groups: Sequence[str], test: np.ndarray) -> _Part:
    inside = set(test.tolist())
    training = [i for i in range(len(rows)) if i not in inside]
    halves = [rows[i] for i in training], [rows[i] for i in test]
    found = {(q.predicate, name): rival(*halves, q) for q in (REGION, METHOD) for name, rival in BASELINES.items()}
    chosen = _choose(halves[0], [groups[i] for i in training])
    variant, sd = chosen
    found |= {("handover", OURS): models.predicted(read_knowledge(variant), sd, *halves, (METHOD,))["handover"]}
    found |= {
        ("graspRegion", OURS): models.predicted(read_knowledge("backoff"), None, *halves, (REGION,))["graspRegion"]
    }
    return test, found, {"handover": f"{variant}, sd {sd:g}", "graspRegion": "backoff, hierarchical"}


def _choose(training: list[Row], groups: Sequence[str]) -> tuple[str, float]:
    """Of the grid, what has the least held-out log-loss for the method, by three inner folds."""
    folds = grouped_folds(groups, [row.label(METHOD.predicate) for row in training], n=3)
    losses = []
    for variant, sd in GRID:
        total = 0.0
        for test in folds:
            inside = set(test.tolist())
            fit = [row for i, row in enumerate(training) if i not in inside]
            held = [training[i] for i in test]
            answers = models.predicted(read_knowledge(variant), sd, fit, held, (METHOD,))
            total += len(held) * log_loss(_truth(held, METHOD), answers[METHOD.predicate])
        losses.append(total)
    return GRID[int(np.argmin(losses))]


def _truth(rows: Sequence[Row], question: Question) -> np.ndarray:
    return np.array([question.classes.index(row.label(question.predicate)) for row in rows])


def _gathered(
    scheme: str, question: Question, rows: Sequence[Row], groups: Sequence[str], parts: Sequence[_Part]
) -> HeldOut:
    found = {name: np.zeros((len(rows), len(question.classes))) for name in (*BASELINES, OURS)}
    chosen, folds = Counter[str](), np.zeros(len(rows), dtype=np.int64)
    for number, (test, answers, choice) in enumerate(parts):
        folds[test] = number
        for name, probabilities in found.items():
            probabilities[test] = answers[question.predicate, name]
        chosen[choice[question.predicate]] += 1
    return HeldOut(scheme, question, _truth(rows, question), tuple(groups), folds, found, chosen,
                   _memory(rows, question))  # fmt: skip


def _memory(rows: Sequence[Row], question: Question) -> float:
    """Share of rows that have the most frequent label of all rows with equal facts."""
    cells: dict[tuple[Fact, ...], Counter[str]] = defaultdict(Counter)
    for row in rows:
        cells[kept(row.known, question.given)][row.label(question.predicate)] += 1
    return sum(max(counts.values()) for counts in cells.values()) / len(rows)
