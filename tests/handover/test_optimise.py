from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from time import process_time

import numpy as np
import pytest

pytest.importorskip("pinocchio")

from mlnlite import MlnError
from mlnlite.domains.handover.kinematics.pose import pose_at
from mlnlite.domains.handover.scene.collision import clearance, is_free, touching
from mlnlite.domains.handover.scene.objects import object_names, read_object
from mlnlite.domains.handover.scene.receiver import Body, read_receiver
from mlnlite.domains.handover.scene.scene import Layout, make_scene
from mlnlite.domains.handover.search.checks import CHECKS, five_checks, receiver_effort, violations
from mlnlite.domains.handover.search.costs import Limits
from mlnlite.domains.handover.search.feasibility import default_solver
from mlnlite.domains.handover.search.fields import Options
from mlnlite.domains.handover.search.hierarchical import optimise, require
from mlnlite.domains.handover.search.methods import METHODS, hand_over

LEVELS = ("H", "H-M", "L-M", "L")
SMALL = Options(orientations=4, grasps=2, ik_calls=10**6)


def random_scene(seed, counts=(6, 6, 6), step=0.06):
    """A scene drawn at random: object, task, level, robot, body, hand; small enough to ask about every voxel."""
    rng = np.random.default_rng(seed)
    names = object_names()
    thing = read_object(names[rng.integers(len(names))])
    task = thing.affordances[rng.integers(len(thing.affordances))][0]
    body = Body(height=float(rng.uniform(1.55, 1.9)), mass=float(rng.uniform(50, 95)),
                sex=("male", "female")[rng.integers(2)], posture=("standing", "seated")[rng.integers(2)])  # fmt: skip
    receiver = read_receiver(LEVELS[rng.integers(4)], body)
    centre = make_scene(thing, task, receiver).hand.position + rng.uniform(-0.05, 0.05, 3)
    layout = Layout(counts=counts, step=step, centre=centre)
    return make_scene(thing, task, receiver, ("pr2", "panda")[rng.integers(2)], layout=layout)


@pytest.mark.parametrize("seed", range(50))
def test_best_first_is_exhaustive_and_sound(seed):
    scene = random_scene(seed)
    options = replace(SMALL, distance="point" if seed % 5 else "surface")
    fast, slow = optimise(scene, options), optimise(scene, options, exhaustive=True)
    assert fast.status == slow.status
    assert fast.ik_calls <= slow.ik_calls
    assert fast.voxels <= slow.voxels
    if fast.configuration is None:
        assert fast.advice
        return
    a, b = fast.configuration, slow.configuration
    assert (a.voxel, a.orientation, a.grasp, a.reach, a.safety) == (b.voxel, b.orientation, b.grasp, b.reach, b.safety)
    assert np.array_equal(a.hold.q, b.hold.q)
    assert fast.bound == a.reach
    assert violations(scene, a, options) == ()


@pytest.mark.parametrize("cost", ["C_A", "C_S", "C_R"])
def test_without_a_cost_the_others_fare_no_worse(cost):
    for seed in (3, 5):
        scene, options = random_scene(seed), replace(SMALL, grasps=1, without=(cost,))
        fast, slow = optimise(scene, options), optimise(scene, options, exhaustive=True)
        a, b = fast.configuration, slow.configuration
        assert (a.voxel, a.orientation, a.grasp) == (b.voxel, b.orientation, b.grasp)
        whole = optimise(scene, replace(SMALL, grasps=1)).configuration
        assert cost != "C_A" or a.appropriateness <= whole.appropriateness
        assert cost != "C_S" or a.reach <= whole.reach
        assert cost != "C_R" or a.safety >= whole.safety


def test_most_random_scenes_are_feasible():
    found = [optimise(random_scene(seed), SMALL).configuration is not None for seed in range(20)]
    assert sum(found) >= 15


