"""The three costs of Ardon et al. (2021): places in, numbers over all voxels and orientations out. No robot, no search.

Printed form: distances between points. Documented variant: `surface`, where the distances to hand and face are those
of the object's surface to spheres of `HAND_RADIUS` and `FACE_RADIUS`, and the reach is to the nearest point of the
human region.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from mlnlite.domains.handover.kinematics.pose import FloatArray

Distance = Literal["point", "surface"]
HAND_RADIUS = 0.04
"""[m]"""
FACE_RADIUS = 0.10
"""[m]"""


@dataclass(frozen=True, slots=True)
class Limits:
    """Thresholds of the paper.

    Attributes:
        safety: least distance to hand and face [m].
        reach: largest displacement of the hand [m].
    """

    safety: float = 0.05
    reach: float = 0.75


def appropriateness(grasps: FloatArray, region: FloatArray) -> FloatArray:
    """Equation 2: `C_A(g_r) = min_{g_h in a_O} d(g_r, g_h)`, to be maximised.

    Args:
        grasps: centres of robot grasps, shape (n, 3) [m].
        region: points of the human region a_O, shape (m, 3) [m].

    Returns:
        Shape (n,) [m].
    """
    distance, _ = cKDTree(region).query(grasps)
    return np.asarray(distance, dtype=np.float64)


def safety(to_hand: FloatArray, to_face: FloatArray, gripper_to_hand: FloatArray, threshold: float) -> FloatArray:
    """Equation 3: `C_S = d(O, hand) + d(O, face) + d(EE, hand)`, 0 where any is under the threshold; to be maximised.

    Args:
        to_hand: object to hand, any shape [m].
        to_face: object to face [m].
        gripper_to_hand: end effector to hand [m].
        threshold: [m].
    """
    least = np.minimum(np.minimum(to_hand, to_face), gripper_to_hand)
    return np.where(least < threshold, 0.0, to_hand + to_face + gripper_to_hand)


def reachability(distance: FloatArray, bound: float) -> FloatArray:
    """Equation 4: `C_R = d(hand, g_h)`, infinite beyond the bound; to be minimised. Distances of any shape [m]."""
    return np.where(distance <= bound, distance, np.inf)


@dataclass(frozen=True, slots=True, eq=False)
class Distances:
    """Distances over the map, each of shape (V, K) [m]: V voxels, K orientations."""

    to_hand: FloatArray
    to_face: FloatArray
    gripper_to_hand: FloatArray
    to_grasp: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Places that the costs compare [m].

    Attributes:
        hand: palm in the world, shape (3,).
        face: in the world, shape (3,).
        grasp: centre of the robot's grasp in the object, shape (3,).
        region: human region in the object, shape (m, 3).
        region_centre: the receiver's grasp g_h in the object, shape (3,).
        surface: the object's surface in the object, shape (n, 3).
    """

    hand: FloatArray
    face: FloatArray
    grasp: FloatArray
    region: FloatArray
    region_centre: FloatArray
    surface: FloatArray


def distances(points: Points, centres: FloatArray, rotations: FloatArray, kind: Distance = "point") -> Distances:
    """All distances for objects at `centres` (V, 3) [m] with `rotations` (V, K, 3, 3)."""
    gripper = _from(points.hand, rotations @ points.grasp + centres[:, None])
    if kind == "point":
        shape = rotations.shape[:2]
        to_hand = np.broadcast_to(_from(points.hand, centres)[:, None], shape)
        to_face = np.broadcast_to(_from(points.face, centres)[:, None], shape)
        return Distances(
            to_hand, to_face, gripper, _from(points.hand, rotations @ points.region_centre + centres[:, None])
        )
    hand, face = (_in_object(place, centres, rotations) for place in (points.hand, points.face))
    tree = cKDTree(points.surface)
    to_hand = np.maximum(0.0, tree.query(hand)[0] - HAND_RADIUS)
    to_face = np.maximum(0.0, tree.query(face)[0] - FACE_RADIUS)
    to_grasp = np.asarray(cKDTree(points.region).query(hand)[0], dtype=np.float64)
    return Distances(to_hand, to_face, np.maximum(0.0, gripper - HAND_RADIUS), to_grasp)


def _from(place: FloatArray, others: FloatArray) -> FloatArray:
    difference = others - place
    length: FloatArray = np.sqrt(np.einsum("...i,...i->...", difference, difference))
    return length


def _in_object(place: FloatArray, centres: FloatArray, rotations: FloatArray) -> FloatArray:
    """A place of the world in the object's frame, shape (V, K, 3) [m]: R^T (place - centre)."""
    local: FloatArray = np.einsum("vkji,vj->vki", rotations, place - centres)
    return local
