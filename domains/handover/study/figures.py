"""Pictures of a survey: `Survey` and its statistics in, figures out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from mlnlite.domains.handover.show.figures import COLOURS
from mlnlite.domains.handover.study.analysis import Consensus, preference_counts
from mlnlite.domains.handover.study.keywords import KEYWORDS, Share
from mlnlite.domains.handover.study.preferences import published
from mlnlite.domains.handover.study.survey import METHODS, RANKED, RATED, Survey


def draw_preferences(survey: Survey) -> Figure:
    """Share of each preferred method by level."""
    counts = preference_counts(survey)
    share = 100 * counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    return _bars(dict(zip(METHODS, share.T, strict=True)), published().levels, "prefer the method [%]", survey.source)


def draw_ratings(survey: Survey) -> Figure:
    """Mean rating with its 95 % interval, by aspect, level and method."""
    figure = Figure(figsize=(12, 3.6))
    levels = np.array(survey.levels)
    for k, axis in enumerate(np.atleast_1d(figure.subplots(1, len(RATED), sharey=True))):
        for j, method in enumerate(METHODS):
            groups = [survey.ratings[levels == name, j, k] for name in published().levels]
            mean = [group.mean() if len(group) else np.nan for group in groups]
            error = [1.96 * group.std() / np.sqrt(max(len(group), 1)) if len(group) else 0.0 for group in groups]
            axis.errorbar(np.arange(len(groups)) + 0.12 * (j - 1), mean, error, fmt="o", capsize=3,
                          color=COLOURS[method], label=method)  # fmt: skip
        axis.set(title=RATED[k], xticks=range(len(published().levels)), xticklabels=published().levels, ylim=(1, 5))
    figure.axes[0].set_ylabel("rating, 1 to 5")
    figure.axes[-1].legend()
    figure.suptitle(survey.source, fontsize=8, y=1.02)
    return figure


def draw_ranks(found: Sequence[Consensus], source: str) -> Figure:
    """Median rank of each aspect by level, with bootstrap intervals."""
    figure = Figure(figsize=(8, 3.6))
    axis = figure.subplots()
    for i, one in enumerate(found):
        x = np.arange(len(RANKED)) + 0.15 * (i - 1.5)
        error = np.stack([one.medians - one.low, one.high - one.medians])
        axis.errorbar(x, one.medians, error, fmt="s", capsize=3, label=f"{one.level}, W {one.w:.2f}")
    axis.set(xticks=range(len(RANKED)), xticklabels=RANKED, ylabel="median rank, 1 is most important", title=source)
    axis.title.set_fontsize(8)
    axis.invert_yaxis()
    axis.legend()
    return figure


def draw_keywords(shares: Sequence[Share], source: str) -> Figure:
    """Share of people who name a keyword plainly, by level."""
    levels = list(dict.fromkeys(share.level for share in shares))
    series = {level: np.array([100 * s.plain for s in shares if s.level == level]) for level in levels}
    return _bars(series, list(KEYWORDS), "name it plainly [%]", source)


def _bars(series: dict[str, np.ndarray], ticks: Sequence[str], label: str, title: str) -> Figure:
    figure = Figure(figsize=(8, 3.6))
    axis = figure.subplots()
    width = 0.8 / max(len(series), 1)
    for i, (name, heights) in enumerate(series.items()):
        axis.bar(np.arange(len(ticks)) + width * (i - (len(series) - 1) / 2), heights, 0.92 * width,
                 color=COLOURS.get(name), label=name)  # fmt: skip
    axis.set(xticks=range(len(ticks)), xticklabels=ticks, ylabel=label, title=title)
    axis.title.set_fontsize(8)
    axis.legend()
    return figure
