"""Robot grasps: an object and a gripper in, antipodal parallel-jaw grasps out.

A ray from a surface point against its normal leaves the object at a second point; the two make a grasp if the line
between them lies in both friction cones (Nguyen 1988) and fits between the jaws. The approach is free about the
closing axis; approaches whose fingers or palm would cut the object are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mlnlite.domains.handover.kinematics.pose import FloatArray, locked
from mlnlite.domains.handover.scene.geometry import Labels, is_hidden
from mlnlite.domains.handover.scene.objects import HandoverObject
from mlnlite.domains.handover.scene.robots import Gripper

N_APPROACHES = 12
FRICTION = 0.5
CLEARANCE = 2e-3
"""[m] between a finger and the surface it closes on."""


@dataclass(frozen=True, slots=True, eq=False)
class GraspSet:
    """Grasps of one object by one gripper, in the frame of the object.

    Attributes:
        contacts: the two contact points of each grasp, shape (n, 2, 3) [m].
        centres: their midpoints, shape (n, 3) [m].
        widths: distance between the contacts, shape (n,) [m].
        labels: region indices of the two contacts, shape (n, 2).
        rotations: tool frames per approach, x along the approach, y along closing, shape (n, a, 3, 3).
        free: which approaches keep gripper and object apart, shape (n, a).
    """

    contacts: FloatArray
    centres: FloatArray
    widths: FloatArray
    labels: Labels
    rotations: FloatArray
    free: NDArray[np.bool_]


@lru_cache(maxsize=256)
def sample_grasps(thing: HandoverObject, gripper: Gripper, *, n: int = 200, seed: int = 0) -> GraspSet:
    """At most `n` grasps, spread over the surface; empty if nothing fits between the jaws."""
    contacts, labels = _antipodal(thing, gripper.width - 2 * CLEARANCE)
    chosen = _spread(labels, n, np.random.default_rng(seed))
    contacts, labels = contacts[chosen], labels[chosen]
    rotations = _tool_frames(contacts)
    centres = contacts.mean(axis=1)
    widths = np.linalg.norm(contacts[:, 0] - contacts[:, 1], axis=1)
    free = _free(thing.surface.points, centres, rotations, widths, gripper)
    keep = np.flatnonzero(free.any(axis=1))
    labels, free = labels[keep], free[keep]
    for array in (labels, free):
        array.setflags(write=False)
    return GraspSet(locked(contacts[keep]), locked(centres[keep]), locked(widths[keep]), labels,
                    locked(rotations[keep]), free)  # fmt: skip


def _spread(labels: Labels, n: int, rng: np.random.Generator) -> Labels:
    """Indices of at most `n` grasps, equally many for each combination of regions where there are enough."""
    kinds = np.sort(labels, axis=1) @ (labels.max(initial=0) + 1, 1)
    groups = [rng.permutation(np.flatnonzero(kinds == kind)) for kind in np.unique(kinds)]
    share = n // max(1, len(groups))
    return np.sort(np.concatenate([group[:share] for group in groups])) if groups else np.empty(0, dtype=np.int64)


def _antipodal(thing: HandoverObject, width: float) -> tuple[FloatArray, Labels]:
    """Contacts (m, 2, 3) [m] and their regions (m, 2): surface points and where the ray through the object ends."""
    surface, triangles = thing.surface, np.asarray(thing.mesh.triangles)
    lengths = _exits(surface.points, -surface.normals, triangles)
    first, face = np.nonzero((lengths > 1.5e-3) & (lengths <= width))
    points, normals = surface.points[first], surface.normals[first]
    exits = points - lengths[first, face][:, None] * normals
    outward = np.asarray(thing.mesh.face_normals)[face]
    held = (outward * -normals).sum(axis=1) >= 1.0 / np.sqrt(1.0 + FRICTION**2)
    hidden = is_hidden(thing.parts, exits + 1e-3 * outward)
    keep = held & ~hidden
    _, nearest = cKDTree(surface.points).query(exits[keep])
    contacts = np.stack([points[keep], exits[keep]], axis=1)
    return contacts, np.stack([surface.labels[first[keep]], surface.labels[nearest]], axis=1)


def _exits(origins: FloatArray, directions: FloatArray, triangles: FloatArray) -> FloatArray:
    """Lengths of rays to triangles, shape (rays, triangles) [m], infinite where they miss (Moeller & Trumbore 1997)."""
    corner, ab, ac = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(directions[:, None], ac[None])
    determinant = np.einsum("rtk,tk->rt", p, ab)
    safe = np.where(np.abs(determinant) < 1e-14, np.inf, determinant)
    s = origins[:, None] - corner[None]
    q = np.cross(s, ab[None])
    u, v = np.einsum("rtk,rtk->rt", s, p) / safe, np.einsum("rk,rtk->rt", directions, q) / safe
    length = np.einsum("tk,rtk->rt", ac, q) / safe
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (length > 0) & np.isfinite(safe)
    return np.where(hit, length, np.inf)


def _tool_frames(contacts: FloatArray) -> FloatArray:
    """Frames with y from contact to contact and x turned about it in equal steps, shape (n, a, 3, 3)."""
    closing = contacts[:, 1] - contacts[:, 0]
    closing = closing / np.linalg.norm(closing, axis=1, keepdims=True)
    helper = np.eye(3)[np.abs(closing).argmin(axis=1)]
    across = np.cross(closing, helper)
    across = across / np.linalg.norm(across, axis=1, keepdims=True)
    third = np.cross(across, closing)
    angle = 2 * np.pi * np.arange(N_APPROACHES) / N_APPROACHES
    x = np.cos(angle)[None, :, None] * across[:, None] + np.sin(angle)[None, :, None] * third[:, None]
    y = np.broadcast_to(closing[:, None], x.shape)
    return np.stack([x, y, np.cross(x, y)], axis=3)


def _free(
    points: FloatArray, centres: FloatArray, rotations: FloatArray, widths: FloatArray, gripper: Gripper
) -> NDArray[np.bool_]:
    """Approaches, shape (n, a), with no surface point in the fingers or the palm."""
    free = np.empty(rotations.shape[:2], dtype=np.bool_)
    for i in range(len(centres)):
        local = (points - centres[i]) @ rotations[i]
        free[i] = ~in_gripper(local, 0.5 * float(widths[i]) + CLEARANCE, gripper).any(axis=1)
    return free


def in_gripper(local: FloatArray, opening: float, gripper: Gripper) -> NDArray[np.bool_]:
    """Which points, shape (..., 3) [m] in the tool frame, lie in the fingers or the palm.

    Args:
        local: points in the tool frame: x along the approach, y along closing.
        opening: half the distance between the inner sides of the fingers [m].
        gripper: sizes of the jaws [m].
    """
    along, aside, across = local[..., 0], np.abs(local[..., 1]), np.abs(local[..., 2])
    slab = across < 0.012
    finger = (aside > opening) & (aside < opening + gripper.thickness) & (along < gripper.depth) & slab
    palm = (along < -gripper.palm) & (aside < 0.06) & (across < 0.035)
    return np.asarray((finger & (along > -gripper.palm - 0.06)) | palm & (along > -gripper.palm - 0.15), dtype=np.bool_)
