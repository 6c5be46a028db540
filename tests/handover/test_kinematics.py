from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

from mlnlite.domains.handover.kinematics.chain import reach_bound, tool_poses  # noqa: E402
from mlnlite.domains.handover.kinematics.ik import Tolerance, damped_least_squares  # noqa: E402
from mlnlite.domains.handover.kinematics.ik_kernel import forward, solve  # noqa: E402
from mlnlite.domains.handover.kinematics.pose import angle_between  # noqa: E402
from mlnlite.domains.handover.scene.robots import read_robot  # noqa: E402

spec = importlib.util.spec_from_file_location("ik_twin", Path(__file__).with_name("ik_twin.py"))
twin = importlib.util.module_from_spec(spec)
spec.loader.exec_module(twin)

ARM = """<robot name="bench_arm">
  <link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <link name="hand"/><link name="jaw"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="a"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.3 -0.2 0.5"/><axis xyz="0 0 1"/></joint>
  <joint name="tilt" type="revolute"><parent link="a"/><child link="b"/>
    <origin xyz="0 0.05 0.2" rpy="1.0 0 0.4"/><axis xyz="0.6 0.8 0"/>
    <limit lower="-2" upper="1.5" effort="9" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="b"/><child link="c"/>
    <origin xyz="0.2 0 0" rpy="0 0.7 0"/><axis xyz="0 0.6 0.8"/>
    <limit lower="-0.1" upper="0.4" effort="9" velocity="1"/></joint>
  <joint name="bend" type="revolute"><parent link="c"/><child link="d"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="9" velocity="1"/></joint>
  <joint name="tip" type="fixed"><parent link="d"/><child link="hand"/>
    <origin xyz="0.1 0.02 0.03" rpy="0.1 0.2 0.3"/></joint>
  <joint name="grip" type="prismatic"><parent link="hand"/><child link="jaw"/>
    <origin xyz="0 0 0.05"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04" effort="9" velocity="1"/></joint>
</robot>"""
STEPS = [  # origin, rpy, axis, slides: the same arm, written down a second time
    ((0.1, 0.2, 0.3), (0.3, -0.2, 0.5), (0, 0, 1), False),
    ((0, 0.05, 0.2), (1.0, 0, 0.4), (0.6, 0.8, 0), False),
    ((0.2, 0, 0), (0, 0.7, 0), (0, 0.6, 0.8), True),
    ((0, 0, 0.3), (0, 0, 0), (0, 1, 0), False),
]


def _rotation(rpy):
    (r, p, y) = rpy
    x = np.array([[1, 0, 0], [0, np.cos(r), -np.sin(r)], [0, np.sin(r), np.cos(r)]])
    m = np.array([[np.cos(p), 0, np.sin(p)], [0, 1, 0], [-np.sin(p), 0, np.cos(p)]])
    z = np.array([[np.cos(y), -np.sin(y), 0], [np.sin(y), np.cos(y), 0], [0, 0, 1]])
    return z @ m @ x


def _by_hand(q):
    """Quaternion-free forward kinematics that shares no code with the package."""
    rotation, position = np.eye(3), np.zeros(3)
    for (origin, rpy, axis, slides), angle in zip(STEPS, q, strict=True):
        position = position + rotation @ np.array(origin)
        rotation = rotation @ _rotation(rpy)
        axis = np.array(axis, dtype=float)
        if slides:
            position = position + rotation @ axis * angle
        else:
            outer, identity = np.outer(axis, axis), np.eye(3)
            cross = np.cross(identity, axis)
            rotation = rotation @ (outer + np.cos(angle) * (identity - outer) + np.sin(angle) * cross)
    return rotation @ _rotation((0.1, 0.2, 0.3)), position + rotation @ np.array((0.1, 0.02, 0.03))


@pytest.fixture
def bench_arm(tmp_path):
    path = tmp_path / "bench.urdf"
    path.write_text(ARM)
    return read_robot(str(path), tool="hand")


def _pinocchio(robot, q):
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return np.array(data.oMf[robot.model.getFrameId(robot.tool)].homogeneous)


def test_forward_kinematics_of_my_own_arm_in_three_ways(bench_arm):
    assert bench_arm.chain.names == ("turn", "tilt", "slide", "bend")
    draw = np.random.default_rng(1).uniform(bench_arm.chain.lower, bench_arm.chain.upper, (1000, 4))
    poses, frames = tool_poses(bench_arm.chain, draw), np.empty((5, 3, 4))
    for q, pose in zip(draw, poses, strict=True):
        rotation, position = _by_hand(q)
        forward(bench_arm.chain.table, q, frames)
        for found in (pose[:3], _pinocchio(bench_arm, q)[:3], frames[4]):
            assert np.abs(found[:, :3] - rotation).max() < 1e-9
            assert np.abs(found[:, 3] - position).max() < 1e-9


