"""The simulated world: tracks of hand and face in, eyes and an arm for the machine out; and many seeded runs of it.

Kinematic: the arm is where it was told to be, the object is in the gripper when it closes, and the person takes it
after a while if the offer lies within their reach.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from mlnlite.domains.handover.execution.guard import Rules, Shape, clearance
from mlnlite.domains.handover.execution.machine import Job, Run, Timing, execute
from mlnlite.domains.handover.execution.sockets import Sight
from mlnlite.domains.handover.execution.tracks import SCRIPTS, Eyes, Script, Track, at, scripted, seen
from mlnlite.domains.handover.kinematics.pose import FloatArray
from mlnlite.domains.handover.scene.objects import object_names, read_object
from mlnlite.domains.handover.scene.receiver import read_receiver
from mlnlite.domains.handover.scene.robots import read_robot
from mlnlite.domains.handover.scene.scene import Layout, Scene, make_scene

COARSE = Layout(counts=(9, 9, 9), step=0.05)
"""A map of the same extent as the default one, for planning while the person waits."""


@dataclass(frozen=True, slots=True)
class Case:
    """One simulated handover.

    Attributes:
        thing: object of the catalogue.
        task: what the receiver will do with it.
        level: of their mobility.
        method: what the knowledge base answers.
        robot: the giver.
        script: how the hand moves.
        seed: of all that is random.
    """

    thing: str = "mug"
    task: str = "to_hand_over"
    level: str = "H"
    method: str = "ours"
    robot: str = "pr2"
    script: Script = "still"
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedEyes:
    """Perception of a track."""

    sights: Sequence[Sight | None]
    step: float

    def look(self, time: float) -> Sight | None:
        """What was seen at the step before a time [s]."""
        return self.sights[min(int(time / self.step + 1e-9), len(self.sights) - 1)]


class SimulatedArm:
    """An arm that is where it was told to be; who waits before it pulls when their patience ends."""

    def __init__(self, home: FloatArray, steps: int) -> None:
        """Starts at home; the person pulls when the arm has held still for so many steps."""
        self._q, self._still, self._steps, self.closed = home, 0, steps, False

    def joints(self) -> FloatArray:
        """Configuration now, shape (n,) [rad]."""
        return self._q

    def move(self, q: FloatArray) -> None:
        """Goes there."""
        self._q, self._still = q, 0

    def grip(self, closed: bool) -> None:
        """Closes or opens the gripper."""
        self.closed = closed

    def pulled(self) -> bool:
        """Whether the person has waited long enough in front of a still arm."""
        self._still += 1
        return self._still >= self._steps


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a case.

    Attributes:
        case: what was simulated.
        end: `done` or `aborted`.
        cause: of an abort.
        time: when it ended [s], in the simulated world.
        replans: how many new plans.
        violations: steps that moved the robot to or from within the safety distance of the true hand or face.
        nearest: least true distance at a step that moved the robot [m].
        late: whether it outlasted its time limit.
    """

    case: Case
    end: str
    cause: str
    time: float
    replans: int
    violations: int
    nearest: float
    late: bool


def track_of(case: Case, scene: Scene) -> Track:
    """The true track of a case."""
    rng = np.random.default_rng([case.seed, SCRIPTS.index(case.script)])
    return scripted(case.script, scene.hand.position, scene.face.position, rng)


def simulate(
    case: Case, track: Track | None = None, *, eyes: Eyes | None = None, rules: Rules | None = None,
    timing: Timing | None = None,
) -> tuple[Run, Track]:  # fmt: skip
    """One run and the true track of it.

    Args:
        case: who, what, how.
        track: a recorded one; by default that of the script.
        eyes: how well is seen.
        rules: what the robot relies on.
        timing: limits.
    """
    scene = scene_at(case, None)
    track = track or track_of(case, scene)
    timing = timing or Timing()
    rng = np.random.default_rng([case.seed, 99])
    waiting = int(min(track.patience, 1e6) / timing.step)
    arm = SimulatedArm(scene.robot.home, max(1, waiting))
    job = Job(lambda: case.method, lambda sight: scene_at(case, sight),
              SimulatedEyes(seen(track, eyes or Eyes(), rng), track.step), arm, rules or Rules(), timing)  # fmt: skip
    return execute(job), track


