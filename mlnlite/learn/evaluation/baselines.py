"""What any method has to beat: predictors that see the same conditions as single features and know no logic.

A predictor is fitted to rows of categorical features (one value for each condition predicate) and labels, and gives
the probabilities of each value of the label for other rows. A feature that is not known is left out: a look-up compares
what is known, naive Bayes and logistic regression have nothing to add for it.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import minimize
from scipy.special import log_softmax

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]

Row: TypeAlias = tuple[str, ...]
Predict: TypeAlias = Callable[[Sequence[Row]], Float]
Fit: TypeAlias = Callable[[Sequence[Row], Int64, int], Predict]

UNKNOWN = ""
"""The value of a feature that is not known."""

SPREAD = 0.55
"""Standard deviation of the prior of the weights of logistic regression."""

SMOOTHING = 1.0
"""Pseudo-counts shared by the values of the label, so that no value is impossible."""


def _smoothed(labels: Int64, n_values: int, prior: Float) -> Float:
    return np.asarray((np.bincount(labels, minlength=n_values) + SMOOTHING * prior) / (len(labels) + SMOOTHING))


def majority(rows: Sequence[Row], labels: Int64, n_values: int) -> Predict:
    """The frequencies of the labels, whatever the row."""
    share = _smoothed(labels, n_values, np.full(n_values, 1 / n_values))
    return lambda other: np.tile(share, (len(other), 1))


def look_up(rows: Sequence[Row], labels: Int64, n_values: int) -> Predict:
    """The frequencies among rows that are equal where the row is known, drawn to those of all by one pseudo-count."""
    share = _smoothed(labels, n_values, np.full(n_values, 1 / n_values))
    tables: dict[tuple[int, ...], dict[Row, Float]] = {}

    def table(columns: tuple[int, ...]) -> dict[Row, Float]:
        seen: dict[Row, list[int]] = defaultdict(list)
        for row, label in zip(rows, labels.tolist(), strict=True):
            seen[tuple(row[c] for c in columns)].append(label)
        return {row: _smoothed(np.array(found), n_values, share) for row, found in seen.items()}

    def one(row: Row) -> Float:
        known = tuple(c for c, value in enumerate(row) if value != UNKNOWN)
        if known not in tables:
            tables[known] = table(known)
        return tables[known].get(tuple(row[c] for c in known), share)

    return lambda other: np.array([one(row) for row in other]).reshape(-1, n_values)


def naive_bayes(rows: Sequence[Row], labels: Int64, n_values: int) -> Predict:
    """Features independent given the label, one pseudo-count for each value of each feature."""
    n_labels = np.bincount(labels, minlength=n_values).astype(float)
    tables: list[Mapping[str, Float]] = []
    for column in zip(*rows, strict=True):
        of_value: dict[str, Float] = defaultdict(lambda: np.zeros(n_values))
        for value, label in zip(column, labels.tolist(), strict=True):
            of_value[value][label] += 1
        of_value.pop(UNKNOWN, None)
        n_known = sum(of_value.values(), np.zeros(n_values))
        tables.append({v: np.log((n + 1) / (n_known + len(of_value))) for v, n in of_value.items()})
    start = np.log((n_labels + 1) / (n_labels.sum() + n_values))

    def predict(other: Sequence[Row]) -> Float:
        none = np.zeros(n_values)
        score = [start + sum((t.get(v, none) for t, v in zip(tables, row, strict=True)), none) for row in other]
        return np.asarray(np.exp(log_softmax(np.array(score).reshape(-1, n_values), axis=1)))

    return predict


def pairwise_logistic(rows: Sequence[Row], labels: Int64, n_values: int) -> Predict:
    """Multinomial logistic regression on single features and pairs of them; Gaussian prior."""
    from threadpoolctl import threadpool_limits  # BLAS threads make vectors of this size slower

    names = {name: i for i, name in enumerate(sorted({n for row in rows for n in _pairs(row)}))}
    inputs, present, precision = _one_hot(rows, names), np.unique(labels), SPREAD**-2
    target = np.eye(n_values)[labels][:, present]
    shape = (len(names) + 1, len(present))

    def loss(flat: Float) -> tuple[float, Float]:
        weights = flat.reshape(shape)
        scores = log_softmax(inputs @ weights[:-1] + weights[-1], axis=1)
        away = np.exp(scores) - target
        slope = np.vstack([inputs.T @ away + precision * weights[:-1], away.sum(axis=0)])
        return float(-(scores * target).sum() + 0.5 * precision * (weights[:-1] ** 2).sum()), slope.ravel()

    with threadpool_limits(1, "blas"):
        found = minimize(loss, np.zeros(shape[0] * shape[1]), jac=True, method="L-BFGS-B", options={"maxiter": 500})
    weights = np.asarray(found.x).reshape(shape)

    def predict(other: Sequence[Row]) -> Float:
        p = np.zeros((len(other), n_values))
        p[:, present] = np.exp(log_softmax(_one_hot(other, names) @ weights[:-1] + weights[-1], axis=1))
        return p

    return predict


def _pairs(row: Row) -> list[str]:
    single = [f"{i}={value}" for i, value in enumerate(row) if value != UNKNOWN]
    return [*single, *(f"{a}&{b}" for a, b in combinations(single, 2))]


def _one_hot(rows: Sequence[Row], names: Mapping[str, int]) -> sparse.csr_array:
    entries = [(r, names[n]) for r, row in enumerate(rows) for n in _pairs(row) if n in names]
    where = np.array(entries, np.int64).reshape(-1, 2)
    return sparse.csr_array((np.ones(len(where)), (where[:, 0], where[:, 1])), shape=(len(rows), len(names)))


BASELINES: Mapping[str, Fit] = {
    "majority": majority,
    "look-up table": look_up,
    "naive Bayes": naive_bayes,
    "pairwise logistic": pairwise_logistic,
}


def duplicates(keys: Sequence[object]) -> int:
    """Number of items that are a copy of an earlier one."""
    return sum(n - 1 for n in Counter(keys).values())