@pytest.mark.parametrize("name", ["pr2", "panda"])
def test_inverse_kinematics_finds_random_reachable_poses(name):
    robot = read_robot(name)
    rng = np.random.default_rng(5)
    draw = rng.uniform(robot.chain.lower, robot.chain.upper, (1000, 7))
    solver, good = damped_least_squares(robot.chain), 0
    for target in tool_poses(robot.chain, draw):
        found = solver(target)
        if found.found:
            assert (found.q >= robot.chain.lower).all()
            assert (found.q <= robot.chain.upper).all()
            reached = _pinocchio(robot, found.q)
            assert np.linalg.norm(reached[:3, 3] - target[:3, 3]) <= 1e-3
            assert angle_between(reached[:3, :3], target[:3, :3]) <= 1e-2
            good += 1
    assert good >= 990


def test_compiled_solver_walks_like_its_twin():
    robot = read_robot("pr2")
    rng = np.random.default_rng(7)
    settings = np.array([40, 1e-3, 1e-2, 0.3, 0.7])
    for target in tool_poses(robot.chain, rng.uniform(robot.chain.lower, robot.chain.upper, (10, 7))):
        starts = rng.uniform(robot.chain.lower, robot.chain.upper, (2, 7))
        q, index, _ = solve(robot.chain.table, np.ascontiguousarray(target[:3]), starts, settings)
        expected, expected_index = twin.solve(robot.chain.table, target, starts, settings)
        assert index == expected_index
        if index >= 0:
            assert np.abs(q - expected).max() < 1e-6


def test_jacobian_of_the_twin_is_the_slope_of_the_kinematics():
    chain = read_robot("panda").chain
    q = np.random.default_rng(3).uniform(chain.lower, chain.upper)
    slope = twin.jacobian(chain.table, twin.joint_frames(chain.table, q))
    for i in range(7):
        step = 1e-6 * np.eye(7)[i]
        ahead, behind = tool_poses(chain, np.stack([q + step, q - step]))
        turn, angle = twin.rotation_vector(ahead[:3, :3] @ behind[:3, :3].T)
        assert np.allclose((ahead[:3, 3] - behind[:3, 3]) / 2e-6, slope[:3, i], atol=1e-6)
        assert np.allclose(turn / 2e-6, slope[3:, i], atol=1e-6)
        assert angle < 1e-3


def test_the_solver_is_a_function_of_its_seed_and_target():
    chain = read_robot("pr2").chain
    target = tool_poses(chain, np.random.default_rng(9).uniform(chain.lower, chain.upper, (1, 7)))[0]
    first, second = (damped_least_squares(chain, seed=4)(target) for _ in range(2))
    assert np.array_equal(first.q, second.q)
    assert first.steps == second.steps


def test_nothing_leaves_the_reach_bound_and_far_targets_cost_no_step():
    for name in ("pr2", "panda"):
        chain = read_robot(name).chain
        wrist, centre, radius = reach_bound(chain)
        poses = tool_poses(chain, np.random.default_rng(0).uniform(chain.lower, chain.upper, (5000, 7)))
        wrists = poses[:, :3, :3] @ wrist + poses[:, :3, 3]
        assert np.linalg.norm(wrists - centre, axis=1).max() <= radius + 1e-12
        target = np.eye(4)
        target[:3, 3] = (5.0, 0, 0)
        found = damped_least_squares(chain, table=100)(target)
        assert not found.found
        assert found.steps == 0


def test_a_refused_solution_leads_to_another():
    chain = read_robot("pr2").chain
    solver = damped_least_squares(chain, tolerance=Tolerance(1e-3, 1e-2))
    target = tool_poses(chain, np.array([[-0.5, 0.3, -1.0, -1.2, 0.4, -0.9, 0.2]]))[0]
    first = solver(target)
    other = solver(target, lambda q: bool(np.abs(q - first.q).max() > 0.05))
    assert other.found
    assert other.refused >= 1
    assert np.abs(other.q - first.q).max() > 0.05


def test_pink_reaches_the_same_poses_another_way():
    pytest.importorskip("pink")
    from mlnlite.domains.handover.scene.ik_pink import pink_solver

    robot = read_robot("pr2")
    solver = pink_solver(robot)
    draw = np.random.default_rng(8).uniform(robot.chain.lower, robot.chain.upper, (40, 7))
    found = [solver(target) for target in tool_poses(robot.chain, draw)]
    assert sum(f.found for f in found) >= 38
    for solution, target in zip(found, tool_poses(robot.chain, draw), strict=True):
        if solution.found:
            reached = _pinocchio(robot, solution.q)
            assert np.linalg.norm(reached[:3, 3] - target[:3, 3]) <= 1e-3
            assert (robot.chain.lower - 1e-9 <= solution.q).all()
            assert (solution.q <= robot.chain.upper + 1e-9).all()


def test_machine_code_finds_a_place_where_nothing_can_be_written(monkeypatch, tmp_path):
    import os

    from mlnlite.domains.handover.compiled import prepare_cache

    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    prepare_cache(tmp_path / "__pycache__")
    assert "NUMBA_CACHE_DIR" not in os.environ
    monkeypatch.setattr(os, "access", lambda *_: False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    prepare_cache(tmp_path / "__pycache__")
    assert "mlnlite-" in os.environ["NUMBA_CACHE_DIR"]
