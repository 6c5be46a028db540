"""The receiver: body figures and a mobility level in, an anthropometric trunk and arm on Pinocchio out.

World frame: origin on the floor below the hips, x forward, y left, z up [m]. The arm hangs along -z at zero; joint
signs are in `data/anthropometry.toml`. Segment masses and inertias: de Leva (1996).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from mlnlite import MlnError
from mlnlite.domains.handover.kinematics.chain import Chain, chain_of, with_limits
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, locked, pose_from_matrix
from mlnlite.domains.handover.scene.mobility import MobilityLevel, read_level
from mlnlite.domains.handover.tables import DATA, choose, read_table

Side = Literal["right", "left"]
Posture = Literal["seated", "standing"]
TRUNK = 0
"""Index of the trunk's joint; the arm's seven follow."""


@dataclass(frozen=True, slots=True)
class Body:
    """Figures of a person.

    Attributes:
        height: stature [m].
        mass: body mass [kg].
        sex: which table of de Leva.
        side: the hand that takes.
        posture: seated or standing.
    """

    height: float = 1.74
    mass: float = 73.0
    sex: Literal["male", "female"] = "male"
    side: Side = "right"
    posture: Posture = "standing"


@dataclass(frozen=True, slots=True, eq=False)
class Receiver:
    """A body with a mobility level, as a model of 8 joints: trunk lean, shoulder 3, elbow 2, wrist 2.

    Attributes:
        body: the figures.
        level: the mobility.
        model: Pinocchio model with frames `palm`, `face`; its limits are those of the level.
        chain: the same kinematics to the palm as numbers.
        strength: of each joint at the level, shape (8,) [N m].
        comfort: comfortable posture, shape (8,) [rad].
    """

    body: Body
    level: MobilityLevel
    model: pin.Model
    chain: Chain
    strength: FloatArray
    comfort: FloatArray


def read_receiver(level: str | MobilityLevel = "H", body: Body | None = None) -> Receiver:
    """A receiver with a mobility level.

    Args:
        level: name of a level, or a level of your own.
        body: figures of the person; by default the mean man of de Leva, standing, right-handed.

    Raises:
        MlnError: unknown level, side, posture or sex; impossible height or mass.
    """
    found = read_level(level) if isinstance(level, str) else level
    return _receiver(found, _verified(body or Body()))


def _verified(body: Body) -> Body:
    choose(body.sex, ("male", "female"), "sex")
    choose(body.side, ("right", "left"), "side")
    choose(body.posture, ("seated", "standing"), "posture")
    if not 0.8 <= body.height <= 2.5:
        raise MlnError(f"height {body.height} m is outside 0.8 to 2.5 m", hint="heights are in metres")
    if not 10 <= body.mass <= 300:
        raise MlnError(f"mass {body.mass} kg is outside 10 to 300 kg", hint="masses are in kilograms")
    return body


@lru_cache(maxsize=64)
def _receiver(level: MobilityLevel, body: Body) -> Receiver:
    tables = read_table(DATA / "anthropometry.toml")
    joints = tables["joints"]
    model = _model(body, tables)
    ranges = np.radians([joint["range"] for joint in joints.values()])
    comfort = np.radians([joint["comfort"] for joint in joints.values()])
    strength = np.array([joint["strength"] for joint in joints.values()])
    scale = np.full(len(comfort), level.range)
    scale[TRUNK] = level.trunk
    limits = comfort[:, None] + scale[:, None] * (ranges - comfort[:, None])
    model.lowerPositionLimit, model.upperPositionLimit = limits[:, 0], limits[:, 1]
    chain = with_limits(chain_of(model, "palm"), limits[:, 0], limits[:, 1])
    strength = strength * level.strength * tables["strength_of"][body.sex]
    return Receiver(body, level, model, chain, locked(strength), locked(comfort))


def _model(body: Body, tables: dict[str, Any]) -> pin.Model:
    """Chains the segments; lengths grow with stature, masses with body mass."""
    figures, shares = tables[body.sex], tables["proportions"]
    scale, mirror = body.height / figures["stature"], 1.0 if body.side == "right" else -1.0
    axes = {
        "shoulder_flexion": (0, -1, 0), "shoulder_abduction": (-mirror, 0, 0), "shoulder_rotation": (0, 0, mirror),
        "elbow_flexion": (0, -1, 0), "forearm_pronation": (0, 0, mirror),
        "wrist_flexion": (mirror, 0, 0), "wrist_deviation": (0, -1, 0),
    }  # fmt: skip
    down = {name: np.array([0, 0, -scale * figures[name]["length"]]) for name in ("upper_arm", "forearm")}
    shoulder = np.array([0, -mirror * shares["half_shoulder"] * body.height, scale * figures["shoulder_above_hip"]])
    places = {"shoulder_flexion": shoulder, "elbow_flexion": down["upper_arm"], "wrist_flexion": down["forearm"]}
    segments = {"shoulder_rotation": "upper_arm", "forearm_pronation": "forearm", "wrist_deviation": "hand"}
    model = pin.Model()
    hip = np.array([0, 0, shares[f"hip_{body.posture}"] * body.height])
    joint = model.addJoint(0, pin.JointModelRY(), pin.SE3(np.eye(3), hip), "trunk_lean")
    _append_trunk(model, joint, body, figures)
    _add_face(model, joint, body, tables)
    for name, axis in axes.items():
        moving = pin.JointModelRevoluteUnaligned(np.array(axis, dtype=np.float64))
        joint = model.addJoint(joint, moving, pin.SE3(np.eye(3), places.get(name, np.zeros(3))), name)
        if name in segments:
            _append(model, joint, figures[segments[name]], (body.mass, -scale))
    _add_palm(model, joint, scale * figures["hand"]["com"] * figures["hand"]["length"], mirror)
    return model


def _append_trunk(model: pin.Model, joint: int, body: Body, figures: dict[str, Any]) -> None:
    """Trunk, head and the other arm (as a point at its shoulder's height) turn with the hips."""
    scale = body.height / figures["stature"]
    trunk, head = figures["trunk"], figures["head"]
    neck = scale * trunk["length"]
    _append(model, joint, trunk, (body.mass, -scale), neck)
    _append(model, joint, head, (body.mass, -scale), neck + scale * head["length"])
    other = body.mass * sum(figures[name]["mass"] for name in ("upper_arm", "forearm", "hand"))
    middle = np.array([0, 0, scale * (figures["shoulder_above_hip"] - figures["upper_arm"]["length"])])
    model.appendBodyToJoint(joint, pin.Inertia(other, middle, np.zeros((3, 3))), pin.SE3.Identity())


def _append(
    model: pin.Model, joint: int, segment: dict[str, Any], scales: tuple[float, float], top: float = 0.0
) -> None:
    """Hangs a segment from `top` [m] above the joint: I = m L^2 diag(sagittal^2, transverse^2, longitudinal^2)."""
    mass, length = scales[0] * segment["mass"], scales[1] * segment["length"]
    inertia = mass * length**2 * np.diag(np.square(segment["gyration"]))
    centre = np.array([0, 0, top + segment["com"] * length])
    model.appendBodyToJoint(joint, pin.Inertia(mass, centre, inertia), pin.SE3.Identity())


def _add_face(model: pin.Model, joint: int, body: Body, tables: dict[str, Any]) -> None:
    shares, trunk = tables["proportions"], tables[body.sex]["trunk"]
    up = trunk["length"] / tables[body.sex]["stature"] + shares["face_above_cervicale"]
    place = body.height * np.array([shares["face_forward"], 0, up])
    model.addFrame(pin.Frame("face", joint, pin.SE3(np.eye(3), place), pin.FrameType.OP_FRAME))


def _add_palm(model: pin.Model, joint: int, along: float, mirror: float) -> None:
    """Palm frame: x out of the palm, z from wrist to fingers."""
    rotation = np.array([[0.0, -mirror, 0.0], [mirror, 0.0, 0.0], [0.0, 0.0, -1.0]])
    rotation[:, 1] = np.cross(rotation[:, 2], rotation[:, 0])
    model.addFrame(pin.Frame("palm", joint, pin.SE3(rotation, np.array([0, 0, -along])), pin.FrameType.OP_FRAME))


def frame_pose(receiver: Receiver, q: FloatArray, frame: str) -> Pose:
    """Pose of `palm` or `face` in the world [m] at posture q, shape (8,) [rad]."""
    data = receiver.model.createData()
    pin.framesForwardKinematics(receiver.model, data, np.asarray(q, dtype=np.float64))
    return pose_from_matrix(data.oMf[receiver.model.getFrameId(frame)].homogeneous)


def at_level(receiver: Receiver, level: str | MobilityLevel) -> Receiver:
    """The same body with another mobility."""
    return read_receiver(level, replace(receiver.body))
