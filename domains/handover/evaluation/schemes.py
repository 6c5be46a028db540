"""Folds: groups and labels in, test rows of each fold out. A group is never in both halves of a fold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.int64]


def grouped_folds(groups: Sequence[str], labels: Sequence[str], *, n: int = 10, seed: int = 0) -> tuple[Index, ...]:
    """Test rows of `n` folds: whole groups, in random order, each to the fold that keeps the labels most even.

    Args:
        groups: of each row.
        labels: of each row; the folds get like shares of each.
        n: how many folds.
        seed: of the order.
    """
    rng = np.random.default_rng(seed)
    names = sorted(set(labels))
    counts = {g: np.zeros(len(names)) for g in groups}
    for group, label in zip(groups, labels, strict=True):
        counts[group][names.index(label)] += 1
    order = [sorted(counts)[i] for i in rng.permutation(len(counts))]
    order.sort(key=lambda g: -counts[g].std())
    total = sum(counts.values(), np.zeros(len(names)))
    filled, fold_of = np.zeros((n, len(names))), {}
    for group in order:
        fold = _evenest(filled, counts[group], total)
        filled[fold] += counts[group]
        fold_of[group] = fold
    folds = np.array([fold_of[g] for g in groups])
    return tuple(np.flatnonzero(folds == fold) for fold in range(n))


def _evenest(filled: NDArray[np.float64], group: NDArray[np.float64], total: NDArray[np.float64]) -> int:
    """The fold after whose growth the shares of the labels differ least between folds."""
    costs = []
    for fold in range(len(filled)):
        grown = filled.copy()
        grown[fold] += group
        costs.append((float((grown / total).std(axis=0).mean()), float(filled[fold].sum()), fold))
    return min(costs)[2]