def test_a_stricter_threshold_never_improves_the_optimum():
    for seed in (1, 4, 11, 12):
        scene = random_scene(seed, (7, 7, 7), 0.04)
        reaches = []
        for safe in (0.0, 0.05, 0.10, 0.15, 0.20):
            found = optimise(scene, replace(SMALL, grasps=1, limits=Limits(safety=safe))).configuration
            reaches.append(np.inf if found is None else found.reach)
        assert reaches == sorted(reaches)
        for bound in (0.3, 0.1, 0.02):
            found = optimise(scene, replace(SMALL, grasps=1, limits=Limits(reach=bound))).configuration
            assert (np.inf if found is None else found.reach) >= reaches[1]


def test_collisions_and_the_receiver_only_take_away():
    scene = random_scene(3, (7, 7, 7), 0.04)
    free = optimise(scene, replace(SMALL, grasps=1, collisions=False, receiver=False)).configuration
    held = optimise(scene, replace(SMALL, grasps=1)).configuration
    assert free.reach <= held.reach


@pytest.mark.parametrize("robot", ["pr2", "panda"])
@pytest.mark.parametrize("name", ["mug", "book", "screwdriver", "cereal_box"])
def test_full_maps_have_proven_and_sound_answers(name, robot):
    scene = make_scene(name, receiver="L-M", robot=robot)
    result = optimise(scene)
    found = require(result)
    assert result.status == "optimal"
    assert violations(scene, found) == ()
    assert is_free(scene.world, found.hold.q)
    assert clearance(scene.world, found.hold.q) > 0
    assert touching(scene.world, found.hold.q) == ()


def test_one_optimisation_is_quick_enough():
    scenes = [
        make_scene(name, receiver="L-M", robot=robot) for name in object_names()[::4] for robot in ("pr2", "panda")
    ]
    times = []
    for scene in scenes:
        start = process_time()
        optimise(scene)
        times.append(process_time() - start)
    assert np.median(times) <= 0.15


def test_another_solver_can_be_plugged_in():
    pytest.importorskip("pink")
    from mlnlite.domains.handover.scene.ik_pink import pink_solver

    scene = make_scene("marker", "to_write", "L-M")
    options = Options(solver=pink_solver(scene.robot))
    found = require(optimise(scene, options))
    assert violations(scene, found, options) == ()
    assert found.reach == pytest.approx(require(optimise(scene)).reach, abs=0.02)


SCRIPT = """
from mlnlite.domains.handover import make_scene
from mlnlite.domains.handover import hand_over
for robot in ("pr2", "panda"):
    for method in ("A", "B", "ours"):
        found = hand_over(make_scene("mug", "to_pour", "L-M", robot), method).configuration
        print(method, found.voxel, found.orientation, found.grasp, found.hold.q.tobytes().hex())
"""


def test_other_processes_give_the_same_bits():
    runs = [
        subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True).stdout for _ in "ab"
    ]
    assert runs[0] == runs[1]
    assert runs[0].count("\n") == 6


def test_the_limit_of_calls_is_a_status_with_a_bound():
    """A solver that finds nothing at first: the search stops at the limit, or goes on to the end."""
    scene, asked = make_scene("plate", robot="panda"), []

    def late(target, accept=None):
        asked.append(1)
        found = default_solver(scene.robot.chain)(target, accept)
        return found if len(asked) > 20 else replace(found, found=False)

    stopped = optimise(scene, Options(solver=late, ik_calls=3))
    asked.clear()
    whole = optimise(scene, Options(solver=late))
    assert whole.ik_calls > 20
    assert stopped.status == "limit"
    assert stopped.bound <= whole.configuration.reach
    assert "within 3 calls" in str(stopped.advice[0])


