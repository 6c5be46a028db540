"""Sections about unseen objects: splits in, Markdown out. Study rows and synthetic rows have tables of their own."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np

import mlnlite as ml
from mlnlite.domains.handover.evaluation.protocol import (
    MEASURES,
    MODELS,
    PAPER_TEST,
    TEMPLATE,
    Split,
    predictions,
    splits,
)
from mlnlite.domains.handover.instances.generate import Instance, facts_of
from mlnlite.domains.handover.knowledge.train import train
from mlnlite.domains.handover.knowledge.words import FOLDER, read_knowledge
from mlnlite.domains.handover.scene.objects import SHAPES
from mlnlite.domains.handover.study.preferences import bayes_ceiling, published

_INTRO = """22 objects train, 10 test. Mean over splits and the middle 95 % of them; the last line is one split, the
paper's own ten test objects. `pose` and `grasp` compare the cost model's poses for what was predicted
with those for the label, at 5 mm and 2 degrees. Every line but ours and the mean pose is there for
comparison; `ceiling` is the best that anyone could do who knows the region and, of the method, the
level's preference.
"""
_NOTES = f"""`{TEMPLATE}` takes, as the paper does, the mean pose of the shape context over the training objects for the
predicted method: the optima of different objects of one shape lie tens of degrees apart, so a mean is within tolerance
of nearly none of them. The roles of parts were written by us with the catalogue in view, and the catalogue gives the
labels; the table below says what they are worth. The label of the method depends on the level alone, as the study tells
no more, so who learns what each level prefers is at the ceiling; 100 % is what such labels allow, not what people would
say of unseen objects. The paper's test objects are {", ".join(PAPER_TEST)}; none of them was
shown in the study. What was predicted in each split is in `splits.parquet`.

![splits](splits.png)
"""
_SOURCES = {"synthetic": "synthetic rows", "study": "rows of the study"}


def protocol_section(found: Mapping[str, Sequence[Split]]) -> str:
    """The paper's protocol, repeated."""
    n = len(next(iter(found.values())))
    lines = [f"## Unseen objects: the paper's protocol over {n} splits", "", _INTRO]
    for labels, runs in found.items():
        ceiling = 100 * bayes_ceiling(published().counts) if labels == "sampled" else 100.0
        for source, words in _SOURCES.items():
            lines += [f"### Labels {labels}, {words}", "",
                      f"Bayes ceiling of the method over the study: {ceiling:.1f} %.", ""]  # fmt: skip
            lines += [*_table(runs, source), "", *_by_shape(runs, source), ""]
    return "\n".join([*lines, _NOTES])


def _table(runs: Sequence[Split], source: str) -> list[str]:
    lines = [f"| model | {' | '.join(MEASURES)} |", "|---" * (len(MEASURES) + 1) + "|"]
    for model in (*MODELS, TEMPLATE):
        cells = [over(runs, (model, measure, source, "all")) for measure in MEASURES]
        lines.append(f"| {model} | {' | '.join(cells)} |")
    if any(key[2] == source for key in runs[0].scores):
        cells = [over(runs[:1], ("ours", measure, source, "all")) for measure in MEASURES]
        lines.append(f"| ours, the paper's ten objects | {' | '.join(cells)} |")
    return lines


def over(runs: Sequence[Split], key: tuple[str, str, str, str]) -> str:
    """Mean share over splits with the middle 95 %, as text."""
    values = shares(runs, key)
    if not len(values):
        return "-"
    if len(values) == 1:
        return f"{values[0]:.1f} %"
    low, high = np.percentile(values, [2.5, 97.5])
    return f"{values.mean():.1f} % [{low:.1f}, {high:.1f}]"


def shares(runs: Sequence[Split], key: tuple[str, str, str, str]) -> np.ndarray:
    """Rows right of each split that has any [%]."""
    found = [run.scores[key] for run in runs if key in run.scores]
    return np.array([100 * right / n for right, n in found])


def _by_shape(runs: Sequence[Split], source: str) -> list[str]:
    measures = ("method", "region", "pose and grasp")
    head = " | ".join(f"{m} | ceiling" for m in measures)
    lines = [f"| shape context | {head} |", "|---" * (2 * len(measures) + 1) + "|"]
    for shape in SHAPES:
        cells = [over(runs, (model, m, source, shape)) for m in measures for model in ("ours", "ceiling")]
        if set(cells) != {"-"}:
            lines.append(f"| {shape} | {' | '.join(cells)} |")
    return lines


def ablation_of_roles(instances: Sequence[Instance], *, n: int = 8, workers: int = 2) -> str:
    """The region on unseen objects without parts of the knowledge."""
    lines = ["## What the knowledge is worth", "",
             f"Region right on unseen objects, labels preferred, synthetic rows, the first {n} splits; ceiling 100 %.",
             "", "| model | rows right |", "|---|---|"]  # fmt: skip
    jobs = [(name, test) for name in _VARIANTS for test in splits(n)]
    with ProcessPoolExecutor(workers) as pool:
        found = list(pool.map(partial(_regions_right, instances), *zip(*jobs, strict=True), chunksize=n))
    for name in _VARIANTS:
        values = [right for (other, _), right in zip(jobs, found, strict=True) if other == name]
        low, high = np.percentile(values, [2.5, 97.5])
        lines.append(f"| {name} | {100 * np.mean(values):.1f} % [{100 * low:.1f}, {100 * high:.1f}] |")
    return "\n".join(lines) + "\n"


_VARIANTS = ("handover.mln", "without what parts are made for", "roles only, without task, shape and category",
             "region numbers instead of roles (backoff.mln)")  # fmt: skip


def _variant(name: str) -> ml.Model:
    if name == _VARIANTS[3]:
        return read_knowledge("backoff")
    text = (FOLDER / "handover.mln").read_text(encoding="utf-8")
    if name != _VARIANTS[0]:
        text = text.replace("suits(o, r) ^ graspRegion(o, r)\n", "")
    if name == _VARIANTS[2]:
        text = re.sub(r"^\w+\(o, \+\w\) \^ hasPart.*\n", "", text, flags=re.MULTILINE)
    return ml.model_from_text(text)


def _regions_right(instances: Sequence[Instance], name: str, test: Sequence[str]) -> float:
    prior = 0.5 if name == _VARIANTS[3] else None
    learned = train(_variant(name), facts_of([row for row in instances if row.thing not in test]), prior=prior).model
    tests = [row for row in instances if row.thing in test and row.source == "synthetic"]
    answers = predictions(learned, sorted({(row.thing, row.task, row.level) for row in tests}))
    return float(np.mean([answers[row.thing, row.task, row.level][0] == row.region for row in tests]))
