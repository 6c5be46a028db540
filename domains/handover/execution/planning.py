"""Plans: a scene and an answer in, where the robot goes and how out; also anew, with the object in hand."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mlnlite.domains.handover.execution.guard import SLACK, Rules, Shape, clearance, shape_of
from mlnlite.domains.handover.execution.sockets import Sight
from mlnlite.domains.handover.kinematics.plan import plan_path
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose
from mlnlite.domains.handover.scene.collision import hold, is_free
from mlnlite.domains.handover.scene.grasps import GraspSet, sample_grasps
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.search.costs import Limits
from mlnlite.domains.handover.search.feasibility import attempt, human_grasp
from mlnlite.domains.handover.search.fields import Options, cost_field
from mlnlite.domains.handover.search.methods import hand_over

MARGIN = 0.03
"""The offer keeps so much more than the safety distance, so that a hand at rest does not stop the last step [m]."""
TRIES = 12
"""Poses of the object that are tried again with the object in hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Where the robot goes.

    Attributes:
        scene: of the time of planning.
        grasp: the tool's pose in the object.
        chosen: index of the grasp and of its approach.
        path: waypoints, shape (m, n) [rad].
        offer: where the receiver takes the object, shape (3,) [m].
        shape: what moves, with the object.
    """

    scene: Scene
    grasp: Pose
    chosen: tuple[int, int]
    path: FloatArray
    offer: FloatArray
    shape: Shape


def make_plan(scene: Scene, method: str, sight: Sight, rules: Rules, q: FloatArray, held: Plan | None) -> Plan | None:
    """The offer of a method and a free path to it; None if there is none.

    Args:
        scene: with hand and face as seen.
        method: `A`, `B` or `ours`.
        sight: hand and face.
        rules: what may be relied on.
        q: the robot's configuration now, shape (n,) [rad].
        held: the plan by which the object was grasped, if it was.
    """
    if held is None:
        return _first(scene, method, sight, rules, q)
    return _again(scene, sight, rules, q, held)


def options_for(rules: Rules) -> Options:
    """Surface distances with a margin, so that the offer can be reached by the rules."""
    limits = Limits(rules.limits.safety + MARGIN, rules.limits.reach)
    return Options(orientations=4, distance="surface", limits=limits, grasps=3, approaches=3, ik_calls=400)


def _first(scene: Scene, method: str, sight: Sight, rules: Rules, q: FloatArray) -> Plan | None:
    found = hand_over(scene, method, options_for(rules)).configuration
    if found is None:
        return None
    grasps = sample_grasps(scene.thing, scene.robot.gripper)
    chosen = (found.grasp, found.hold.approach)
    return _reached(scene, _grasp(grasps, chosen), chosen, (q, found.hold.q), (sight, rules, found.human_grasp))


def _grasp(grasps: GraspSet, chosen: tuple[int, int]) -> Pose:
    return Pose(grasps.centres[chosen[0]], grasps.rotations[chosen], "object")


def _again(scene: Scene, sight: Sight, rules: Rules, q: FloatArray, held: Plan) -> Plan | None:
    """With the grasp that it has: poses in the order of C_R, ties to higher C_S, the first that can be reached."""
    grasps, options = sample_grasps(scene.thing, scene.robot.gripper), options_for(rules)
    only = np.zeros_like(grasps.free)
    only[held.chosen] = True
    grasps = replace(grasps, free=only)
    costs = cost_field(scene, grasps, held.chosen[0], options)
    order = np.lexsort((-costs.safety.ravel(), np.where(costs.allowed, costs.reach, np.inf).ravel()))
    turns, tried = costs.rotations.shape[1], 0
    for voxel, k in (divmod(int(i), turns) for i in order[: int(costs.allowed.sum())]):
        pose = Pose(costs.centres[voxel], costs.rotations[voxel, k])
        outcome = attempt(scene, grasps, held.chosen[0], pose, options)
        tried += outcome.calls > 0
        if outcome.hold is not None:
            offer = human_grasp(scene, pose)
            plan = _reached(scene, held.grasp, held.chosen, (q, outcome.hold.q), (sight, rules, offer))
            if plan is not None:
                return plan
        if tried >= TRIES:
            break
    return None


def _reached(
    scene: Scene, grasp: Pose, chosen: tuple[int, int], ends: tuple[FloatArray, FloatArray],
    seen: tuple[Sight, Rules, FloatArray],
) -> Plan | None:  # fmt: skip
    """A path that keeps off the person as now seen."""
    sight, rules, offer = seen
    shape = shape_of(scene, grasp)
    places = np.stack([sight.hand, sight.face])
    least = rules.limits.safety + SLACK + rules.noise + 0.01
    hold(scene.world, grasp)

    def free(q: FloatArray) -> bool:
        return clearance(shape, q, places) >= least and is_free(scene.world, q)

    path = plan_path(scene.robot.chain, ends[0], ends[1], free, limit=300)
    return None if path is None else Plan(scene, grasp, chosen, path, offer, shape)
