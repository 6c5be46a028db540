"""Rigid poses: positions and rotations in, `Pose` out. A pose maps points of a body into its frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray: TypeAlias = NDArray[np.float64]


def locked(values: ArrayLike) -> FloatArray:
    """A read-only copy as float64."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """An element of SE(3): `x_frame = rotation @ x_body + position`.

    Attributes:
        position: origin of the body, shape (3,) [m].
        rotation: rotation matrix, shape (3, 3).
        frame: name of the frame in which it is given.
    """

    position: FloatArray = field(default_factory=lambda: locked(np.zeros(3)))
    rotation: FloatArray = field(default_factory=lambda: locked(np.eye(3)))
    frame: str = "world"

    def __post_init__(self) -> None:
        """Locks copies of the arrays."""
        object.__setattr__(self, "position", locked(self.position))
        object.__setattr__(self, "rotation", locked(self.rotation))

    @property
    def matrix(self) -> FloatArray:
        """The homogeneous matrix, shape (4, 4)."""
        out = np.eye(4)
        out[:3, :3], out[:3, 3] = self.rotation, self.position
        return out

    @property
    def quaternion(self) -> FloatArray:
        """Unit quaternion (w, x, y, z) with w >= 0."""
        from scipy.spatial.transform import Rotation

        x, y, z, w = Rotation.from_matrix(self.rotation).as_quat(canonical=True)
        return locked((w, x, y, z))

    def to_dict(self) -> dict[str, Any]:
        """Plain data: frame, position [m], quaternion (w, x, y, z)."""
        return {"frame": self.frame, "position": self.position.tolist(), "quaternion": self.quaternion.tolist()}


def pose_from_matrix(matrix: ArrayLike, frame: str = "world") -> Pose:
    """The pose of a homogeneous matrix, shape (4, 4) [m]."""
    m = np.asarray(matrix, dtype=np.float64)
    return Pose(m[:3, 3], m[:3, :3], frame)


def pose_at(x: float, y: float, z: float, heading: float = 0.0) -> Pose:
    """A pose at (x, y, z) [m], turned by `heading` [rad] about the vertical."""
    return Pose(locked((x, y, z)), rotation_about((0.0, 0.0, 1.0), heading))


def compose(first: Pose, second: Pose) -> Pose:
    """`first * second`: the second pose, given in the body of the first, seen from the frame of the first.

    >>> compose(pose_at(1, 0, 0, np.pi / 2), pose_at(1, 0, 0)).position.round(6).tolist()
    [1.0, 1.0, 0.0]
    """
    return Pose(first.rotation @ second.position + first.position, first.rotation @ second.rotation, first.frame)


def inverse(pose: Pose, frame: str = "body") -> Pose:
    """The inverse pose; `frame` names the body it is given in."""
    return Pose(-pose.rotation.T @ pose.position, pose.rotation.T, frame)


def transform_points(pose: Pose, points: FloatArray) -> FloatArray:
    """Points of the body, shape (..., 3) [m], in the frame of the pose."""
    moved: FloatArray = points @ pose.rotation.T + pose.position
    return moved


def rotation_about(axis: ArrayLike, angle: float) -> FloatArray:
    """Rotation by `angle` [rad] about the unit vector `axis`: Rodrigues' formula."""
    x, y, z = np.asarray(axis, dtype=np.float64)
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return locked(np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * (skew @ skew))


def angle_between(first: FloatArray, second: FloatArray) -> float:
    """Angle [rad] of the rotation that takes one rotation matrix into the other."""
    relative = first.T @ second
    vector = np.array(
        [relative[2, 1] - relative[1, 2], relative[0, 2] - relative[2, 0], relative[1, 0] - relative[0, 1]]
    )
    return float(np.arctan2(0.5 * np.linalg.norm(vector), 0.5 * (np.trace(relative) - 1.0)))
