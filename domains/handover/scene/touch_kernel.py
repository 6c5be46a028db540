"""Sure collisions, compiled: points of a rigid body and capsules in, whether some point lies inside some capsule out.

A cheap first test: it never reports a collision that is none, and what it lets pass goes to the exact distance queries.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mlnlite.domains.handover.compiled import kernel
from mlnlite.domains.handover.kinematics.pose import FloatArray


@kernel
def touches(points: FloatArray, rotation: FloatArray, position: FloatArray, capsules: FloatArray) -> bool:
    """Whether a point of the body lies in a capsule.

    Args:
        points: in the body, shape (n, 3) [m].
        rotation: of the body, shape (3, 3).
        position: of the body, shape (3,) [m].
        capsules: start, end, radius in rows, shape (m, 7) [m].
    """
    size = 0.0
    for i in range(points.shape[0]):
        size = max(size, points[i, 0] ** 2 + points[i, 1] ** 2 + points[i, 2] ** 2)
    size = size**0.5
    for c in range(capsules.shape[0]):
        if _squared(capsules[c], position[0], position[1], position[2]) > (size + capsules[c, 6]) ** 2:
            continue
        limit = (capsules[c, 6] - 1e-6) ** 2
        for i in range(points.shape[0]):
            a, b, d = points[i, 0], points[i, 1], points[i, 2]
            x = position[0] + rotation[0, 0] * a + rotation[0, 1] * b + rotation[0, 2] * d
            y = position[1] + rotation[1, 0] * a + rotation[1, 1] * b + rotation[1, 2] * d
            z = position[2] + rotation[2, 0] * a + rotation[2, 1] * b + rotation[2, 2] * d
            if _squared(capsules[c], x, y, z) < limit:
                return True
    return False


@kernel
def touching_turns(
    points: FloatArray, rotations: FloatArray, position: FloatArray, capsules: FloatArray
) -> NDArray[np.bool_]:
    """`touches` for each of the rotations, shape (k, 3, 3), at one position; shape (k,)."""
    out = np.empty(rotations.shape[0], dtype=np.bool_)
    for k in range(rotations.shape[0]):
        out[k] = touches(points, rotations[k], position, capsules)
    return out


@kernel
def _squared(capsule: FloatArray, x: float, y: float, z: float) -> float:
    """Squared distance of a point to the axis of a capsule [m^2]."""
    ux, uy, uz = capsule[3] - capsule[0], capsule[4] - capsule[1], capsule[5] - capsule[2]
    px, py, pz = x - capsule[0], y - capsule[1], z - capsule[2]
    along = (px * ux + py * uy + pz * uz) / max(1e-18, ux * ux + uy * uy + uz * uz)
    along = min(1.0, max(0.0, along))
    dx, dy, dz = px - along * ux, py - along * uy, pz - along * uz
    squared: float = dx * dx + dy * dy + dz * dz
    return squared