def scene_at(case: Case, sight: Sight | None) -> Scene:
    """The scene of a case with the hand as seen, or at rest."""
    layout = COARSE if sight is None else replace(COARSE, hand=np.round(sight.hand, 3))
    scene = make_scene(
        read_object(case.thing), case.task, read_receiver(case.level), read_robot(case.robot), layout=layout
    )
    return scene


def judge(case: Case, run: Run, track: Track, rules: Rules | None = None, timing: Timing | None = None) -> Outcome:
    """Compares a run with the truth, which the machine never saw.

    Every step that moved the robot is looked at in five places along it, with hand and face where they truly were.
    """
    rules, timing = rules or Rules(), timing or Timing()
    nearest, violations = float("inf"), 0
    shape = run.plan.shape if run.plan is not None else None
    for before, after in zip(run.moments, run.moments[1:], strict=False):
        if shape is not None and not np.array_equal(before.q, after.q):
            least = _least(shape, (before.q, after.q), track, after.time, timing.step)
            nearest, violations = min(nearest, least), violations + (least < rules.limits.safety)
    return Outcome(case, run.end, run.cause, run.time, run.replans, violations, nearest, run.time > timing.whole)


def _least(shape: Shape, way: tuple[FloatArray, FloatArray], track: Track, start: float, step: float) -> float:
    found = []
    for share in np.linspace(0.0, 1.0, 5):
        time = start + share * step
        places = np.stack([at(track.hand, track.step, time), at(track.face, track.step, time)])
        found.append(clearance(shape, way[0] + share * (way[1] - way[0]), places))
    return min(found)


def random_cases(n: int, *, seed: int = 0, robots: Sequence[str] = ("pr2", "panda")) -> tuple[Case, ...]:
    """Cases with random objects, tasks, levels, methods and scripts."""
    rng, names = np.random.default_rng(seed), object_names()
    out = []
    for i in range(n):
        thing = read_object(str(rng.choice(names)))
        task = thing.affordances[int(rng.integers(len(thing.affordances)))][0]
        level, method = str(rng.choice(["H", "H-M", "L-M", "L"])), str(rng.choice(["ours", "ours", "ours", "B", "A"]))
        script = SCRIPTS[int(rng.integers(len(SCRIPTS)))]
        out.append(Case(thing.name, task, level, method, str(rng.choice(list(robots))), script, seed * 1_000_003 + i))
    return tuple(out)


def run_cases(cases: Sequence[Case], *, workers: int = 2) -> tuple[Outcome, ...]:
    """Simulates and judges cases."""
    if workers == 1:
        return tuple(map(outcome_of, cases))
    with ProcessPoolExecutor(workers) as pool:
        return tuple(pool.map(outcome_of, cases, chunksize=10))


def outcome_of(case: Case) -> Outcome:
    """Simulates and judges a case."""
    run, track = simulate(case)
    return judge(case, run, track)


def summary(outcomes: Sequence[Outcome]) -> str:
    """Counts of ends and causes, by script, as Markdown."""
    moved = [o.nearest for o in outcomes if np.isfinite(o.nearest)]
    lines = [
        f"{len(outcomes):,} simulated executions: {sum(o.end == 'done' for o in outcomes):,} done, "
        f"{sum(o.end == 'aborted' for o in outcomes):,} aborted; {sum(o.violations > 0 for o in outcomes)} with a "
        f"safety violation; {sum(o.late for o in outcomes)} beyond their time limit; nearest motion "
        f"{100 * min(moved, default=float('nan')):.1f} cm from hand or face; "
        f"{sum(o.replans for o in outcomes):,} new plans",
        "", "| script | done | aborted | causes |", "|---|---|---|---|",
    ]  # fmt: skip
    for script in SCRIPTS:
        chosen = [o for o in outcomes if o.case.script == script]
        causes = Counter(o.cause for o in chosen if o.cause).most_common()
        text = ", ".join(f"{cause} {n}" for cause, n in causes) or "-"
        ends = [sum(o.end == end for o in chosen) for end in ("done", "aborted")]
        lines.append(f"| {script} | {ends[0]} | {ends[1]} | {text} |")
    return "\n".join(lines) + "\n"
