"""The workspace around the receiver: a centre, counts and a step in, voxel centres and object orientations out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mlnlite import MlnError
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, locked, transform_points

UP = locked((0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class VoxelMap:
    """A grid of voxels, M(x, y, z) of the paper.

    Attributes:
        pose: of the grid's centre and axes in the world [m].
        counts: voxels along each axis.
        step: edge of a voxel [m].
    """

    pose: Pose = field(default_factory=Pose)
    counts: tuple[int, int, int] = (15, 15, 15)
    step: float = 0.03

    def __post_init__(self) -> None:
        """Refuses empty or senseless grids.

        Raises:
            MlnError: a count below 1 or a step that is not positive.
        """
        if min(self.counts) < 1 or not 0 < self.step < 10:
            raise MlnError(f"a voxel map of {self.counts} voxels of {self.step} m is empty",
                           hint="use at least one voxel along each axis and a positive step [m]")  # fmt: skip


def voxel_centres(voxels: VoxelMap) -> FloatArray:
    """Centres in the world, shape (V, 3) [m], x slowest and z fastest."""
    axes = [voxels.step * (np.arange(n) - (n - 1) / 2) for n in voxels.counts]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return transform_points(voxels.pose, grid)


def presenting_rotations(centres: FloatArray, palm: FloatArray, towards: FloatArray, n: int) -> FloatArray:
    """Orientations of the object that turn a body direction to the palm.

    `R = F(u) Rx(2 pi k / n) B^T`, where F(u) has x along u = (palm - centre) / |palm - centre| and z as upright as
    possible, and B has x along `towards` and z as near to the body's z as possible. So k = 0 keeps the object upright.

    Args:
        centres: of the voxels, shape (V, 3) [m].
        palm: position of the palm, shape (3,) [m].
        towards: unit vector in the object, shape (3,).
        n: orientations per voxel.

    Returns:
        Rotation matrices, shape (V, n, 3, 3).
    """
    away = palm - centres
    frames = _upright(away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12))
    body = _upright(towards[None])[0]
    angle = 2 * np.pi * np.arange(n) / n
    roll = np.zeros((n, 3, 3))
    roll[:, 0, 0] = 1.0
    roll[:, 1, 1] = roll[:, 2, 2] = np.cos(angle)
    roll[:, 2, 1], roll[:, 1, 2] = np.sin(angle), -np.sin(angle)
    out: FloatArray = frames[:, None] @ (roll @ body.T)[None]
    return out


def _upright(x: FloatArray) -> FloatArray:
    """Frames with columns x, y, z, shape (m, 3, 3): z nearest to the vertical, or the first axis if x is vertical."""
    up = np.where(np.abs(x[:, 2:]) < 0.999, UP, np.array([1.0, 0.0, 0.0]))
    z = up - (up * x).sum(axis=1, keepdims=True) * x
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)
