"""How good predictions are: labels and probabilities in, numbers with intervals out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Index = NDArray[np.int64]
_TINY = 1e-12


def accuracy(labels: Index, probabilities: Float) -> float:
    """Share of rows whose label is the most probable; ties share the credit. Shapes (n,), (n, classes)."""
    return float(credit(labels, probabilities).mean())


def credit(labels: Index, probabilities: Float) -> Float:
    """1 where the label is the single most probable, 1/k where it is one of k equals, else 0; shape (n,)."""
    top = probabilities >= probabilities.max(axis=1, keepdims=True) - 1e-9
    out: Float = top[np.arange(len(labels)), labels] / top.sum(axis=1)
    return out


def balanced_accuracy(labels: Index, probabilities: Float) -> float:
    """Mean over classes of the share of their rows that is right."""
    right = credit(labels, probabilities)
    return float(np.mean([right[labels == c].mean() for c in np.unique(labels)]))


def log_loss(labels: Index, probabilities: Float) -> float:
    """Mean of -log p(label) [nat]."""
    return float(losses(labels, probabilities).mean())


def losses(labels: Index, probabilities: Float) -> Float:
    """-log p(label) of each row, shape (n,) [nat]."""
    out: Float = -np.log(np.maximum(probabilities[np.arange(len(labels)), labels], _TINY))
    return out


def calibration_error(labels: Index, probabilities: Float, *, bins: int = 10) -> float:
    """Expected calibration error: mean gap between confidence and accuracy over bins of equal width."""
    confidence, right = probabilities.max(axis=1), credit(labels, probabilities)
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    gaps = [abs(confidence[place == b].sum() - right[place == b].sum()) for b in range(bins)]
    return float(sum(gaps) / len(labels))


def cluster_interval(values: Float, groups: Sequence[str], *, seed: int = 0, n: int = 2000) -> tuple[float, float]:
    """95 % interval of the mean of values, by bootstrap over whole groups.

    Args:
        values: shape (n,).
        groups: of each value; rows of a group are not independent.
        seed: of the draws.
        n: bootstrap samples.
    """
    names, place = np.unique(np.asarray(groups), return_inverse=True)
    sums, sizes = np.bincount(place, values), np.bincount(place)
    draws = np.random.default_rng(seed).integers(len(names), size=(n, len(names)))
    means = sums[draws].sum(axis=1) / sizes[draws].sum(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def balanced_interval(
    labels: Index, probabilities: Float, groups: Sequence[str], *, seed: int = 0, n: int = 2000
) -> tuple[float, float]:
    """95 % interval of the balanced accuracy, by bootstrap over whole groups; classes not drawn do not count."""
    names, place = np.unique(np.asarray(groups), return_inverse=True)
    right, classes = credit(labels, probabilities), np.unique(labels)
    sums = np.array([np.bincount(place[labels == c], right[labels == c], len(names)) for c in classes])
    sizes = np.array([np.bincount(place[labels == c], minlength=len(names)) for c in classes])
    draws = np.random.default_rng(seed).integers(len(names), size=(n, len(names)))
    drawn = sizes[:, draws].sum(axis=2)
    shares = np.where(drawn > 0, sums[:, draws].sum(axis=2) / np.maximum(drawn, 1), np.nan)
    low, high = np.percentile(np.nanmean(shares, axis=0), [2.5, 97.5])
    return float(low), float(high)


def reliability(labels: Index, probabilities: Float, *, bins: int = 8) -> tuple[tuple[float, float, int], ...]:
    """Confidence, accuracy and number of rows of each bin that has any."""
    confidence, right = probabilities.max(axis=1), credit(labels, probabilities)
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    return tuple((float(confidence[place == b].mean()), float(right[place == b].mean()), int((place == b).sum()))
                 for b in range(bins) if (place == b).any())  # fmt: skip
