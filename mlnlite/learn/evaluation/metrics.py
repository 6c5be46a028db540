"""Predicted distributions and labels to numbers that say how good the predictions are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]

SMALLEST = 1e-12
"""Probabilities below are taken as this in the log-loss, so that one impossible label does not hide all others."""

N_BINS = 10
"""Bins of the calibration."""


@dataclass(frozen=True, slots=True)
class Predictions:
    """Labels and their predicted distributions.

    Attributes:
        p: shape (n, n_values), probability of each value.
        label: shape (n,), the true value.
        binary: the labels are truth values, and p has two columns.
    """

    p: Float
    label: Int64
    binary: bool


@dataclass(frozen=True, slots=True)
class Calibration:
    """How often what is said with some confidence is so, in bins of equal width.

    Attributes:
        confidence: shape (n_bins,), mean predicted probability; nan for empty bins.
        share: shape (n_bins,), how often it was so.
        n: shape (n_bins,), how many labels.
    """

    confidence: Float
    share: Float
    n: Int64

    @property
    def error(self) -> float:
        """Expected calibration error: mean distance of the two, weighted by the bins (Naeini and others 2015)."""
        filled = self.n > 0
        return float((np.abs(self.confidence - self.share) * self.n)[filled].sum() / max(1, self.n.sum()))

    def __str__(self) -> str:
        """A plot for a terminal: `#` how often it was so, `|` how often it was said."""
        lines = ["  said    was so      n"]
        for confidence, share, n in zip(self.confidence, self.share, self.n.tolist(), strict=True):
            if n:
                bar = list(("#" * round(40 * share)).ljust(41))
                bar[round(40 * confidence)] = "|"
                lines.append(f"{confidence:6.3f}  {share:6.3f} {n:8,}  {''.join(bar).rstrip()}")
        return "\n".join(lines)


def hits(found: Predictions) -> NDArray[np.bool_]:
    """Whether the most probable value is the label."""
    return np.asarray(found.p.argmax(axis=1) == found.label)


def accuracy(found: Predictions) -> float:
    """Share of hits."""
    return float(hits(found).mean())


def balanced_accuracy(found: Predictions) -> float:
    """Mean over the label's values of the share that is hit."""
    n_values = np.bincount(found.label)
    seen = n_values > 0
    return float((np.bincount(found.label, hits(found))[seen] / n_values[seen]).mean())


def log_loss(found: Predictions) -> float:
    """Mean of `-log p(label)`, natural logarithm."""
    given = found.p[np.arange(len(found.label)), found.label]
    return float(-np.log(np.maximum(given, SMALLEST)).mean())


def brier(found: Predictions) -> float:
    """Mean of `(p - label)^2`, for blocks summed over the values (Brier 1950)."""
    squares = ((found.p - np.eye(found.p.shape[1])[found.label]) ** 2).sum(axis=1)
    return float(squares.mean()) / (2 if found.binary else 1)


def majority(found: Predictions) -> float:
    """Accuracy of always saying the most frequent label."""
    return float(np.bincount(found.label).max() / len(found.label))


def _pooled(found: Predictions) -> tuple[Float, NDArray[np.bool_]]:
    """Scores and truth of single statements: each atom, or each value of each block."""
    if found.binary:
        return found.p[:, 1], found.label == 1
    truth = np.arange(found.p.shape[1]) == found.label[:, None]
    return found.p.ravel(), truth.ravel()


def auc_roc(found: Predictions) -> float:
    """Chance that a true statement gets more than a false one, ties counting half; nan if all are alike."""
    score, truth = _pooled(found)
    n_true, n_false = int(truth.sum()), int((~truth).sum())
    if not n_true or not n_false:
        return float("nan")
    _, place, many = np.unique(score, return_inverse=True, return_counts=True)
    rank = (np.cumsum(many) - (many - 1) / 2)[place.reshape(-1)]
    return float((rank[truth].sum() - n_true * (n_true + 1) / 2) / (n_true * n_false))


def auc_pr(found: Predictions) -> float:
    """Average precision, equal scores being one step; nan if nothing is true."""
    score, truth = _pooled(found)
    if not truth.any():
        return float("nan")
    order = np.argsort(-score, kind="stable")
    last = np.flatnonzero(np.append(np.diff(score[order]) != 0, True))
    n_hit = np.cumsum(truth[order])[last]
    precision, recall = n_hit / (last + 1), n_hit / n_hit[-1]
    return float((np.diff(recall, prepend=0.0) * precision).sum())


def calibration(found: Predictions) -> Calibration:
    """How often what is said is so: of the truth of atoms, and of the most probable value of blocks."""
    said = found.p[:, 1] if found.binary else found.p.max(axis=1)
    so = (found.label == 1) if found.binary else hits(found)
    place = np.minimum((said * N_BINS).astype(np.int64), N_BINS - 1)
    n = np.bincount(place, minlength=N_BINS)
    with np.errstate(invalid="ignore"):
        confidence, share = (np.bincount(place, values, N_BINS) / n for values in (said, so))
    return Calibration(confidence, share, n)
