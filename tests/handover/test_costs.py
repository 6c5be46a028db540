from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pinocchio")

from mlnlite.domains.handover.kinematics.pose import Pose, compose, inverse, pose_at, rotation_about, transform_points
from mlnlite.domains.handover.scene.voxels import VoxelMap, presenting_rotations, voxel_centres
from mlnlite.domains.handover.search.costs import Points, appropriateness, distances, reachability, safety

KINDS = ["point", "surface"]


def _points(seed=0):
    rng = np.random.default_rng(seed)
    surface = 0.05 * rng.normal(size=(60, 3))
    return Points(rng.normal(size=3), rng.normal(size=3), surface[0], surface[:20], surface[5], surface)


def _poses(points, n=40, k=4):
    centres = points.hand + 0.2 * np.random.default_rng(1).normal(size=(n, 3))
    return centres, presenting_rotations(centres, points.hand, np.array([1.0, 0, 0]), k)


def test_costs_are_those_of_a_plain_loop():
    points = _points()
    centres, rotations = _poses(points)
    found = distances(points, centres, rotations)
    for v in range(len(centres)):
        for k in range(rotations.shape[1]):
            place = rotations[v, k] @ points.region_centre + centres[v]
            gripper = rotations[v, k] @ points.grasp + centres[v]
            assert found.to_grasp[v, k] == pytest.approx(np.linalg.norm(place - points.hand))
            assert found.gripper_to_hand[v, k] == pytest.approx(np.linalg.norm(gripper - points.hand))
            assert found.to_hand[v, k] == pytest.approx(np.linalg.norm(centres[v] - points.hand))
            assert found.to_face[v, k] == pytest.approx(np.linalg.norm(centres[v] - points.face))
    region = points.region
    grasps = points.surface[20:]
    expected = [min(np.linalg.norm(g - h) for h in region) for g in grasps]
    assert np.allclose(appropriateness(grasps, region), expected)


def test_surface_distances_are_those_of_a_plain_loop():
    points = _points(3)
    centres, rotations = _poses(points, n=10, k=2)
    found = distances(points, centres, rotations, "surface")
    for v in range(10):
        for k in range(2):
            moved = points.surface @ rotations[v, k].T + centres[v]
            nearest = np.linalg.norm(moved - points.hand, axis=1).min() - 0.04
            assert found.to_hand[v, k] == pytest.approx(max(0.0, nearest))
            region = points.region @ rotations[v, k].T + centres[v]
            assert found.to_grasp[v, k] == pytest.approx(np.linalg.norm(region - points.hand, axis=1).min())


def test_thresholds_are_exact():
    near, far = np.array([0.04999, 0.05, 0.2]), np.full(3, 0.3)
    assert safety(near, far, far, 0.05).tolist() == pytest.approx([0.0, 0.65, 0.8])
    assert np.allclose(safety(far, near, far, 0.05), safety(near, far, far, 0.05))
    assert np.allclose(safety(far, far, near, 0.05), safety(near, far, far, 0.05))
    assert reachability(np.array([0.75, 0.7500001]), 0.75).tolist() == [0.75, np.inf]


@pytest.mark.parametrize("kind", KINDS)
def test_costs_do_not_change_under_a_rigid_motion(kind):
    points = _points(5)
    centres, rotations = _poses(points)
    motion = Pose(np.array([0.3, -2.0, 0.7]), rotation_about(np.array([0.36, 0.48, 0.8]), 1.1))
    other = Points(transform_points(motion, points.hand), transform_points(motion, points.face),
                   points.grasp, points.region, points.region_centre, points.surface)  # fmt: skip
    here = distances(points, centres, rotations, kind)
    there = distances(other, transform_points(motion, centres), motion.rotation @ rotations, kind)
    for name in ("to_hand", "to_face", "gripper_to_hand", "to_grasp"):
        assert np.allclose(getattr(here, name), getattr(there, name), atol=1e-12)


@pytest.mark.parametrize("scale", [0.1, 3.0])
def test_costs_grow_with_the_scale(scale):
    points = _points(6)
    centres, rotations = _poses(points)
    big = Points(*(scale * getattr(points, name) for name in Points.__slots__))
    here, there = distances(points, centres, rotations), distances(big, scale * centres, rotations)
    for name in ("to_hand", "to_face", "gripper_to_hand", "to_grasp"):
        assert np.allclose(scale * getattr(here, name), getattr(there, name))
    safe = safety(here.to_hand, here.to_face, here.gripper_to_hand, 0.2)
    assert np.allclose(scale * safe, safety(there.to_hand, there.to_face, there.gripper_to_hand, 0.2 * scale))


def test_the_object_presents_its_region_to_the_palm_and_stands_upright_first():
    palm, towards = np.array([0.3, -0.2, 1.1]), np.array([0.6, 0.0, 0.8])
    centres = palm + np.array([[0.2, 0, 0], [0, 0.3, 0.0], [0.1, 0.1, -0.2], [0, 0, 0.2]])
    rotations = presenting_rotations(centres, palm, towards, 8)
    want = (palm - centres) / np.linalg.norm(palm - centres, axis=1, keepdims=True)
    assert np.allclose(rotations @ towards, want[:, None])
    assert np.allclose(rotations @ rotations.transpose(0, 1, 3, 2), np.eye(3))
    assert np.allclose(np.linalg.det(rotations), 1.0)
    upright = presenting_rotations(centres[:1], palm, np.array([1.0, 0, 0]), 4)[0, 0]
    assert np.allclose(upright @ (0, 0, 1), (0, 0, 1))


def test_voxels_fill_their_box():
    voxels = VoxelMap(pose_at(1.0, 2.0, 3.0, 0.5), (3, 4, 5), 0.1)
    centres = voxel_centres(voxels)
    assert centres.shape == (60, 3)
    assert np.allclose(centres.mean(axis=0), (1, 2, 3))
    assert np.linalg.norm(centres[1] - centres[0]) == pytest.approx(0.1)


def test_poses_form_a_group():
    a = Pose(np.array([1.0, 2.0, 3.0]), rotation_about((0, 0, 1), 0.4))
    b = Pose(np.array([-1.0, 0.5, 0.2]), rotation_about((1, 0, 0), -1.2))
    assert np.allclose(compose(a, b).matrix, a.matrix @ b.matrix)
    assert np.allclose(compose(a, inverse(a)).matrix, np.eye(4))
    assert np.allclose(np.linalg.norm(b.quaternion), 1.0)
    assert b.quaternion[0] >= 0
    with pytest.raises(ValueError, match="read-only"):
        a.position[0] = 5.0
