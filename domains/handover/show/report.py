"""Tables over scenes: levels, objects and robots in, rows and Markdown out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mlnlite.domains.handover.scene.effort import Effort
from mlnlite.domains.handover.scene.mobility import read_levels
from mlnlite.domains.handover.scene.receiver import Body, read_receiver
from mlnlite.domains.handover.scene.scene import Scene, make_scene
from mlnlite.domains.handover.search.checks import five_checks, receiver_effort
from mlnlite.domains.handover.search.methods import METHODS, hand_over

PAPER = {"A": 39.0, "B": 20.0, "ours": 12.0}
"""Mean effort that the paper reports for its methods [N m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """One method on one scene.

    Attributes:
        robot: name.
        thing: name of the object.
        level: of mobility.
        method: `A`, `B` or `ours`.
        effort: of the receiver, or None if the place is out of reach or beyond their strength.
        failed: the first of the five checks that fails, `none found` without a configuration, or empty.
    """

    robot: str
    thing: str
    level: str
    method: str
    effort: Effort | None
    failed: str


def run_scene(scene: Scene, *, checks: bool = True) -> tuple[Row, ...]:
    """All methods on a scene."""
    rows = []
    for method in METHODS:
        found = hand_over(scene, method).configuration
        effort, failed = None, "none found"
        if found is not None:
            effort = receiver_effort(scene, found)
            effort = effort if effort is not None and effort.share <= 1.0 else None
            failed = next((c.name for c in five_checks(scene, found) if not c.passed), "") if checks else ""
        rows.append(Row(scene.robot.name, scene.thing.name, scene.receiver.level.name, method, effort, failed))
    return tuple(rows)


def run(objects: Iterable[str], robots: Iterable[str], body: Body, *, checks: bool = True) -> tuple[Row, ...]:
    """All methods on all objects, robots and levels, for the task `to_hand_over`."""
    robots = list(robots)
    scenes = (
        make_scene(thing, receiver=read_receiver(level, body), robot=robot)
        for thing in objects for robot in robots for level in read_levels()
    )  # fmt: skip
    return tuple(row for scene in scenes for row in run_scene(scene, checks=checks))


def pick(rows: Sequence[Row], method: str, level: str) -> tuple[Row, ...]:
    """Rows of a method at a level."""
    return tuple(row for row in rows if (row.method, row.level) == (method, level))


def common(rows: Sequence[Row], level: str) -> set[tuple[str, str]]:
    """Scenes of a level that are within reach under every method that reaches any, as pairs of object and robot."""
    reached = [{(r.thing, r.robot) for r in pick(rows, m, level) if r.effort is not None} for m in METHODS]
    return set.intersection(*([found for found in reached if found] or [set()]))


def effort_markdown(rows: Sequence[Row]) -> str:
    """Effort by level and method beside the paper's figures, over the scenes that every method reaches."""
    head = ("level", "method", "reachable", "scenes in the mean", "arm sum [N m]", "arm norm", "arm peak", "trunk",
            "arm and trunk", "largest share of strength", "paper [N m]")  # fmt: skip
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for level in dict.fromkeys(row.level for row in rows):
        both = common(rows, level)
        for method in METHODS:
            chosen = pick(rows, method, level)
            efforts = [r.effort for r in chosen if r.effort is not None and (r.thing, r.robot) in both]
            reached = sum(r.effort is not None for r in chosen)
            first = f"| {level} | {method} | {reached} of {len(chosen)} | {len(efforts)} "
            lines.append(f"{first}| {_means(efforts)} | {PAPER[method]:.0f} |")
    return "\n".join(lines) + "\n"


def _means(efforts: Sequence[Effort]) -> str:
    if not efforts:
        return "- | - | - | - | - | -"
    table = np.array([[e.arm, e.norm, e.peak, e.trunk, e.total, 100 * e.share] for e in efforts]).mean(axis=0)
    return " | ".join([*(f"{value:.1f}" for value in table[:5]), f"{table[5]:.0f} %"])


def checks_markdown(rows: Sequence[Row]) -> str:
    """How many scenes pass all five checks, and the first check that the others fail."""
    lines = ["| robot | level | method | all five pass | first failures |", "|---|---|---|---|---|"]
    for robot, level, method in dict.fromkeys((r.robot, r.level, r.method) for r in rows):
        chosen = [r for r in rows if (r.robot, r.level, r.method) == (robot, level, method)]
        failures = [r.failed for r in chosen if r.failed]
        counts = ", ".join(f"{name} {failures.count(name)}" for name in dict.fromkeys(failures))
        lines.append(
            f"| {robot} | {level} | {method} | {len(chosen) - len(failures)} of {len(chosen)} | {counts or '-'} |"
        )
    return "\n".join(lines) + "\n"
