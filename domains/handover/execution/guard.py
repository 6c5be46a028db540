"""The safety distance: where the robot is and what is seen of the person in, whether a step may be taken out.

The robot moves only if it is, and will be, at least `Limits.safety` (5 cm) from palm and face wherever these may be by
then: seen at most `noise` wrongly, and since then moved at most with `speed`. So no motion brings the robot within
5 cm of them, as long as nobody is faster or seen worse than that. Distances are from the surface of the robot's links,
its gripper and the held object; who stands still does not move, so a hand may come to a robot that waits.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from mlnlite.domains.handover.execution.sockets import Sight
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, inverse, transform_points
from mlnlite.domains.handover.scene.robots import Robot
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.search.costs import Limits

LINK = 0.07
"""Radius that encloses the robot's links [m]."""
SLACK = 0.003
"""Between two ends of a step of 2 cm that keep 5 cm from a place, the way may dip by 1 mm towards it [m]."""


@dataclass(frozen=True, slots=True)
class Rules:
    """What may be relied on.

    Attributes:
        limits: thresholds of the costs [m].
        noise: largest error of what is seen [m].
        speed: largest speed of hand and face [m/s].
        stale: sights older than this stop the robot [s].
    """

    limits: Limits = field(default_factory=Limits)
    noise: float = 0.005
    speed: float = 0.5
    stale: float = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """What moves.

    Attributes:
        robot: its kinematics, with a buffer of their state.
        base: of the robot in the world.
        hand: points of the gripper and, while held, of the object, in the tool, shape (m, 3) [m].
        state: buffer.
    """

    robot: Robot
    base: Pose
    hand: FloatArray
    state: pin.Data


def shape_of(scene: Scene, grasp: Pose | None) -> Shape:
    """The robot of a scene, with the object if `grasp`, the tool's pose in the object, is given."""
    points = [scene.world.hand_points]
    if grasp is not None:
        points.append(transform_points(inverse(grasp, "tool"), scene.thing.surface.points[::3]))
    return Shape(scene.robot, scene.base, np.concatenate(points), scene.robot.model.createData())


def clearance(shape: Shape, q: FloatArray, places: FloatArray) -> float:
    """Least distance of robot and object at q, shape (n,) [rad], from places in the world, shape (k, 3) [m]."""
    model, data = shape.robot.model, shape.state
    pin.framesForwardKinematics(model, data, np.asarray(q, dtype=np.float64))
    tool = data.oMf[model.getFrameId(shape.robot.tool)]
    near = (places - shape.base.position) @ shape.base.rotation
    local = (near - tool.translation) @ tool.rotation
    to_hand = np.sqrt(((shape.hand[:, None] - local) ** 2).sum(axis=2)).min()
    ends = np.array([data.oMi[i].translation for i in range(1, model.njoints)])
    return float(min(to_hand, _to_line(ends, near) - LINK))


def _to_line(ends: FloatArray, places: FloatArray) -> float:
    """Least distance of places from the line through successive joints."""
    start, along = ends[:-1], np.diff(ends, axis=0)
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    t = np.clip(((places[:, None] - start) * along).sum(axis=2) / squared, 0.0, 1.0)
    away = places[:, None] - (start + t[:, :, None] * along)
    return float(np.sqrt((away**2).sum(axis=2)).min())


def needed(rules: Rules, sight: Sight, until: float) -> float:
    """Distance from a sight that is safe at a later time [s], whatever the person does till then [m]."""
    return rules.limits.safety + SLACK + rules.noise + rules.speed * max(0.0, until - sight.time)


def may_move(shape: Shape, rules: Rules, sight: Sight | None, way: tuple[FloatArray, FloatArray], until: float) -> bool:
    """Whether a step may be taken.

    Args:
        shape: what moves.
        rules: what may be relied on.
        sight: the latest of hand and face.
        way: configurations before and after, each of shape (n,) [rad].
        until: when the step ends [s].
    """
    if sight is None or until - sight.time > rules.stale:
        return False
    places, least = np.stack([sight.hand, sight.face]), needed(rules, sight, until)
    return all(clearance(shape, q, places) >= least for q in way)
