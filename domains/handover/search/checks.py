"""Five checks of a configuration, as public robot-to-human benchmarks make them, and a re-check of every constraint.

Nothing is taken from the search: poses are recomputed from the robot's joints by Pinocchio and distances from the
poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from mlnlite.domains.handover.kinematics.ik import Tolerance
from mlnlite.domains.handover.kinematics.plan import plan_path
from mlnlite.domains.handover.kinematics.pose import (
    Pose,
    angle_between,
    compose,
    inverse,
    pose_from_matrix,
    transform_points,
)
from mlnlite.domains.handover.scene.collision import hold, is_free, touching
from mlnlite.domains.handover.scene.effort import Effort, can_reach, effort_at
from mlnlite.domains.handover.scene.grasps import CLEARANCE, GraspSet, in_gripper, sample_grasps
from mlnlite.domains.handover.scene.objects import region_points
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.search.costs import Limits, distances
from mlnlite.domains.handover.search.fields import Options, cost_points
from mlnlite.domains.handover.search.hierarchical import Configuration

CHECKS = ("stable", "plan", "reach", "affordance", "safe")
"""Stable grasp, plan exists, reachable by the human, affordance region left free, safe distances; in this order."""


@dataclass(frozen=True, slots=True)
class Check:
    """Outcome of one check.

    Attributes:
        name: one of `CHECKS`.
        passed: whether it holds.
        finding: what was measured, with units.
    """

    name: str
    passed: bool
    finding: str


def five_checks(scene: Scene, found: Configuration, limits: Limits | None = None) -> tuple[Check, ...]:
    """All five checks, in the order of `CHECKS`; the first failure is the one that benchmarks count."""
    grasps = sample_grasps(scene.thing, scene.robot.gripper)
    return (
        _stable(scene, grasps, found),
        _plan(scene, grasps, found),
        _reach(scene, found),
        _affordance(scene, grasps, found),
        _safe(scene, found, limits or Limits()),
    )


def _stable(scene: Scene, grasps: GraspSet, found: Configuration) -> Check:
    width, widest = float(grasps.widths[found.grasp]), scene.robot.gripper.width
    free = bool(grasps.free[found.grasp, found.hold.approach])
    return Check("stable", free and width <= widest, f"closes on {1e3 * width:.0f} mm of {1e3 * widest:.0f} mm")


def _plan(scene: Scene, grasps: GraspSet, found: Configuration) -> Check:
    hold(scene.world, _in_object(grasps, found))
    path = plan_path(scene.robot.chain, scene.robot.home, found.hold.q, lambda q: is_free(scene.world, q))
    return Check("plan", path is not None, "no path found" if path is None else f"path of {len(path)} waypoints")


def receiver_effort(scene: Scene, found: Configuration) -> Effort | None:
    """Effort of the receiver who takes the object; None if it is out of reach."""
    return effort_at(scene.receiver, found.human_grasp, scene.thing.mass)


def _reach(scene: Scene, found: Configuration) -> Check:
    effort = receiver_effort(scene, found)
    if effort is None:
        return Check("reach", False, f"out of reach at mobility {scene.receiver.level.name}")
    return Check(
        "reach", effort.share <= 1.0, f"{effort.arm:.1f} N m in the arm, at most {100 * effort.share:.0f} % of strength"
    )


def _affordance(scene: Scene, grasps: GraspSet, found: Configuration) -> Check:
    inside = bool((grasps.labels[found.grasp] == scene.region).any())
    local = transform_points(inverse(_in_object(grasps, found)), region_points(scene.thing, scene.region))
    opening = 0.5 * float(grasps.widths[found.grasp]) + CLEARANCE
    covered = float(in_gripper(local, opening, scene.robot.gripper).mean())
    name = scene.thing.regions[scene.region]
    return Check("affordance", not inside and covered == 0.0,
                 f"{100 * covered:.0f} % of {name!r} covered{', grasped by the robot' if inside else ''}")  # fmt: skip


def _safe(scene: Scene, found: Configuration, limits: Limits) -> Check:
    least = least_distance(scene, found)
    return Check("safe", least >= limits.safety, f"keeps {100 * least:.1f} cm from hand and face")


def least_distance(scene: Scene, found: Configuration, options: Options | None = None) -> float:
    """The least distance that a configuration keeps from hand and face [m], as the options measure it."""
    return min(kept_distances(scene, found, options))


def kept_distances(scene: Scene, found: Configuration, options: Options | None = None) -> tuple[float, float, float]:
    """Distances of object and hand, object and face, gripper and hand [m]: what C_S adds up."""
    grasps, options = sample_grasps(scene.thing, scene.robot.gripper), options or Options()
    points = cost_points(scene, grasps.centres[found.grasp])
    at = found.thing.position[None], found.thing.rotation[None, None]
    parts = distances(points, *at, options.distance)
    return float(parts.to_hand[0, 0]), float(parts.to_face[0, 0]), float(parts.gripper_to_hand[0, 0])


def _reach_distance(scene: Scene, grasps: GraspSet, found: Configuration, options: Options) -> float:
    points = cost_points(scene, grasps.centres[found.grasp])
    at = found.thing.position[None], found.thing.rotation[None, None]
    return float(distances(points, *at, options.distance).to_grasp[0, 0])


def _in_object(grasps: GraspSet, found: Configuration) -> Pose:
    return Pose(grasps.centres[found.grasp], grasps.rotations[found.grasp, found.hold.approach], "object")


def violations(scene: Scene, found: Configuration, options: Options | None = None) -> tuple[str, ...]:
    """Every constraint of the optimisation that a configuration breaks, computed from scratch; empty if it is sound."""
    options = options or Options()
    grasps = sample_grasps(scene.thing, scene.robot.gripper)
    chain, q, out = scene.robot.chain, found.hold.q, []
    if (q < chain.lower - 1e-9).any() or (q > chain.upper + 1e-9).any():
        out.append("a joint is outside its limits")
    tool = compose(scene.base, _tool_by_pinocchio(scene, found))
    wanted = compose(found.thing, _in_object(grasps, found))
    near = Tolerance()
    if np.linalg.norm(tool.position - wanted.position) > near.position + 1e-9:
        out.append("the tool is not at the grasp")
    if angle_between(tool.rotation, wanted.rotation) > near.rotation + 1e-6:
        out.append("the tool is not turned as the grasp")
    if least_distance(scene, found, options) < options.limits.safety:
        out.append("hand or face is too near")
    if _reach_distance(scene, grasps, found, options) > options.limits.reach + 1e-9:
        out.append("the hand would move too far")
    if options.receiver and not can_reach(scene.receiver, found.human_grasp):
        out.append("the receiver cannot reach it")
    hold(scene.world, _in_object(grasps, found))
    if options.collisions:
        out += [f"{first} touches {second}" for first, second in touching(scene.world, q)]
    return tuple(out)


def _tool_by_pinocchio(scene: Scene, found: Configuration) -> Pose:
    model, data = scene.robot.model, scene.robot.model.createData()
    pin.framesForwardKinematics(model, data, np.asarray(found.hold.q))
    return pose_from_matrix(data.oMf[model.getFrameId(scene.robot.tool)].homogeneous, "base")
