"""The published preference table: counts in, shares, chi-square, Cramer's V and the Bayes ceiling out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2_contingency

from mlnlite.domains.handover.tables import read_table


@dataclass(frozen=True, slots=True, eq=False)
class Preferences:
    """How many people of each level prefer each method.

    Attributes:
        levels: names of the levels, highest mobility first.
        methods: names of the methods.
        counts: shape (levels, methods).
        participants: people of each level, those without a published preference included, shape (levels,).
        objects: those that were shown.
    """

    levels: tuple[str, ...]
    methods: tuple[str, ...]
    counts: NDArray[np.int64]
    participants: NDArray[np.int64]
    objects: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Association:
    """How a preference hangs together with a level.

    Attributes:
        chi2: Pearson's statistic.
        dof: its degrees of freedom.
        p: probability of as much by chance.
        cramers_v: effect size, 0 to 1.
    """

    chi2: float
    dof: int
    p: float
    cramers_v: float


@lru_cache(maxsize=1)
def published() -> Preferences:
    """The table of the paper."""
    table = read_table(files("mlnlite.domains.handover.study") / "preferences.toml")
    levels, methods = tuple(table["levels"]), ("A", "B", "ours")
    counts = np.array([[table["levels"][level][method] for method in methods] for level in levels])
    people = np.array([table["levels"][level]["participants"] for level in levels])
    for array in (counts, people):
        array.setflags(write=False)
    return Preferences(levels, methods, counts, people, tuple(table["objects"]["shown"]))


def shares(preferences: Preferences) -> NDArray[np.float64]:
    """Share of each method within its level, shape (levels, methods)."""
    out: NDArray[np.float64] = preferences.counts / preferences.counts.sum(axis=1, keepdims=True)
    return out


def level_shares(preferences: Preferences) -> NDArray[np.float64]:
    """Share of each level among those with a preference, shape (levels,)."""
    out: NDArray[np.float64] = preferences.counts.sum(axis=1) / preferences.counts.sum()
    return out


def association(counts: NDArray[np.int64]) -> Association:
    """Pearson's chi-square of a table of counts, and Cramer's V.

    >>> found = association(published().counts)
    >>> f"chi2({found.dof}) = {found.chi2:.1f}, V = {found.cramers_v:.2f}"
    'chi2(6) = 138.7, V = 0.53'
    """
    result = chi2_contingency(counts, correction=False)
    v = np.sqrt(result.statistic / (counts.sum() * (min(counts.shape) - 1)))
    return Association(float(result.statistic), int(result.dof), float(result.pvalue), float(v))


def bayes_ceiling(counts: NDArray[np.int64]) -> float:
    """Best possible accuracy of a guess of the method from the level.

    >>> f"{100 * bayes_ceiling(published().counts):.1f} %"
    '73.2 %'
    """
    return float(counts.max(axis=1).sum() / counts.sum())
