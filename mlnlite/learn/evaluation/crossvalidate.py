"""Model and databases to honest scores: learn from some, predict others, compare with what knows no logic."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import QueryMistake, did_you_mean
from mlnlite.learn.evaluation import metrics
from mlnlite.learn.evaluation.baselines import BASELINES, UNKNOWN, duplicates
from mlnlite.learn.evaluation.evaluate import predictions, target_names, together
from mlnlite.learn.evaluation.folds import By, Row, fact_texts, folds, groups, strata, without_facts
from mlnlite.learn.evaluation.metrics import Predictions
from mlnlite.learn.learned import Objective
from mlnlite.learn.prior import PRIOR_SD, Prior
from mlnlite.learn.weights import learn
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.model.read import some_databases

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]

MODEL = "this model"
RESAMPLES = 2000


@dataclass(frozen=True, slots=True)
class Split:
    """How the databases are split.

    Attributes:
        by: `database`; `cluster`, equal databases together; `key`, databases with equal facts about `key` together;
            `constant`, databases that share constants of the types of `key` together.
        key: predicates, or types.
        n_folds: how many folds.
        repeats: how often, with other folds.
        seed: of the folds and of the bootstrap.
    """

    by: By = "database"
    key: tuple[str, ...] = ()
    n_folds: int = 10
    repeats: int = 1
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Training:
    """How the model is learnt in each fold; see `learn`."""

    objective: Objective | None = None
    open_predicates: tuple[str, ...] = ()
    prior: Prior | float | None = PRIOR_SD


@dataclass(frozen=True, slots=True)
class MethodScore:
    """One method on one predicate.

    Attributes:
        predicate: what is predicted.
        method: `this model`, or a baseline.
        n: number of labels.
        accuracy: share of hits, over all repeats.
        low: lower end of its 95 % interval (bootstrap over groups).
        high: upper end.
        balanced_accuracy: mean over the label's values.
        log_loss: natural logarithm.
        difference: accuracy of this model less that of the method, paired.
        difference_low: lower end of its 95 % interval.
        difference_high: upper end.
    """

    predicate: str
    method: str
    n: int
    accuracy: float
    low: float
    high: float
    balanced_accuracy: float
    log_loss: float
    difference: float
    difference_low: float
    difference_high: float


@dataclass(frozen=True, slots=True)
class CrossValidation:
    """Scores on databases that were not learnt from.

    Attributes:
        rows: one for each predicate and method.
        split: how.
        n_databases: number of databases.
        n_groups: number of groups that were kept together.
        warnings: what flatters.
    """

    rows: tuple[MethodScore, ...]
    split: Split
    n_databases: int
    n_groups: int
    warnings: tuple[str, ...]

    def __str__(self) -> str:
        """A table."""
        head = ("predicate", "method", "accuracy %", "95 % interval", "balanced %", "log-loss", "model better by")
        table = [head, *map(_cells, self.rows)]
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        lines = [
            "  ".join(c.ljust(w) if i < 2 else c.rjust(w) for i, (c, w) in enumerate(zip(r, widths, strict=True)))
            for r in table
        ]
        split = self.split
        way = {"database": "databases", "cluster": "distinct databases", "key": f"keys ({', '.join(split.key)})"}
        way["constant"] = f"groups that share no {' or '.join(split.key)}"
        n_folds = min(split.n_folds, self.n_groups)
        lines.append(
            f"{self.n_databases:,} databases, {self.n_groups:,} {way[split.by]} in {n_folds} folds, "
            f"{split.repeats} time{'s' * (split.repeats != 1)}"
        )
        return "\n".join([*(line.rstrip() for line in lines), *(f"warning: {w}" for w in self.warnings)])

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        split = {name: getattr(self.split, name) for name in Split.__slots__}
        rows = [{name: getattr(row, name) for name in MethodScore.__slots__} for row in self.rows]
        return {
            "split": {**split, "key": list(self.split.key)},
            "n_databases": self.n_databases,
            "n_groups": self.n_groups,
            "scores": rows,
            "warnings": list(self.warnings),
        }

    def to_json(self, indent: int | None = 2) -> str:
        """JSON text."""
        return json.dumps(self.to_dict(), indent=indent, allow_nan=False)


def _cells(row: MethodScore) -> tuple[str, ...]:
    interval = f"[{100 * row.low:.1f}, {100 * row.high:.1f}]"
    ends = f"[{100 * row.difference_low:+.1f}, {100 * row.difference_high:+.1f}]"
    better = "" if row.method == MODEL else f"{100 * row.difference:+.1f} {ends}"
    numbers = (f"{100 * row.accuracy:.1f}", interval, f"{100 * row.balanced_accuracy:.1f}", f"{row.log_loss:.4f}")
    return (row.predicate, row.method, *numbers, better)


def crossvalidate(
    model: Model,
    databases: Evidence,
    *,
    predict: Iterable[str],
    given: Iterable[str] | None = None,
    split: Split | None = None,
    training: Training | None = None,
) -> CrossValidation:
    """Learns from all folds but one, predicts that, and so on; baselines see the same conditions.

    Args:
        model: its weights are ignored, except fixed ones and hard formulas.
        databases: the data; each database is an instance.
        predict: predicates whose facts are the labels.
        given: predicates that may be looked at; by default all others.
        split: into folds.
        training: how the model is learnt.

    Raises:
        QueryMistake: if the arguments do not fit the data.
    """
    split, training = split or Split(), training or Training()
    targets = target_names(databases, predict)
    others = [n for n in databases.predicates if n not in targets]
    conditions = others if given is None else _conditions(databases, given, targets)
    group = groups(databases, split.by, _key(databases, split))
    databases = without_facts(databases, set(others) - set(conditions))
    if len(np.unique(group)) < 2 or split.n_folds < 2:
        raise QueryMistake("cross-validation needs at least two folds", "give more databases, or another --by")
    results, kind = [], strata(databases, targets)
    for repeat in range(split.repeats):
        fold = folds(group, kind, split.n_folds, np.random.default_rng([split.seed, repeat]))
        results.append(_predicted(model, databases, (targets, conditions), fold, training))
    rows = []
    for name in targets:
        rows += _rows(name, [r[name] for r in results], group, np.random.default_rng(split.seed))
    warnings = _warnings(databases, split)
    return CrossValidation(tuple(rows), split, databases.n_databases, len(np.unique(group)), warnings)


def _conditions(databases: Evidence, given: Iterable[str], targets: Sequence[str]) -> list[str]:
    names = list(dict.fromkeys(given))
    wrong = [n for n in names if n not in databases.predicates or n in targets]
    if wrong:
        raise QueryMistake(f"{wrong[0]} cannot be a condition: it is no predicate of the model, or it is predicted")
    return names


def _key(databases: Evidence, split: Split) -> tuple[str, ...]:
    what, known = ("type", databases.types) if split.by == "constant" else ("predicate", databases.predicates)
    for name in split.key:
        if name not in known:
            raise QueryMistake(f"there is no {what} {name} to hold out", did_you_mean(name, list(known)))
    if split.by in ("key", "constant") and not split.key:
        raise QueryMistake(f"name the {what}s to hold out")
    return split.key


def _warnings(databases: Evidence, split: Split) -> tuple[str, ...]:
    copies = duplicates(fact_texts(databases, databases.predicates))
    if split.by != "database" or not copies:
        return ()
    return (
        f"{copies:,} of {databases.n_databases:,} databases are copies of others, so test folds hold what was "
        "learnt from, and memory is rewarded: split by cluster, or hold out a key",
    )


# --- predictions of all methods, in every fold


@dataclass(frozen=True, slots=True)
class _Result:
    """What all methods say of one predicate.

    Attributes:
        database: shape (n,), of each label.
        of: predictions by method, rows in the same order.
    """

    database: Int64
    of: Mapping[str, Predictions]


def _predicted(
    model: Model, databases: Evidence, names: tuple[list[str], list[str]], fold: Int64, training: Training
) -> dict[str, _Result]:
    targets, conditions = names
    every: dict[int, dict[str, Predictions]] = {}
    for f in np.unique(fold).tolist():
        train, test = np.flatnonzero(fold != f), np.flatnonzero(fold == f)
        learned = learn(
            model,
            some_databases(databases, train),
            objective=training.objective,
            predict=targets,
            open_predicates=training.open_predicates,
            prior=training.prior,
        )
        closed = [n for n in conditions if n not in training.open_predicates]
        closed = [n for n in closed if databases.predicates[n].marker != "!"]
        data = some_databases(databases, test)
        for i, found in predictions(learned.model, data, targets, closed).items():
            every[int(test[i])] = found
    return {name: _result(databases, name, conditions, every, fold, training) for name in targets}


def _result(
    databases: Evidence,
    name: str,
    conditions: Sequence[str],
    every: Mapping[int, Mapping[str, Predictions]],
    fold: Int64,
    training: Training,
) -> _Result:
    numbers = sorted(i for i in every if name in every[i])
    predicate = databases.predicates[name]
    own = together(predicate, [every[i][name] for i in numbers])
    n_labels = [len(every[i][name].label) for i in numbers]
    database = np.repeat(np.array(numbers, np.int64), n_labels)
    features = _features(databases, conditions, training)
    rows = [features[i] for i in database.tolist()]
    of = {MODEL: own}
    for method, fit in BASELINES.items():
        p = np.zeros_like(own.p)
        for f in np.unique(fold).tolist():
            test = fold[database] == f
            known = [row for row, t in zip(rows, test.tolist(), strict=True) if not t]
            asked = [row for row, t in zip(rows, test.tolist(), strict=True) if t]
            p[test] = fit(known, own.label[~test], own.p.shape[1])(asked)
        of[method] = replace(own, p=p)
    return _Result(database, of)


def _features(databases: Evidence, conditions: Sequence[str], training: Training) -> list[Row]:
    """For each database, the facts of each condition predicate as one categorical value; empty if it is not known."""
    columns = []
    for name in conditions:
        missing = UNKNOWN if databases.predicates[name].marker == "!" or name in training.open_predicates else "none"
        columns.append([", ".join(facts) or missing for facts in fact_texts(databases, [name])])
    return [tuple(row) for row in zip(*columns, strict=True)] if columns else [()] * databases.n_databases


def _rows(name: str, results: Sequence[_Result], group: Int64, random: np.random.Generator) -> list[MethodScore]:
    """The scores of all methods; groups are drawn again and again, the same for all methods."""
    clusters, cluster = np.unique(group[results[0].database], return_inverse=True)
    draws = random.multinomial(len(clusters), np.full(len(clusters), 1 / len(clusters)), RESAMPLES)
    size = np.bincount(cluster.reshape(-1))
    hit: dict[str, Float] = {}
    for method in results[0].of:
        hits = np.mean([metrics.hits(r.of[method]) for r in results], axis=0)
        hit[method] = np.bincount(cluster.reshape(-1), hits).astype(float)
    rows = []
    for method in hit:
        found = [r.of[method] for r in results]
        share = (draws @ hit[method]) / (draws @ size)
        more = (draws @ (hit[MODEL] - hit[method])) / (draws @ size)
        rows.append(
            MethodScore(
                predicate=name,
                method=method,
                n=len(results[0].database),
                accuracy=float(hit[method].sum() / size.sum()),
                low=float(np.quantile(share, 0.025)),
                high=float(np.quantile(share, 0.975)),
                balanced_accuracy=float(np.mean([metrics.balanced_accuracy(p) for p in found])),
                log_loss=float(np.mean([metrics.log_loss(p) for p in found])),
                difference=float((hit[MODEL] - hit[method]).sum() / size.sum()),
                difference_low=float(np.quantile(more, 0.025)),
                difference_high=float(np.quantile(more, 0.975)),
            )
        )
    return rows
