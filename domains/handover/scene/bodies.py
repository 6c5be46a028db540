"""The receiver's body as capsules: a posture in, places and radii out. Used for collisions and for pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from mlnlite.domains.handover.kinematics.pose import FloatArray, locked
from mlnlite.domains.handover.scene.receiver import Receiver

RADII = {
    "trunk": 0.125,
    "head": 0.10,
    "upper_arm": 0.048,
    "forearm": 0.038,
    "hand": 0.04,
    "thigh": 0.075,
    "shank": 0.055,
}
"""[m] at a stature of 1.74 m; a choice that encloses a clothed body."""


@dataclass(frozen=True, slots=True, eq=False)
class Capsule:
    """Points within `radius` [m] of the segment from `start` to `end`, each of shape (3,) [m] in the world."""

    name: str
    start: FloatArray
    end: FloatArray
    radius: float


def body_capsules(receiver: Receiver, q: FloatArray) -> tuple[Capsule, ...]:
    """Trunk, head, both arms and legs at posture q, shape (8,) [rad]. The other arm rests beside the trunk."""
    model, height = receiver.model, receiver.body.height
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.asarray(q, dtype=np.float64))
    hips = np.array(data.oMi[1].translation)
    shoulder, elbow, wrist = (np.array(data.oMi[i].translation) for i in (2, 5, 7))
    palm = np.array(data.oMf[model.getFrameId("palm")].translation)
    face = data.oMf[model.getFrameId("face")]
    upright, aside = np.array(face.rotation)[:, 2], shoulder[1] - hips[1]
    neck = hips + upright * (shoulder - hips)[2] / max(upright[2], 0.1)
    head = np.array(face.translation) - 0.05 * height * np.array(face.rotation)[:, 0]
    other = shoulder - np.array([0.0, 2 * aside, 0.0])
    low = other - np.array([0.0, 0.0, np.linalg.norm(elbow - shoulder) + np.linalg.norm(wrist - elbow)])
    rows = [("trunk", hips, neck - 0.08 * upright), ("head", head, head), ("upper_arm", shoulder, elbow),
            ("forearm", elbow, wrist), ("hand", palm, palm), ("upper_arm", other, low)]  # fmt: skip
    scale = height / 1.74
    segments = rows + _legs(receiver, hips)
    return tuple(Capsule(name, locked(a), locked(b), scale * RADII[name]) for name, a, b in segments)


def _legs(receiver: Receiver, hips: FloatArray) -> list[tuple[str, FloatArray, FloatArray]]:
    height = receiver.body.height
    thigh = 0.245 * height * np.array([1.0, 0, 0] if receiver.body.posture == "seated" else [0, 0, -1.0])
    rows = []
    for aside in (0.055, -0.055):
        hip = hips + np.array([0.0, aside * height, 0.0])
        knee = hip + thigh
        foot = np.array([knee[0], knee[1], 0.03 * height])
        rows += [("thigh", hip, knee), ("shank", knee, foot)]
    return rows
