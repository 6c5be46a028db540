"""Does the receiver's task change where the robot grasps? Objects in, a rank-sum test for each with its effect out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import mannwhitneyu

from mlnlite.domains.handover.scene.grasps import sample_grasps
from mlnlite.domains.handover.scene.objects import HandoverObject, region_of, region_points
from mlnlite.domains.handover.scene.robots import Gripper
from mlnlite.domains.handover.search.costs import appropriateness
from mlnlite.domains.handover.study.analysis import holm

N_GRASPS = 20
"""Grasps of each kind; the paper has 5, whose smallest possible p is 0.008."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Grasps of one object with and without the task.

    Attributes:
        thing: name of the object.
        with_task: median distance of the grasp from the object's centre [m]: the best by C_A, a draw of them.
        without: the same of grasps at random.
        free: share of grasps with the task that leave the receiver's region free, and of those without.
        p: two-sided rank-sum test of the distances, Holm-corrected over the objects; nan with too few grasps.
        effect: rank-biserial correlation, -1 to 1; positive if the task drives the grasp outwards.
    """

    thing: str
    with_task: float
    without: float
    free: tuple[float, float]
    p: float
    effect: float


def compare_grasps(things: list[HandoverObject], *, seed: int = 0) -> tuple[Choice, ...]:
    """All objects, each for its first task."""
    rng = np.random.default_rng(seed)
    found = [_choice(thing, rng) for thing in things]
    corrected = holm([one.p for one in found])
    return tuple(Choice(c.thing, c.with_task, c.without, c.free, p, c.effect)
                 for c, p in zip(found, corrected, strict=True))  # fmt: skip


def _choice(thing: HandoverObject, rng: np.random.Generator) -> Choice:
    grasps, region = sample_grasps(thing, Gripper()), region_of(thing, thing.affordances[0][0])
    if len(grasps.widths) < N_GRASPS:
        return Choice(thing.name, float("nan"), float("nan"), (float("nan"),) * 2, float("nan"), float("nan"))
    values = appropriateness(grasps.centres, region_points(thing, region))
    outside = (grasps.labels != region).all(axis=1)
    ranked = np.flatnonzero(outside)[np.argsort(-values[outside], kind="stable")]
    chosen, drawn = ranked[:N_GRASPS], rng.choice(len(values), N_GRASPS, replace=False)
    far = np.linalg.norm(grasps.centres, axis=1)
    test = mannwhitneyu(far[chosen], far[drawn], alternative="two-sided") if len(chosen) else None
    effect = 2 * test.statistic / (len(chosen) * N_GRASPS) - 1 if test else float("nan")
    median = float(np.median(far[chosen])) if len(chosen) else float("nan")
    p, free = float(test.pvalue) if test else float("nan"), (1.0, float(outside[drawn].mean()))
    return Choice(thing.name, median, float(np.median(far[drawn])), free, p, float(effect))
