"""What only a solver can tell: an object pose and a grasp in, a collision-free configuration of the robot out, or none.

A pure function of the scene, the grasp and the pose: the order in which a search asks changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mlnlite.domains.handover.kinematics.chain import Chain
from mlnlite.domains.handover.kinematics.ik import Accept, IkSolver, damped_least_squares
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, compose, inverse, transform_points
from mlnlite.domains.handover.scene.collision import hand_is_free, hold, is_free, thing_is_free
from mlnlite.domains.handover.scene.effort import can_reach
from mlnlite.domains.handover.scene.grasps import GraspSet
from mlnlite.domains.handover.scene.objects import HandoverObject, region_centre
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.scene.touch_kernel import touches, touching_turns
from mlnlite.domains.handover.search.fields import Options


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """How the robot holds the object somewhere.

    Attributes:
        approach: index of the approach of the grasp.
        tool: pose of the tool in the world [m].
        q: configuration of the robot, shape (n,) [rad].
    """

    approach: int
    tool: Pose
    q: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Attempt:
    """Outcome of one question.

    Attributes:
        hold: the answer, or None.
        calls: of the inverse kinematics.
        blame: `receiver`, `kinematics` or `collision`, or empty.
    """

    hold: Hold | None
    calls: int
    blame: str = ""


@lru_cache(maxsize=16)
def default_solver(chain: Chain) -> IkSolver:
    """The solver of the domain for a chain, seed 0."""
    return damped_least_squares(chain)


@lru_cache(maxsize=128)
def _grasp_point(thing: HandoverObject, region: int) -> FloatArray:
    return region_centre(thing, region)


def human_grasp(scene: Scene, pose: Pose) -> FloatArray:
    """Where the receiver grasps an object at `pose`: g_h in the world, shape (3,) [m]."""
    return transform_points(pose, _grasp_point(scene.thing, scene.region))


def clear_turns(scene: Scene, place: FloatArray, rotations: FloatArray, options: Options) -> NDArray[np.bool_]:
    """Which rotations, shape (K, 3, 3), of the object at `place` (3,) [m] may keep off the receiver; shape (K,).

    A quick look over all of them: what it refuses, `attempt` refuses too.
    """
    if not options.collisions:
        return np.ones(len(rotations), dtype=np.bool_)
    hits: NDArray[np.bool_] = touching_turns(scene.thing.surface.points, rotations, place, scene.world.capsules)
    return ~hits


def attempt(scene: Scene, grasps: GraspSet, grasp: int, pose: Pose, options: Options) -> Attempt:
    """Whether the receiver can take the object at `pose`, and the robot can hold it there with a grasp.

    Cheap tests come first: none of them changes the answer, only what is blamed.
    """
    world = scene.world
    if options.collisions and touches(scene.thing.surface.points, pose.rotation, pose.position, world.capsules):
        return Attempt(None, 0, "collision")
    tools = _tools(scene, grasps, grasp, pose, options.approaches)
    if options.collisions:
        tools = [
            (a, tool)
            for a, tool in tools
            if not touches(world.hand_points, tool.rotation, tool.position, world.capsules)
        ]
        if not tools or not thing_is_free(world, compose(inverse(scene.base, "base"), pose)):
            return Attempt(None, 0, "collision")
    if options.receiver and not can_reach(scene.receiver, human_grasp(scene, pose)):
        return Attempt(None, 0, "receiver")
    return _solve(scene, grasps, grasp, tools, options)


def _solve(scene: Scene, grasps: GraspSet, grasp: int, tools: list[tuple[int, Pose]], options: Options) -> Attempt:
    solver, refused, calls = options.solver or default_solver(scene.robot.chain), 0, 0
    to_base = inverse(scene.base, "base")
    for approach, tool in tools:
        in_base = compose(to_base, tool)
        if options.collisions and not hand_is_free(scene.world, in_base):
            refused += 1
            continue
        in_object = Pose(grasps.centres[grasp], grasps.rotations[grasp, approach], "object")
        found = solver(in_base.matrix, _accept(scene, in_object) if options.collisions else None)
        calls, refused = calls + 1, refused + found.refused
        if found.found:
            return Attempt(Hold(approach, tool, found.q), calls)
    return Attempt(None, calls, "collision" if refused else "kinematics")


def _accept(scene: Scene, in_object: Pose) -> Accept:
    hold(scene.world, in_object)
    return lambda q: is_free(scene.world, q)


def _tools(scene: Scene, grasps: GraspSet, grasp: int, pose: Pose, n: int) -> list[tuple[int, Pose]]:
    """Poses of the tool for the free approaches, those that point away from the robot's shoulder first."""
    free = np.flatnonzero(grasps.free[grasp])
    shoulder = scene.base.rotation @ scene.robot.chain.table[0, [3, 7, 11]] + scene.base.position
    centre = pose.rotation @ grasps.centres[grasp] + pose.position
    rotations = pose.rotation @ grasps.rotations[grasp, free]
    order = np.argsort(-np.round(rotations[:, :, 0] @ (centre - shoulder), 9), kind="stable")[:n]
    return [(int(free[i]), Pose(centre, rotations[i])) for i in order]
