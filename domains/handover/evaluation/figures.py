"""Pictures of the evaluation: splits, held-out predictions and grasp choices in, figures out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from mlnlite.domains.handover.evaluation.grasp_choice import Choice
from mlnlite.domains.handover.evaluation.metrics import reliability
from mlnlite.domains.handover.evaluation.protocol import MEASURES, MODELS, Split
from mlnlite.domains.handover.evaluation.protocol_tables import shares
from mlnlite.domains.handover.evaluation.real import OURS, HeldOut


def draw_protocol(found: Mapping[str, Sequence[Split]]) -> Figure:
    """Distribution over splits of what every model gets right on synthetic rows, one panel for each way to label."""
    figure = Figure(figsize=(11, 4.6))
    lines = [("ours", measure) for measure in MEASURES] + [(model, "pose and grasp") for model in MODELS[1:]]
    for axis, (labels, splits) in zip(
        np.atleast_1d(figure.subplots(1, len(found), sharey=True)), found.items(), strict=True
    ):
        values = [shares(splits, (model, measure, "synthetic", "all")) for model, measure in lines]
        axis.boxplot(values, orientation="horizontal", whis=(2.5, 97.5), showfliers=False)
        axis.set(title=f"labels {labels}", xlabel="synthetic rows right on 10 unseen objects [%]", xlim=(0, 102),
                 yticks=range(1, len(lines) + 1), yticklabels=[f"{model}, {measure}" for model, measure in lines],
                 )  # fmt: skip
    return figure


def draw_calibration(found: Sequence[HeldOut]) -> Figure:
    """Confidence against accuracy of our model and of pairwise logistic regression."""
    figure = Figure(figsize=(12, 3.2))
    for axis, one in zip(np.atleast_1d(figure.subplots(1, len(found), sharey=True)), found, strict=True):
        for name, colour in ((OURS, "#2f7f6f"), ("pairwise logistic", "#b5483a")):
            points = reliability(one.truth, one.found[name])
            axis.plot([p[0] for p in points], [p[1] for p in points], "o-", color=colour, label=name)
        axis.plot([0.3, 1], [0.3, 1], ":", color="grey")
        axis.set(title=f"{one.question.predicate}, {one.scheme}", xlabel="confidence", xlim=(0.3, 1), ylim=(0, 1))
    figure.axes[0].set_ylabel("accuracy")
    figure.axes[-1].legend(fontsize=8)
    return figure


def draw_grasps(choices: Sequence[Choice]) -> Figure:
    """Distance of the grasp from the object's centre, with and without the task."""
    figure = Figure(figsize=(11, 3.6))
    axis = figure.subplots()
    x = np.arange(len(choices))
    axis.plot(x, [100 * c.with_task for c in choices], "o", color="#2f7f6f", label="with the task")
    axis.plot(x, [100 * c.without for c in choices], "s", color="#b5483a", label="without")
    marks = ["*" if c.p < 0.05 else "" for c in choices]
    axis.set(xticks=x, ylabel="grasp from centre [cm] (* p < 0.05, Holm)")
    axis.set_xticklabels([f"{c.thing} {m}" for c, m in zip(choices, marks, strict=True)], rotation=70, fontsize=8)
    axis.legend()
    return figure
