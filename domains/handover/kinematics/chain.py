"""A serial arm as numbers: a Pinocchio model in, the table of its joints out, with kinematics in plain NumPy.

The compiled solver reads this table; the forward kinematics here are the independent check of Pinocchio's and of the
kernel's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from mlnlite.domains.handover.kinematics.pose import FloatArray, locked

PLACEMENT, AXIS, SLIDES, LOWER, UPPER = slice(0, 16), slice(16, 19), 19, 20, 21


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Joints in order from the base to the tool.

    Attributes:
        table: shape (n + 1, 22). Row i < n: placement in its parent (4x4 by rows) [m], unit axis, 1 if it slides,
            lower and upper limit [rad] or [m]. Row n: placement of the tool in the last joint.
        names: of the n joints.
    """

    table: FloatArray
    names: tuple[str, ...]

    @property
    def lower(self) -> FloatArray:
        """Lower limits, shape (n,) [rad] or [m]."""
        return self.table[:-1, LOWER]

    @property
    def upper(self) -> FloatArray:
        """Upper limits, shape (n,) [rad] or [m]."""
        return self.table[:-1, UPPER]


def chain_of(model: pin.Model, tool: str) -> Chain:
    """The joints of a serial model up to the frame `tool`."""
    table = np.zeros((model.njoints, 22))
    for i in range(1, model.njoints):
        data = model.joints[i].createData()
        model.joints[i].calc(data, np.zeros(1))
        motion = np.array(data.S).ravel()
        slides = bool(np.linalg.norm(motion[:3]) > 0.5)
        table[i - 1, PLACEMENT] = np.array(model.jointPlacements[i].homogeneous).ravel()
        table[i - 1, AXIS] = motion[:3] if slides else motion[3:]
        table[i - 1, SLIDES:] = slides, model.lowerPositionLimit[i - 1], model.upperPositionLimit[i - 1]
    table[-1, PLACEMENT] = np.array(model.frames[model.getFrameId(tool)].placement.homogeneous).ravel()
    return Chain(locked(table), tuple(model.names[1:]))


def with_limits(chain: Chain, lower: FloatArray, upper: FloatArray) -> Chain:
    """The same chain with other joint limits [rad] or [m]."""
    table = chain.table.copy()
    table[:-1, LOWER], table[:-1, UPPER] = lower, upper
    return Chain(locked(table), chain.names)


def tool_poses(chain: Chain, configurations: FloatArray) -> FloatArray:
    """Poses of the tool in the base, shape (m, 4, 4) [m], for configurations of shape (m, n) [rad] or [m].

    Product of joint transforms, `T = prod_i P_i exp(S_i q_i)` times the tool's placement.
    """
    pose = np.broadcast_to(np.eye(4), (len(configurations), 4, 4))
    for row, q in zip(chain.table[:-1], configurations.T, strict=True):
        pose = pose @ row[PLACEMENT].reshape(4, 4) @ _joint_motion(row, q)
    return pose @ chain.table[-1, PLACEMENT].reshape(4, 4)


def _joint_motion(row: FloatArray, q: FloatArray) -> FloatArray:
    out = np.tile(np.eye(4), (len(q), 1, 1))
    x, y, z = row[AXIS]
    if row[SLIDES]:
        out[:, :3, 3] = q[:, None] * row[AXIS]
        return out
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    out[:, :3, :3] += np.sin(q)[:, None, None] * skew + (1 - np.cos(q))[:, None, None] * (skew @ skew)
    return out


def reach_bound(chain: Chain) -> tuple[FloatArray, FloatArray, float]:
    """A sphere that no pose can leave: necessary for inverse kinematics, and cheap.

    The origin of the last joint does not move with it, so its place follows from the tool's pose alone. It is never
    farther from the first joint's origin than the sum of the link lengths between (plus the travel of sliding joints).

    Returns:
        Place of the last joint's origin in the tool frame (3,) [m], centre (3,) [m] in the base, radius [m].
    """
    last = chain.table[-1, PLACEMENT].reshape(4, 4)
    wrist = -last[:3, :3].T @ last[:3, 3]
    rows = chain.table[:-1]
    links = float(np.linalg.norm(rows[1:, PLACEMENT].reshape(-1, 4, 4)[:, :3, 3], axis=1).sum())
    travel = float((np.abs(rows[:, LOWER : UPPER + 1]).max(axis=1) * rows[:, SLIDES]).sum())
    return locked(wrist), locked(rows[0, PLACEMENT].reshape(4, 4)[:3, 3]), links + travel
