"""Cost fields: a scene and a robot grasp in, the costs of every voxel and orientation out, and what they rule out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mlnlite.domains.handover.kinematics.chain import reach_bound
from mlnlite.domains.handover.kinematics.ik import IkSolver
from mlnlite.domains.handover.kinematics.pose import FloatArray
from mlnlite.domains.handover.scene.grasps import GraspSet
from mlnlite.domains.handover.scene.objects import HandoverObject, region_centre, region_points
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.scene.voxels import presenting_rotations, voxel_centres
from mlnlite.domains.handover.search.costs import Distance, Distances, Limits, Points, distances, reachability, safety


@dataclass(frozen=True, slots=True)
class Options:
    """What is optimised, and how far.

    Attributes:
        orientations: of the object per voxel.
        distance: `point` as printed in the paper, or `surface`.
        limits: thresholds of the costs [m].
        grasps: how many of the best grasps to try, in order, until one has a feasible voxel.
        approaches: how many approach directions of a grasp to try per pose, best aligned with the arm first.
        collisions: whether robot, body and object must stay apart.
        receiver: whether the receiver's arm must reach the object at its level of mobility.
        solver: inverse kinematics of the robot; by default damped least squares with seed 0.
        ik_calls: after so many calls of the inverse kinematics the search stops with a bound.
        without: costs left out, to see what they are worth: of `C_A`, `C_S`, `C_R`.
    """

    orientations: int = 8
    distance: Distance = "point"
    limits: Limits = field(default_factory=Limits)
    grasps: int = 6
    approaches: int = 4
    collisions: bool = True
    receiver: bool = True
    solver: IkSolver | None = None
    ik_calls: int = 4000
    without: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class CostField:
    """Costs of one grasp over the map; V voxels, K orientations.

    Attributes:
        grasp: index of the grasp.
        centres: shape (V, 3) [m].
        rotations: of the object, shape (V, K, 3, 3).
        parts: the distances that the costs are made of, each (V, K) [m].
        safety: C_S, shape (V, K) [m]; 0 where forbidden.
        reach: C_R, shape (V, K) [m]; infinite where forbidden.
        excess: how far the tool certainly lies outside the arm's reach, shape (V, K) [m]; negative inside.
        allowed: what the costs and the arm's reach leave, shape (V, K).
    """

    grasp: int
    centres: FloatArray
    rotations: FloatArray
    parts: Distances
    safety: FloatArray
    reach: FloatArray
    excess: FloatArray
    allowed: NDArray[np.bool_]


def cost_field(scene: Scene, grasps: GraspSet, grasp: int, options: Options) -> CostField:
    """The costs of equations 3 and 4 with grasp number `grasp`. Rounded to 1e-9 m, so that ties are ties.

    A cost left out is the same everywhere and forbids nothing.
    """
    centres = voxel_centres(scene.voxels)
    towards = presented_direction(scene.thing, scene.region)
    rotations = presenting_rotations(centres, scene.hand.position, towards, options.orientations)
    points = cost_points(scene, grasps.centres[grasp])
    parts = distances(points, centres, rotations, options.distance)
    safe = safety(parts.to_hand, parts.to_face, parts.gripper_to_hand, options.limits.safety)
    reach = reachability(np.round(parts.to_grasp, 9), options.limits.reach)
    safe = np.ones_like(safe) if "C_S" in options.without else np.round(safe, 9)
    reach = np.zeros_like(reach) if "C_R" in options.without else reach
    excess = _excess(scene, rotations @ grasps.centres[grasp] + centres[:, None])
    allowed = (safe > 0) & np.isfinite(reach) & (excess <= 1e-3)
    return CostField(grasp, centres, rotations, parts, safe, reach, excess, allowed)


def cost_points(scene: Scene, grasp: FloatArray) -> Points:
    """The places that the costs of a scene compare, for a robot grasp centred at `grasp` (3,) [m] in the object."""
    thing, region = scene.thing, scene.region
    return Points(scene.hand.position, scene.face.position, grasp, region_points(thing, region),
                  region_centre(thing, region), thing.surface.points)  # fmt: skip


def presented_direction(thing: HandoverObject, region: int) -> FloatArray:
    """Unit vector in the object, shape (3,), from its centre to the human region; its mean normal if that is no way."""
    centre = region_centre(thing, region)
    if np.linalg.norm(centre) < 0.005:
        centre = thing.surface.normals[thing.surface.labels == region].mean(axis=0)
    length = float(np.linalg.norm(centre))
    return centre / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])


def _excess(scene: Scene, tools: FloatArray) -> FloatArray:
    """Distance of the tool, shape (V, K, 3) [m], beyond the reach bound of the arm, whatever the approach."""
    wrist, centre, radius = reach_bound(scene.robot.chain)
    away = tools - (scene.base.rotation @ centre + scene.base.position)
    distance: FloatArray = np.sqrt(np.einsum("vki,vki->vk", away, away)) - radius - np.linalg.norm(wrist)
    return distance
