"""Statistics of a survey: `Survey` in, tests with effect sizes out.

Level is a property of people and method is seen by all, so the design is mixed (split-plot): level between, method
within subjects. Ratings from 1 to 5 are ordinal, so rank tests stand beside the analysis of variance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pingouin
from numpy.typing import NDArray
from scipy.stats import friedmanchisquare, kruskal

from mlnlite.domains.handover.study.preferences import published
from mlnlite.domains.handover.study.survey import METHODS, RANKED, RATED, Survey


@dataclass(frozen=True, slots=True)
class Effect:
    """One line of a mixed analysis of variance.

    Attributes:
        aspect: what was rated.
        source: `level`, `method` or `Interaction`.
        dof: degrees of freedom of effect and error.
        f: statistic.
        p: by chance; for `method` with the sphericity correction, where there is one.
        eta2: partial eta squared.
    """

    aspect: str
    source: str
    dof: tuple[float, float]
    f: float
    p: float
    eta2: float


@dataclass(frozen=True, slots=True)
class Ordinal:
    """A rank test of ratings.

    Attributes:
        aspect: what was rated.
        test: `Friedman` (methods within a level) or `Kruskal` (levels within a method).
        group: the level or method.
        statistic: of the test.
        p: by chance, Holm-corrected over the survey.
        effect: Kendall's W, or epsilon squared.
    """

    aspect: str
    test: str
    group: str
    statistic: float
    p: float
    effect: float


@dataclass(frozen=True, slots=True, eq=False)
class Consensus:
    """How a level ranks the aspects.

    Attributes:
        level: of mobility.
        n: people.
        medians: of the rank of each aspect.
        low: 2.5 % bootstrap bound of each median.
        high: 97.5 % bound.
        w: Kendall's coefficient of concordance, 0 (none) to 1 (all agree).
        w_interval: its 95 % bootstrap interval.
    """

    level: str
    n: int
    medians: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    w: float
    w_interval: tuple[float, float]


def mixed_anova(survey: Survey) -> tuple[Effect, ...]:
    """Level (between) x method (within) for each rated aspect, over levels of several people.

    Nothing of an aspect that all rate alike, or if there are no two such levels.
    """
    several, out = _of_several(survey), list[Effect]()
    if len(set(several.levels)) < 2:
        return ()
    survey = several
    for k, aspect in enumerate(RATED):
        if not survey.ratings[:, :, k].std(axis=0).any():
            continue
        frame = pd.DataFrame({
            "participant": np.repeat(np.arange(survey.n), len(METHODS)),
            "level": np.repeat(np.array(survey.levels, dtype=object), len(METHODS)),
            "method": np.tile(np.array(METHODS, dtype=object), survey.n),
            "rating": survey.ratings[:, :, k].ravel().astype(np.float64),
        })  # fmt: skip
        table = pingouin.mixed_anova(
            frame, dv="rating", within="method", between="level", subject="participant", correction=True
        )
        out += [_effect(aspect, row) for row in table.to_dict("records")]
    return tuple(out)


def _of_several(survey: Survey) -> Survey:
    """The people of levels that have more than one."""
    chosen = [i for i, level in enumerate(survey.levels) if survey.levels.count(level) > 1]
    words = ([column[i] for i in chosen] for column in (survey.levels, survey.preferred, survey.comments))
    levels, preferred, comments = map(tuple, words)
    return Survey(survey.source, levels, preferred, survey.ratings[chosen], survey.ranks[chosen], comments)


def _effect(aspect: str, row: dict[str, object]) -> Effect:
    cells = {key.replace("-", "_"): value for key, value in row.items()}
    p = float(str(cells["p_unc"]))
    corrected = float(str(cells.get("p_GG_corr", "nan")))
    dof, f, eta2 = (
        (float(str(cells["DF1"])), float(str(cells["DF2"]))),
        float(str(cells["F"])),
        float(str(cells["np2"])),
    )
    return Effect(aspect, str(cells["Source"]), dof, f, p if np.isnan(corrected) else corrected, eta2)


def ordinal_check(survey: Survey) -> tuple[Ordinal, ...]:
    """Friedman's test of the methods within each level, Kruskal's of the levels within each method.

    Over levels of several people; no test of ratings that are all alike.
    """
    found: list[Ordinal] = []
    levels = np.array(survey.levels)
    names = [name for name in published().levels if (levels == name).sum() > 1]
    for k, aspect in enumerate(RATED):
        for name in names:
            columns = survey.ratings[levels == name, :, k].T
            if (columns == columns[0]).all():
                continue
            chi2, p = friedmanchisquare(*columns)
            found.append(Ordinal(aspect, "Friedman", name, float(chi2), float(p), float(chi2) / (2 * columns.shape[1])))
        for j, method in enumerate(METHODS):
            groups = [survey.ratings[levels == name, j, k] for name in names]
            if len(groups) < 2 or len(set(np.concatenate(groups).tolist())) < 2:
                continue
            h, p = kruskal(*groups)
            found.append(Ordinal(aspect, "Kruskal", method, float(h), float(p), float(h) / (survey.n - 1)))
    corrected = holm([one.p for one in found])
    return tuple(
        Ordinal(o.aspect, o.test, o.group, o.statistic, p, o.effect) for o, p in zip(found, corrected, strict=True)
    )


def holm(p: Sequence[float]) -> list[float]:
    """Holm's (1979) correction of p-values of one family; a p that is nan stays nan and does not count.

    >>> [round(x, 3) for x in holm([0.01, 0.04, 0.03])]
    [0.03, 0.06, 0.06]
    """
    known = [i for i in range(len(p)) if not np.isnan(p[i])]
    out, largest = list(p), 0.0
    for rank, i in enumerate(sorted(known, key=lambda i: p[i])):
        largest = max(largest, min(1.0, (len(known) - rank) * p[i]))
        out[i] = largest
    return out


def consensus(survey: Survey, *, seed: int = 0, n: int = 1000) -> tuple[Consensus, ...]:
    """Median ranks of each level with Kendall's W; intervals by `n` bootstrap samples of people."""
    rng, levels, out = np.random.default_rng(seed), np.array(survey.levels), []
    for level in published().levels:
        ranks = survey.ranks[levels == level]
        if not len(ranks):
            continue
        draws = ranks[rng.integers(len(ranks), size=(n, len(ranks)))]
        medians = np.median(draws, axis=1)
        low, high = np.percentile(medians, [2.5, 97.5], axis=0)
        w = np.percentile([kendall_w(draw) for draw in draws], [2.5, 97.5])
        out.append(Consensus(level, len(ranks), np.median(ranks, axis=0), low, high, kendall_w(ranks),
                             (float(w[0]), float(w[1]))))  # fmt: skip
    return tuple(out)


def kendall_w(ranks: NDArray[np.int64]) -> float:
    """Kendall's W of ranks without ties, shape (people, items): `12 S / (m^2 (n^3 - n))`."""
    people, items = ranks.shape
    sums = ranks.sum(axis=0)
    return float(12 * ((sums - sums.mean()) ** 2).sum() / (people**2 * (items**3 - items)))


def preference_counts(survey: Survey) -> NDArray[np.int64]:
    """How many of each level prefer each method, shape (levels, methods)."""
    told = list(zip(survey.levels, survey.preferred, strict=True))
    table = published()
    return np.array([[told.count((level, method)) for method in table.methods] for level in table.levels])


__all__ = ["RANKED", "Consensus", "Effect", "Ordinal", "consensus", "holm", "kendall_w", "mixed_anova",
           "ordinal_check", "preference_counts"]  # fmt: skip
