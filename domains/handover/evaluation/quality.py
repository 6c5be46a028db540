"""The handovers themselves: objects in, five checks, effort, reach and time of methods and of costs left out, out."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from time import process_time

import numpy as np

from mlnlite.domains.handover.scene.mobility import read_levels
from mlnlite.domains.handover.scene.scene import Scene, make_scene
from mlnlite.domains.handover.search.checks import CHECKS, five_checks, kept_distances, receiver_effort
from mlnlite.domains.handover.search.fields import Options
from mlnlite.domains.handover.search.methods import hand_over

VARIANTS: dict[str, tuple[str, Options]] = {
    "A": ("A", Options()),
    "B": ("B", Options()),
    "ours": ("ours", Options()),
    **{f"ours without {cost}": ("ours", Options(without=(cost,))) for cost in ("C_A", "C_S", "C_R")},
    "ours without the receiver's reach": ("ours", Options(receiver=False)),
    "ours without collisions": ("ours", Options(collisions=False)),
}
"""Methods, and ours with a cost or a constraint left out. Without C_A the grasp is arbitrary, without C_S the first
orientation will do, without C_R the safest voxel of the map is taken."""


@dataclass(frozen=True, slots=True)
class Result:
    """One configuration.

    Attributes:
        variant: of `VARIANTS`.
        robot: name.
        level: of mobility.
        found: whether there is a configuration.
        passed: checks that hold, by name.
        apart: C_A, distance of the robot's grasp from the receiver's region [m].
        safety: C_S, sum of the distances kept from hand and face [m].
        least: of these distances [m].
        effort: of the receiver's arm [N m]; nan if out of reach.
        reach: C_R, from the hand to where it takes the object [m].
        seconds: processor time of the search [s].
    """

    variant: str
    robot: str
    level: str
    found: bool
    passed: tuple[str, ...]
    apart: float
    safety: float
    least: float
    effort: float
    reach: float
    seconds: float


def measure(things: Sequence[str], robots: Sequence[str] = ("pr2", "panda"), *, workers: int = 2) -> tuple[Result, ...]:
    """All variants on objects, levels and robots."""
    work = partial(measured_of, tuple(robots))
    with ProcessPoolExecutor(workers) as pool:
        return tuple(result for part in pool.map(work, things) for result in part)


def measured_of(robots: tuple[str, ...], thing: str) -> list[Result]:
    """All variants of one object, at all levels, by some robots."""
    scenes = [make_scene(thing, receiver=level.name, robot=robot) for robot in robots for level in read_levels()]
    return [_result(scene, variant) for scene in scenes for variant in VARIANTS]


def _result(scene: Scene, variant: str) -> Result:
    method, options = VARIANTS[variant]
    start = process_time()
    found = hand_over(scene, method, options).configuration
    seconds, names = process_time() - start, (scene.robot.name, scene.receiver.level.name)
    if found is None:
        return Result(variant, *names, False, (), *(float("nan"),) * 5, seconds)
    effort = receiver_effort(scene, found)
    passed = tuple(check.name for check in five_checks(scene, found) if check.passed)
    arm, reach = float("nan") if effort is None else effort.arm, np.linalg.norm(found.human_grasp - scene.hand.position)
    kept = kept_distances(scene, found)
    return Result(variant, *names, True, passed, found.appropriateness, sum(kept), min(kept), arm, float(reach),
                  seconds)  # fmt: skip


def quality_section(results: Sequence[Result], n: int) -> str:
    """All variants together, then one line for each variant, robot and level, as Markdown."""
    variants = sorted({r.variant for r in results}, key=list(VARIANTS).index)
    whole = [_line((name,), [r for r in results if r.variant == name]) for name in variants]
    keys = dict.fromkeys((name, r.robot, r.level) for name in variants for r in results if r.variant == name)
    parts = [_line(key, [r for r in results if (r.variant, r.robot, r.level) == key]) for key in keys]
    return "\n".join([_QUALITY.format(n=n), *_head(("method",)), *whole, "", "### By robot and level", "",
                      *_head(("method", "robot", "level")), *parts, ""])  # fmt: skip


_QUALITY = """## Quality of the handovers

{n} objects, task `to_hand_over`: how many scenes pass each check, and means over the scenes that have the figure. `C_A`
is how far the robot's grasp is from the receiver's region, `C_S` the sum of the distances kept from hand and face,
`kept` the least of them, `C_R` how far the hand has to move, all in cm; effort of the arm in N m; processor time of the
search in ms (later levels of A and B find the work of the first one done). What a cost is worth shows in its column
beside `ours`; the least distance is also held up by the collision test, as a hand that waits must not be touched.
"""


def _head(keys: Sequence[str]) -> list[str]:
    names = (*keys, "scenes", "all five", *CHECKS, "C_A", "C_S", "kept", "C_R", "effort", "time p50 / p95")
    return [f"| {' | '.join(names)} |", "|---" * len(names) + "|"]


def _line(key: Sequence[str], chosen: Sequence[Result]) -> str:
    passed = [str(sum(name in r.passed for r in chosen)) for name in CHECKS]
    whole = sum(len(r.passed) == len(CHECKS) for r in chosen)
    lengths = [_mean([100 * getattr(r, name) for r in chosen]) for name in ("apart", "safety", "least", "reach")]
    times = np.percentile([1000 * r.seconds for r in chosen], [50, 95])
    cells = [*key, str(len(chosen)), str(whole), *passed, *lengths, _mean([r.effort for r in chosen])]
    return f"| {' | '.join(cells)} | {times[0]:.0f} / {times[1]:.0f} |"


def _mean(values: Sequence[float]) -> str:
    known = [value for value in values if np.isfinite(value)]
    return f"{np.mean(known):.1f}" if known else "-"
