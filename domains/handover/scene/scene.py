"""A scene: who receives what from which robot, and where everything is. Names in, checked `Scene` out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlnlite import MlnError
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, locked
from mlnlite.domains.handover.scene.bodies import body_capsules
from mlnlite.domains.handover.scene.collision import World, make_world
from mlnlite.domains.handover.scene.effort import easiest_posture
from mlnlite.domains.handover.scene.objects import HandoverObject, read_object, region_of
from mlnlite.domains.handover.scene.receiver import Receiver, frame_pose, read_receiver
from mlnlite.domains.handover.scene.robots import Robot, read_robot
from mlnlite.domains.handover.scene.voxels import VoxelMap


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Everything an optimisation needs, in the world frame [m].

    Attributes:
        thing: the object.
        task: what the receiver is about to do.
        region: index of the region that they need for it.
        receiver: body and mobility.
        posture: of the receiver now, shape (8,) [rad].
        hand: pose of the palm now.
        face: pose of the face now.
        robot: the giver.
        base: pose of the robot's base.
        voxels: the workspace.
        world: collision bodies.
    """

    thing: HandoverObject
    task: str
    region: int
    receiver: Receiver
    posture: FloatArray
    hand: Pose
    face: Pose
    robot: Robot
    base: Pose
    voxels: VoxelMap
    world: World


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Where things are, if not at their default places.

    Attributes:
        hand: position of the palm, shape (3,) [m]; by default that of the comfortable posture.
        base: pose of the robot's base [m]; by default the robot's own.
        counts: voxels along each axis.
        step: edge of a voxel [m].
        centre: of the voxel map, shape (3,) [m]; by default the palm.
    """

    hand: FloatArray | None = None
    base: Pose | None = None
    counts: tuple[int, int, int] = (15, 15, 15)
    step: float = 0.03
    centre: FloatArray | None = None


def make_scene(
    thing: str | HandoverObject,
    task: str = "to_hand_over",
    receiver: str | Receiver = "H",
    robot: str | Robot = "pr2",
    *,
    layout: Layout | None = None,
) -> Scene:
    """A scene from names or from things of your own.

    Args:
        thing: object of the catalogue, or your own.
        task: what the receiver will do with it, `to_pour` and so on.
        receiver: mobility level, or a receiver.
        robot: `pr2`, `panda`, path of a URDF, or a robot.
        layout: places that differ from the defaults.

    Raises:
        MlnError: unknown name, task that the object does not afford, or a hand where the receiver's arm cannot be.
    """
    layout = layout or Layout()
    thing = read_object(thing) if isinstance(thing, str) else thing
    receiver = read_receiver(receiver) if isinstance(receiver, str) else receiver
    robot = read_robot(robot) if isinstance(robot, str) else robot
    region = region_of(thing, task)
    posture = _posture(receiver, layout.hand)
    hand, face = frame_pose(receiver, posture, "palm"), frame_pose(receiver, posture, "face")
    base = layout.base or robot.base(receiver.body.posture)
    centre = hand.position if layout.centre is None else locked(layout.centre)
    voxels = VoxelMap(Pose(centre), layout.counts, layout.step)
    world = make_world(robot, base, thing, body_capsules(receiver, posture))
    return Scene(thing, task, region, receiver, posture, hand, face, robot, base, voxels, world)


def _posture(receiver: Receiver, hand: FloatArray | None) -> FloatArray:
    if hand is None:
        return receiver.comfort
    if np.shape(hand) != (3,) or not np.isfinite(hand).all():
        raise MlnError(
            f"the hand's position is {hand!r}, expected three finite numbers [m]", hint="x forward, y left, z up"
        )
    q = easiest_posture(receiver, np.asarray(hand, dtype=np.float64))
    if q is None:
        raise MlnError(
            f"the receiver's hand cannot be at {np.round(hand, 3).tolist()} m at mobility {receiver.level.name}",
            hint=f"comfortable is {frame_pose(receiver, receiver.comfort, 'palm').position.round(3).tolist()} m",
        )
    return q
