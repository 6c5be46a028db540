from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

from mlnlite.domains.handover.scene.effort import (  # noqa: E402
    GRAVITY,
    easiest_posture,
    effort_at,
    effort_of,
    holding_torque,
    reachable_set,
)
from mlnlite.domains.handover.scene.mobility import read_levels  # noqa: E402
from mlnlite.domains.handover.scene.receiver import Body, frame_pose, read_receiver  # noqa: E402

LEVELS = ("H", "H-M", "L-M", "L")


def _energy(receiver, q, load=0.0):
    data = receiver.model.createData()
    return (
        pin.computePotentialEnergy(receiver.model, data, q)
        + load * GRAVITY * frame_pose(receiver, q, "palm").position[2]
    )


def _draw(receiver, n, seed=0):
    return np.random.default_rng(seed).uniform(receiver.chain.lower, receiver.chain.upper, (n, 8))


@pytest.mark.parametrize("load", [0.0, 0.7])
def test_holding_torque_is_the_slope_of_the_energy(load):
    receiver = read_receiver("H")
    for q in _draw(receiver, 50):
        steps = 1e-5 * np.eye(8)
        slope = [(_energy(receiver, q + s, load) - _energy(receiver, q - s, load)) / 2e-5 for s in steps]
        assert np.abs(holding_torque(receiver, q, load) - slope).max() < 1e-6


def test_inverse_dynamics_gives_the_power_that_the_energy_takes_up():
    receiver = read_receiver("H", Body(height=1.62, mass=58.0, sex="female", side="left", posture="seated"))
    model, data = receiver.model, receiver.model.createData()
    rng = np.random.default_rng(2)
    for q in _draw(receiver, 30):
        velocity, acceleration = rng.normal(size=8), rng.normal(size=8)

        def energy(t, q=q, velocity=velocity, acceleration=acceleration):
            at, speed = q + t * velocity + 0.5 * t * t * acceleration, velocity + t * acceleration
            return pin.computeKineticEnergy(model, data, at, speed) + pin.computePotentialEnergy(model, data, at)

        power = float(pin.rnea(model, data, q, velocity, acceleration) @ velocity)
        assert abs(power - (energy(1e-5) - energy(-1e-5)) / 2e-5) < 1e-6


def test_segments_are_those_of_de_leva():
    receiver = read_receiver("H")
    arm = 73.0 * np.array([0.0271, 0.0162, 0.0061])
    assert np.allclose([receiver.model.inertias[i].mass for i in (4, 6, 8)], arm)
    reach = frame_pose(receiver, np.zeros(8), "palm").position
    shoulder = receiver.model.jointPlacements[1].translation[2] + receiver.model.jointPlacements[2].translation[2]
    scale = 1.74 / 1.741
    assert shoulder - reach[2] == pytest.approx(scale * (0.2817 + 0.2689 + 0.79 * 0.0862))
    forearm = np.diag(receiver.model.inertias[6].inertia)
    assert np.allclose(forearm, arm[1] * (scale * 0.2689) ** 2 * np.square([0.276, 0.265, 0.121]))


def test_left_is_the_mirror_of_right():
    right, left = read_receiver("H"), read_receiver("H", Body(side="left"))
    for q in _draw(right, 20):
        a, b = frame_pose(right, q, "palm"), frame_pose(left, q, "palm")
        assert np.allclose(a.position * (1, -1, 1), b.position)
        assert np.allclose(a.rotation[:, 0] * (1, -1, 1), b.rotation[:, 0])
        assert np.allclose(holding_torque(right, q), holding_torque(left, q))


def test_joint_signs_are_as_documented():
    receiver = read_receiver("H")

    def palm(**angles):
        q = np.zeros(8)
        for name, angle in angles.items():
            q[receiver.chain.names.index(name)] = angle
        return frame_pose(receiver, q, "palm")

    rest = palm()
    assert palm(shoulder_flexion=1.5).position[0] > 0.5
    assert palm(shoulder_abduction=1.5).position[1] < rest.position[1] - 0.5
    assert palm(elbow_flexion=1.5).position[0] > 0.3
    assert rest.rotation[:, 0] @ (0, 1, 0) == pytest.approx(1.0), "the palm faces the thigh"
    assert palm(elbow_flexion=np.pi / 2, forearm_pronation=np.pi / 2).rotation[:, 0] @ (0, 0, -1) == pytest.approx(1.0)
    assert palm(elbow_flexion=np.pi / 2, shoulder_rotation=0.5).position[1] > rest.position[1] + 0.1
    assert palm(wrist_flexion=0.5).position[1] > rest.position[1]
    leaning = np.eye(8)[0] * 0.5
    assert frame_pose(receiver, leaning, "face").position[0] > 0.3
    for pose in (rest, palm(wrist_flexion=0.3, shoulder_flexion=0.4)):
        assert np.linalg.det(pose.rotation) == pytest.approx(1.0)


def test_levels_nest():
    receivers = [read_receiver(level) for level in LEVELS]
    for high, low in pairwise(receivers):
        assert (high.chain.lower <= low.chain.lower + 1e-12).all()
        assert (high.chain.upper >= low.chain.upper - 1e-12).all()
        assert (high.strength > low.strength).all()
        assert ((low.chain.lower <= low.comfort) & (low.comfort <= low.chain.upper)).all()
    assert tuple(level.name for level in read_levels()) == LEVELS


def test_reachable_places_shrink_with_the_level():
    grid = np.array([[x, y, z] for x in (0.3, 0.5, 0.7) for y in (-0.5, -0.2, 0.1) for z in (0.8, 1.0, 1.2, 1.5)])
    counts = [int(reachable_set(read_receiver(level), grid).sum()) for level in LEVELS]
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] < counts[0]


@pytest.mark.parametrize("level", LEVELS)
def test_the_easiest_posture_is_easier_than_any_other_that_is_found(level):
    receiver, load = read_receiver(level), 0.3
    place = np.array([0.42, -0.2, 1.2])

    def price(q):
        share = holding_torque(receiver, q, load) / receiver.strength
        return share @ share + 1e-3 * (q - receiver.comfort) @ (q - receiver.comfort)

    best = easiest_posture(receiver, place, load)
    assert best is not None
    assert np.linalg.norm(frame_pose(receiver, best, "palm").position - place) <= 2e-3
    assert ((receiver.chain.lower <= best) & (best <= receiver.chain.upper)).all()
    model, data = receiver.model, receiver.model.createData()
    jacobian = pin.computeFrameJacobian(model, data, best, model.getFrameId("palm"), pin.LOCAL_WORLD_ALIGNED)[:3]
    free = np.linalg.svd(jacobian)[2][3:]
    for direction in np.random.default_rng(0).normal(size=(100, 5)) @ free:
        other = np.clip(best + 0.02 * direction / np.linalg.norm(direction), receiver.chain.lower, receiver.chain.upper)
        if np.linalg.norm(frame_pose(receiver, other, "palm").position - place) < 1e-3:
            assert price(other) >= price(best) - 2e-3


def test_effort_grows_with_load_and_summaries_agree():
    receiver = read_receiver("H")
    light, heavy = (effort_at(receiver, np.array([0.45, -0.2, 1.15]), load) for load in (0.0, 1.0))
    assert heavy.arm > light.arm
    found = effort_of(receiver, receiver.comfort, 0.5)
    arm = np.abs(found.torque[1:])
    assert (found.arm, found.peak) == (pytest.approx(arm.sum()), pytest.approx(arm.max()))
    assert found.total == pytest.approx(arm.sum() + found.trunk)
    assert effort_at(receiver, np.array([2.0, 0, 1.0])) is None
