"""Arm effort: a receiver and a place for the palm in, a posture and its joint torques out.

Static holding torque by inverse dynamics at rest (Pinocchio's RNEA) plus the object's weight at the palm:
`tau(q) = g(q) + J(q)^T [0, 0, m 9.81]`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.optimize import NonlinearConstraint, minimize

from mlnlite.domains.handover.kinematics.ik import DampedLeastSquares, IkSolution, Tolerance, damped_least_squares
from mlnlite.domains.handover.kinematics.pose import FloatArray, locked
from mlnlite.domains.handover.scene.receiver import TRUNK, Receiver

GRAVITY = 9.81
"""[m/s^2]"""


@dataclass(frozen=True, slots=True, eq=False)
class Effort:
    """Torques of a posture.

    Attributes:
        q: posture, shape (8,) [rad].
        torque: of each joint, shape (8,) [N m].
        total: sum of |torque| over the arm's joints and the trunk [N m].
        arm: sum of |torque| over the seven arm joints [N m].
        norm: Euclidean norm over the arm joints [N m].
        peak: largest |torque| of an arm joint [N m].
        trunk: |torque| of the trunk's lean [N m].
        share: largest share of strength over all joints; above 1 the posture cannot be held.
    """

    q: FloatArray
    torque: FloatArray
    total: float
    arm: float
    norm: float
    peak: float
    trunk: float
    share: float


def holding_torque(receiver: Receiver, q: FloatArray, load: float = 0.0) -> FloatArray:
    """Torques, shape (8,) [N m], that hold posture q, shape (8,) [rad], with a load [kg] at the palm."""
    model = receiver.model
    data = model.createData()
    return _torque(receiver, data, np.asarray(q, dtype=np.float64), load)


def _torque(receiver: Receiver, data: pin.Data, q: FloatArray, load: float) -> FloatArray:
    model = receiver.model
    gravity = np.array(pin.computeGeneralizedGravity(model, data, q))
    jacobian = pin.computeFrameJacobian(model, data, q, model.getFrameId("palm"), pin.LOCAL_WORLD_ALIGNED)
    total: FloatArray = gravity + load * GRAVITY * np.array(jacobian)[2]
    return total


def effort_of(receiver: Receiver, q: FloatArray, load: float = 0.0) -> Effort:
    """Summary of the torques that hold posture q, shape (8,) [rad], with a load [kg]."""
    torque = holding_torque(receiver, q, load)
    arm = np.abs(torque[TRUNK + 1 :])
    share = float((np.abs(torque) / receiver.strength).max())
    summary = (
        float(np.abs(torque).sum()),
        float(arm.sum()),
        float(np.linalg.norm(arm)),
        float(arm.max()),
        float(abs(torque[TRUNK])),
    )
    return Effort(locked(q), locked(torque), *summary, share)


def easiest_posture(receiver: Receiver, place: FloatArray, load: float = 0.0) -> FloatArray | None:
    """The posture with the palm at `place`, shape (3,) [m], that asks least of the joints; None if out of reach.

    Minimises `sum_i (tau_i(q) / strength_i)^2 + 1e-3 |q - comfort|^2` subject to `palm(q) = place` and the level's
    ranges of motion, by sequential quadratic programming from an inverse-kinematics solution near the comfortable
    posture.
    """
    start = _reach(receiver, place)
    return locked(_minimise(receiver, start.q, np.asarray(place), load)) if start.found else None


def can_reach(receiver: Receiver, place: FloatArray) -> bool:
    """Whether some posture within the level's ranges of motion brings the palm to `place`, shape (3,) [m], to 1 mm."""
    return _reach(receiver, place).found


def reachable_set(receiver: Receiver, places: FloatArray) -> NDArray[np.bool_]:
    """Which places, shape (n, 3) [m], the palm can be brought to; shape (n,). About 0.1 ms each."""
    return np.array([can_reach(receiver, place) for place in places], dtype=np.bool_)


def _reach(receiver: Receiver, place: FloatArray) -> IkSolution:
    return _reacher(receiver)(np.hstack([np.eye(3), np.asarray(place, dtype=np.float64)[:, None]]))


@lru_cache(maxsize=64)
def _reacher(receiver: Receiver) -> DampedLeastSquares:
    tolerance = Tolerance(position=1e-3)
    return damped_least_squares(receiver.chain, table=4000, starts=8, tolerance=tolerance, position_only=True)


def _minimise(receiver: Receiver, start: FloatArray, place: FloatArray, load: float) -> FloatArray:
    model, data = receiver.model, receiver.model.createData()
    palm = model.getFrameId("palm")

    def cost(q: FloatArray) -> tuple[float, FloatArray]:
        share = _torque(receiver, data, q, load) / receiver.strength
        away = q - receiver.comfort
        slope = _torque_slope(receiver, data, q, load) / receiver.strength[:, None]
        return float(share @ share + 1e-3 * away @ away), 2 * share @ slope + 2e-3 * away

    def gap(q: FloatArray) -> FloatArray:
        pin.framesForwardKinematics(model, data, q)
        return np.array(data.oMf[palm].translation) - place

    def gap_slope(q: FloatArray) -> FloatArray:
        return np.array(pin.computeFrameJacobian(model, data, q, palm, pin.LOCAL_WORLD_ALIGNED))[:3]

    bounds = list(zip(receiver.chain.lower, receiver.chain.upper, strict=True))
    held = NonlinearConstraint(gap, 0.0, 0.0, jac=gap_slope)
    found = minimize(cost, start, jac=True, bounds=bounds, constraints=[held], method="SLSQP",
                     options={"maxiter": 60, "ftol": 1e-8})  # fmt: skip
    q = np.clip(found.x, receiver.chain.lower, receiver.chain.upper)
    return q if np.linalg.norm(gap(q)) <= 2e-3 else start


def _torque_slope(receiver: Receiver, data: pin.Data, q: FloatArray, load: float) -> FloatArray:
    """Derivative of the holding torque by q, shape (8, 8) [N m/rad]: that of gravity, and of the load's lever."""
    model = receiver.model
    slope = np.array(pin.computeGeneralizedGravityDerivatives(model, data, q))
    if load:
        slope = slope + load * GRAVITY * _height_curvature(receiver, data, q)
    return slope


def _height_curvature(receiver: Receiver, data: pin.Data, q: FloatArray) -> FloatArray:
    """Hessian of the palm's height by q, shape (8, 8) [m/rad^2]: d2z/dqi dqj = (a_i x (a_j x r_j))_z for i before j."""
    model = receiver.model
    pin.framesForwardKinematics(model, data, q)
    tip = np.array(data.oMf[model.getFrameId("palm")].translation)
    rows = receiver.chain.table[:-1]
    places = [data.oMi[i + 1] for i in range(len(rows))]
    axes = np.array([place.rotation @ row[16:19] for place, row in zip(places, rows, strict=True)])
    arms = np.cross(axes, tip - np.array([place.translation for place in places]))
    upper = np.triu(np.cross(axes[:, None], arms[None])[:, :, 2])
    return np.asarray(upper + np.triu(upper, 1).T)


def effort_at(receiver: Receiver, place: FloatArray, load: float = 0.0) -> Effort | None:
    """Effort of the easiest posture with the palm at `place`, shape (3,) [m]; None if out of reach."""
    q = easiest_posture(receiver, place, load)
    return None if q is None else effort_of(receiver, q, load)
