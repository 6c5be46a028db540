"""The handovers themselves: objects in, five checks, effort, reach and time of methods and of costs left out, out."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from time import process_time

import numpy as np

from mlnlite.domains.handover.checks import CHECKS, five_checks, receiver_effort
from mlnlite.domains.handover.costs import Limits
from mlnlite.domains.handover.fields import Options
from mlnlite.domains.handover.methods import hand_over
from mlnlite.domains.handover.mobility import read_levels
from mlnlite.domains.handover.scene import Scene, make_scene

VARIANTS: dict[str, tuple[str, Options]] = {
    "A": ("A", Options()),
    "B": ("B", Options()),
    "ours": ("ours", Options()),
    "ours without C_S": ("ours", Options(limits=Limits(safety=0.0))),
    "ours without the receiver's reach": ("ours", Options(receiver=False)),
    "ours without collisions": ("ours", Options(collisions=False)),
}
"""Methods, and ours with a part left out.
C_A is left out in A, whose grasp is arbitrary."""
SOME = ("mug", "bottle", "scissors", "book", "toothbrush", "bowl", "phone", "shoe")
"""Objects of all five shape contexts."""


@dataclass(frozen=True, slots=True)
class Result:
    """One configuration.

    Attributes:
        variant: of `VARIANTS`.
        robot: name.
        level: of mobility.
        found: whether there is a configuration.
        passed: checks that hold, by name.
        effort: of the receiver's arm [N m]; nan if out of reach.
        reach: C_R [m].
        seconds: processor time of the search [s].
    """

    variant: str
    robot: str
    level: str
    found: bool
    passed: tuple[str, ...]
    effort: float
    reach: float
    seconds: float


def measure(
    things: Sequence[str] = SOME, robots: Sequence[str] = ("pr2", "panda"), *, workers: int = 2
) -> tuple[Result, ...]:
    """All variants on objects, levels and robots."""
    work = partial(_measured, tuple(robots))
    with ProcessPoolExecutor(workers) as pool:
        return tuple(result for part in pool.map(work, things) for result in part)


def _measured(robots: tuple[str, ...], thing: str) -> list[Result]:
    scenes = [make_scene(thing, receiver=level.name, robot=robot) for robot in robots for level in read_levels()]
    return [_result(scene, variant) for scene in scenes for variant in VARIANTS]


def _result(scene: Scene, variant: str) -> Result:
    method, options = VARIANTS[variant]
    start = process_time()
    found = hand_over(scene, method, options).configuration
    seconds, names = process_time() - start, (scene.robot.name, scene.receiver.level.name)
    if found is None:
        return Result(variant, *names, False, (), float("nan"), float("nan"), seconds)
    effort = receiver_effort(scene, found)
    passed = tuple(check.name for check in five_checks(scene, found) if check.passed)
    return Result(variant, *names, True, passed, float("nan") if effort is None else effort.arm, found.reach, seconds)


def quality_table(results: Sequence[Result]) -> str:
    """One line for each variant, robot and level group, as Markdown."""
    head = (
        "| method | robot | level | scenes | all five | "
        + " | ".join(CHECKS)
        + " | arm effort [N m] | C_R [m] | time p50 / p95 [s] |"
    )
    lines = [head, "|---" * (9 + len(CHECKS) - 1) + "|"]
    keys = dict.fromkeys(
        (r.variant, r.robot, r.level) for r in sorted(results, key=lambda r: list(VARIANTS).index(r.variant))
    )
    for key in keys:
        chosen = [r for r in results if (r.variant, r.robot, r.level) == key]
        shares = [f"{sum(name in r.passed for r in chosen)}" for name in CHECKS]
        whole = sum(len(r.passed) == len(CHECKS) for r in chosen)
        effort, reach = ([getattr(r, n) for r in chosen if np.isfinite(getattr(r, n))] for n in ("effort", "reach"))
        times = np.percentile([r.seconds for r in chosen], [50, 95])
        cells = [*key, str(len(chosen)), str(whole), *shares, _mean(effort), _mean(reach)]
        lines.append(f"| {' | '.join(cells)} | {times[0]:.2f} / {times[1]:.2f} |")
    return "\n".join(lines)


def _mean(values: Sequence[float]) -> str:
    return f"{np.mean(values):.2f}" if values else "-"