@pytest.mark.parametrize(
    ("layout", "options", "code", "words"),
    [
        (
            Layout(counts=(3, 3, 3), step=0.001),
            Options(limits=Limits(safety=0.3)),
            "E811",
            "safety distance of at most",
        ),
        (Layout(centre=np.array([1.6, -0.2, 1.1])), Options(), "E812", "allow a reach of"),
        (Layout(base=pose_at(4.0, 0, 0, np.pi)), Options(), "E813", "move the base of the robot 2."),
        (Layout(), Options(limits=Limits(safety=0.25, reach=0.1)), "E814", "asks for a reach of"),
        (Layout(counts=(3, 3, 3), step=0.035), Options(), "E815", "without regard to collisions there is"),
    ],
)
def test_infeasible_scenes_say_why_and_what_would_help(layout, options, code, words):
    result = optimise(make_scene("mug", layout=layout), options)
    assert result.status == "infeasible"
    assert result.advice[0].code.startswith(code)
    assert words in str(result.advice[0])
    with pytest.raises(MlnError, match=words):
        require(result)


def test_the_relaxation_that_is_named_is_enough():
    scene = make_scene("mug", layout=Layout(counts=(3, 3, 3), step=0.02))
    tight = Options(limits=Limits(safety=0.3), collisions=False, receiver=False)
    words = optimise(scene, tight).advice[0].hint.split()
    least = float(words[words.index("most") + 1])
    relaxed = replace(tight, limits=Limits(safety=least - 0.0006))
    assert "E811" not in [d.code for d in optimise(scene, relaxed).advice]


def test_a_receiver_out_of_reach_is_named():
    layout = Layout(centre=np.array([0.75, 0.25, 1.45]), counts=(5, 5, 5), step=0.02)
    result = optimise(make_scene("mug", receiver="L", layout=layout))
    assert result.status == "infeasible"
    assert "mobility L " in str(result.advice[0])
    assert "at mobility H-M there is an answer" in result.advice[0].hint
    assert optimise(make_scene("mug", receiver="H-M", layout=layout)).configuration is not None


def test_methods_order_in_effort_and_reach():
    arms = {(level, method): [] for level in LEVELS for method in METHODS}
    reached = dict.fromkeys(arms, 0)
    for level in LEVELS:
        for name in ("mug", "book", "marker", "shoe", "bottle", "plate"):
            scene = make_scene(name, receiver=level)
            efforts = {m: receiver_effort(scene, hand_over(scene, m).configuration) for m in METHODS}
            reachable = {m: e is not None and e.share <= 1 for m, e in efforts.items()}
            for method in METHODS:
                reached[level, method] += reachable[method]
            if all(reachable.values()):
                assert efforts["ours"].total < efforts["B"].total < efforts["A"].total
                for method in METHODS:
                    arms[level, method].append(efforts[method].arm)
    for level in LEVELS:
        assert reached[level, "ours"] >= reached[level, "B"] >= reached[level, "A"]
        if arms[level, "A"]:
            means = [np.mean(arms[level, method]) for method in ("ours", "B", "A")]
            assert means == sorted(means)
    assert all(arms[level, "A"] for level in ("H", "H-M", "L-M"))


def test_five_checks_pass_and_can_fail():
    scene = make_scene("mug", "to_pour", "H")
    found = require(optimise(scene))
    checks = five_checks(scene, found)
    assert tuple(check.name for check in checks) == CHECKS
    assert all(check.passed for check in checks)
    wide = replace(found, human_grasp=np.array([3.0, 0, 1.0]))
    assert not five_checks(scene, wide)[2].passed
    near = replace(found, thing=replace(found.thing, position=scene.hand.position))
    assert not five_checks(scene, near)[4].passed
    assert "the tool is not at the grasp" in violations(scene, near)
    arbitrary = hand_over(scene, "A", seed=3).configuration
    from mlnlite.domains.handover.scene.grasps import sample_grasps

    on_handle = int(
        np.flatnonzero((sample_grasps(scene.thing, scene.robot.gripper).labels == scene.region).all(axis=1))[0]
    )
    assert not five_checks(scene, replace(arbitrary, grasp=on_handle))[3].passed
