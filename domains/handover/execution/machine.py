"""Algorithm 1 as a state machine: a task, eyes and an arm in, a run with its log out.

perceive -> infer -> plan -> grasp -> approach -> hold -> release -> done; from anywhere to abort -> aborted. Every
state has a time limit. In approach the machine plans anew when the hand has moved; in abort it goes back to where it
started, under the same safety distance, or stands still.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

import mlnlite as ml
from mlnlite.domains.handover.execution.guard import Rules, Shape, clearance, may_move
from mlnlite.domains.handover.execution.planning import Plan, make_plan
from mlnlite.domains.handover.execution.sockets import Arm, Perception, Sight
from mlnlite.domains.handover.kinematics.pose import FloatArray
from mlnlite.domains.handover.scene.scene import Scene

STATES = ("perceive", "infer", "plan", "grasp", "approach", "hold", "release", "abort", "done", "aborted")
Inference = Callable[[], str]
"""Asks the knowledge base: `A`, `B` or `ours`."""
SceneAt = Callable[[Sight], Scene]
"""The scene with hand and face as seen; raises `MlnError` where the receiver's arm cannot be so."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Times [s], and what else limits a run.

    Attributes:
        step: of the loop.
        think: that planning takes, during which the robot stands still.
        limits: of each state.
        joint_speed: of the fastest joint [rad/s].
        moved: a hand that has moved so far since the plan asks for a new one [m].
        replans: at most so many.
        blocked: standing still for so long asks for a new plan.
    """

    step: float = 0.02
    think: float = 0.25
    limits: tuple[tuple[str, float], ...] = (
        ("perceive", 3.0), ("infer", 1.0), ("plan", 4.0), ("grasp", 1.0), ("approach", 10.0), ("hold", 5.0),
        ("release", 1.0), ("abort", 5.0),
    )  # fmt: skip
    joint_speed: float = 1.0
    moved: float = 0.06
    replans: int = 4
    blocked: float = 1.0

    @property
    def whole(self) -> float:
        """No run takes longer: each state once, and again plan and approach for each new plan [s]."""
        again = sum(t for name, t in self.limits if name in ("plan", "approach"))
        return sum(t for _, t in self.limits) + self.replans * again + self.step * 20


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One line of the log.

    Attributes:
        time: [s].
        state: of the machine.
        q: of the robot after the step, shape (n,) [rad].
        sight: what was seen last.
        clearance: of the robot from what was seen [m]; nan if nothing was.
        event: what happened, or empty.
    """

    time: float
    state: str
    q: FloatArray
    sight: Sight | None
    clearance: float
    event: str


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What came of it.

    Attributes:
        end: `done` or `aborted`.
        cause: why it was aborted, or empty.
        time: when it ended [s].
        replans: how many new plans.
        moments: the log.
        plan: the last one.
    """

    end: str
    cause: str
    time: float
    replans: int
    moments: tuple[Moment, ...]
    plan: Plan | None


@dataclass(frozen=True, slots=True, eq=False)
class Job:
    """Everything that does not change during a run."""

    infer: Inference
    scene_at: SceneAt
    eyes: Perception
    arm: Arm
    rules: Rules = field(default_factory=Rules)
    timing: Timing = field(default_factory=Timing)


@dataclass(frozen=True, slots=True, eq=False)
class _Mind:
    """What does change."""

    state: str = "perceive"
    since: float = 0.0
    sight: Sight | None = None
    method: str = ""
    plan: Plan | None = None
    held: bool = False
    waypoint: int = 1
    stopped: float = 0.0
    replans: int = 0
    cause: str = ""
    event: str = ""
    back: tuple[FloatArray, ...] = ()


def execute(job: Job) -> Run:
    """Runs until `done` or `aborted`."""
    mind, now, moments = _Mind(), 0.0, list[Moment]()
    shape: Shape | None = None
    while mind.state not in ("done", "aborted"):
        mind = replace(mind, sight=job.eyes.look(now) or mind.sight, event="")
        mind = _timed_out(job, mind, now) or _STEPS[mind.state](job, mind, now)
        shape = mind.plan.shape if mind.plan is not None else shape
        moments.append(_moment(job, mind, now, shape))
        now += job.timing.step
    return Run(mind.state, mind.cause, now, mind.replans, tuple(moments), mind.plan)


def _moment(job: Job, mind: _Mind, now: float, shape: Shape | None) -> Moment:
    q, least = job.arm.joints(), float("nan")
    if shape is not None and mind.sight is not None:
        least = clearance(shape, q, np.stack([mind.sight.hand, mind.sight.face]))
    return Moment(now, mind.state, q, mind.sight, least, mind.event)


def _go(mind: _Mind, state: str, now: float, event: str = "") -> _Mind:
    return replace(mind, state=state, since=now, stopped=0.0, event=event or state)


def _abort(mind: _Mind, now: float, cause: str) -> _Mind:
    return replace(_go(mind, "abort", now, cause), cause=mind.cause or cause)


def _timed_out(job: Job, mind: _Mind, now: float) -> _Mind | None:
    if now - mind.since <= dict(job.timing.limits)[mind.state]:
        return None
    if mind.state == "abort":
        return _go(mind, "aborted", now, "stands still where it is")
    return _abort(mind, now, f"time limit of {mind.state}")


def _fresh(job: Job, mind: _Mind, now: float) -> bool:
    return mind.sight is not None and now - mind.sight.time <= job.rules.stale


def _perceive(job: Job, mind: _Mind, now: float) -> _Mind:
    return _go(mind, "infer", now) if _fresh(job, mind, now) else mind


def _infer(job: Job, mind: _Mind, now: float) -> _Mind:
    method = job.infer()
    return replace(_go(mind, "plan", now, f"infer: method {method}"), method=method)


def _plan(job: Job, mind: _Mind, now: float) -> _Mind:
    """Plans for what is seen at the end of the time that planning takes; tries again while the time limit lasts."""
    mind = replace(mind, stopped=mind.stopped + job.timing.step)
    if mind.stopped < job.timing.think or mind.sight is None or not _fresh(job, mind, now):
        return mind
    try:
        scene = job.scene_at(mind.sight)
        held = mind.plan if mind.held else None
        plan = make_plan(scene, mind.method, mind.sight, job.rules, job.arm.joints(), held)
    except ml.MlnError:
        plan = None
    if plan is None:
        return replace(mind, stopped=0.0, event="no plan")
    return replace(_go(mind, "approach" if mind.held else "grasp", now), plan=plan, waypoint=1)


def _grasp(job: Job, mind: _Mind, now: float) -> _Mind:
    job.arm.grip(closed=True)
    return replace(_go(mind, "approach", now), held=True)


def _approach(job: Job, mind: _Mind, now: float) -> _Mind:
    plan, sight = mind.plan, mind.sight
    assert plan is not None, "approach follows plan"
    if sight is not None and np.linalg.norm(sight.hand - plan.scene.hand.position) > job.timing.moved:
        return _replan(job, mind, now, "the hand has moved")
    if mind.stopped > job.timing.blocked:
        return _replan(job, mind, now, "the way is blocked")
    here = job.arm.joints()
    mind = _step(job, mind, plan.path[mind.waypoint], now)
    if not np.array_equal(job.arm.joints(), here):
        mind = replace(mind, back=(*mind.back, here))
    if np.array_equal(job.arm.joints(), plan.path[mind.waypoint]):
        mind = replace(mind, waypoint=mind.waypoint + 1)
    return _go(mind, "hold", now) if mind.waypoint == len(plan.path) else mind


def _replan(job: Job, mind: _Mind, now: float, why: str) -> _Mind:
    if mind.replans >= job.timing.replans:
        return _abort(mind, now, f"too many new plans: {why}")
    return replace(_go(mind, "plan", now, f"new plan: {why}"), replans=mind.replans + 1)


def _step(job: Job, mind: _Mind, goal: FloatArray, now: float) -> _Mind:
    """One step towards a configuration, if it is safe."""
    here = job.arm.joints()
    away = goal - here
    largest = float(np.abs(away).max())
    share = min(1.0, job.timing.joint_speed * job.timing.step / largest) if largest > 0 else 1.0
    there = goal if share == 1.0 else here + share * away
    shape = mind.plan.shape if mind.plan is not None else None
    if shape is None or not may_move(shape, job.rules, mind.sight, (here, there), now + job.timing.step):
        return replace(mind, stopped=mind.stopped + job.timing.step, event="waits")
    job.arm.move(there)
    return replace(mind, stopped=0.0)


def _hold(job: Job, mind: _Mind, now: float) -> _Mind:
    return _go(mind, "release", now, "taken") if job.arm.pulled() else mind


def _release(job: Job, mind: _Mind, now: float) -> _Mind:
    job.arm.grip(closed=False)
    return _go(mind, "done", now)


def _back(job: Job, mind: _Mind, now: float) -> _Mind:
    """Back the way it came."""
    if not mind.back:
        return _go(mind, "aborted", now, "back where it started")
    mind = _step(job, mind, mind.back[-1], now)
    if np.array_equal(job.arm.joints(), mind.back[-1]):
        return replace(mind, back=mind.back[:-1])
    return mind


_STEPS: dict[str, Callable[[Job, _Mind, float], _Mind]] = {
    "perceive": _perceive, "infer": _infer, "plan": _plan, "grasp": _grasp, "approach": _approach, "hold": _hold,
    "release": _release, "abort": _back,
}  # fmt: skip
