"""The three methods of the study: a scene in, a configuration of method A, B or ours out.

A: the object 75 cm from the trunk with an arbitrary grasp. B: 50 cm, with the grasp that suits the task. Both on the
axis from trunk to robot, `CHEST` below the shoulder, whatever the receiver's mobility. Ours: equation 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Literal

import numpy as np

from mlnlite import Diagnostic
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, locked, rotation_about
from mlnlite.domains.handover.scene.grasps import GraspSet, sample_grasps
from mlnlite.domains.handover.scene.receiver import TRUNK
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.scene.voxels import UP, presenting_rotations
from mlnlite.domains.handover.search.costs import distances, reachability, safety
from mlnlite.domains.handover.search.feasibility import Hold, attempt, clear_turns, human_grasp
from mlnlite.domains.handover.search.fields import Options, cost_points, presented_direction
from mlnlite.domains.handover.search.hierarchical import Configuration, Handover, optimise, rank_grasps
from mlnlite.domains.handover.tables import choose

Method = Literal["A", "B", "ours"]
METHODS: tuple[Method, ...] = ("A", "B", "ours")
DISTANCE = {"A": 0.75, "B": 0.50}
"""From the trunk's axis to the object [m], as the paper names them."""
CHEST = 0.20
"""Height of the object below the shoulder in A and B [m]; the paper gives none."""
TRIES = 96
"""Pairs of grasp and orientation that A and B try before they give up."""

_Candidate = tuple[int, int, int, Pose]
"""Rank, grasp, orientation, pose of the object."""


def hand_over(scene: Scene, method: str = "ours", options: Options | None = None, *, seed: int = 0) -> Handover:
    """The configuration of a method.

    Args:
        scene: who, what and where.
        method: `A`, `B` or `ours`.
        options: costs and constraints; A and B ignore the receiver's mobility.
        seed: what is arbitrary in A.

    Raises:
        MlnError: unknown method.
    """
    options = options or Options()
    if choose(method, METHODS, "method") == "ours":
        return optimise(scene, options)
    return _fixed_place(scene, method, options, np.random.default_rng(seed))


def fixed_place(scene: Scene, method: str) -> FloatArray:
    """Where A or B put the object, shape (3,) [m]."""
    hips, shoulder = (scene.receiver.model.jointPlacements[i].translation for i in (TRUNK + 1, TRUNK + 2))
    axis = np.array([scene.base.position[0], scene.base.position[1], 0.0])
    axis = axis / max(float(np.linalg.norm(axis)), 1e-9)
    return locked(DISTANCE[method] * axis + np.array([0.0, 0.0, hips[2] + shoulder[2] - CHEST]))


def _fixed_place(scene: Scene, method: str, options: Options, rng: np.random.Generator) -> Handover:
    grasps = sample_grasps(scene.thing, scene.robot.gripper)
    place, calls = fixed_place(scene, method), 0
    blind = replace(options, receiver=False)
    candidates = _arbitrary(grasps, place, options, rng) if method == "A" else _suited(scene, grasps, place, options)
    for candidate in islice(candidates, TRIES):
        outcome = attempt(scene, grasps, candidate[1], candidate[3], blind)
        calls += outcome.calls
        if outcome.hold is not None:
            found = replace(_priced(scene, grasps, candidate, outcome.hold, options), method=method)
            return Handover("optimal", found, found.reach, calls, 1)
    message = f"method {method}: {scene.robot.name} cannot hold {scene.thing.name} at {np.round(place, 3).tolist()} m"
    advice = Diagnostic("E816", message, hint="use method ours, or move the robot's base")
    return Handover("infeasible", None, float("inf"), calls, 1, advice=(advice,))


def _arbitrary(grasps: GraspSet, place: FloatArray, options: Options, rng: np.random.Generator) -> Iterator[_Candidate]:
    """Any grasp, upright with any heading."""
    n = len(grasps.widths)
    for grasp, turn in zip(rng.permutation(np.repeat(np.arange(n), 4)), rng.permutation(4 * n), strict=True):
        k = int(turn) % options.orientations
        yield 0, int(grasp), k, Pose(place, rotation_about(UP, 2 * np.pi * k / options.orientations))


def _suited(scene: Scene, grasps: GraspSet, place: FloatArray, options: Options) -> Iterator[_Candidate]:
    """Grasps by falling C_A, the human region turned to the palm; where that meets the body, upright."""
    towards, n = presented_direction(scene.thing, scene.region), options.orientations
    presented = presenting_rotations(place[None], scene.hand.position, towards, n)[0]
    rotations = np.concatenate([presented, [rotation_about(UP, 2 * np.pi * k / n) for k in range(n)]])
    clear = np.flatnonzero(clear_turns(scene, place, rotations, options))
    ranked, _ = rank_grasps(scene, grasps)
    for rank, grasp in enumerate(ranked):
        for k in clear:
            yield rank, int(grasp), int(k), Pose(place, rotations[k])


def _priced(scene: Scene, grasps: GraspSet, candidate: _Candidate, held: Hold, options: Options) -> Configuration:
    """A candidate with its costs."""
    rank, grasp, k, pose = candidate
    points = cost_points(scene, grasps.centres[grasp])
    parts = distances(points, pose.position[None], pose.rotation[None, None], options.distance)
    safe = safety(parts.to_hand, parts.to_face, parts.gripper_to_hand, options.limits.safety)
    reach = reachability(parts.to_grasp, options.limits.reach)
    values = rank_grasps(scene, grasps)[1]
    return Configuration("A", pose, human_grasp(scene, pose), grasp, rank, held, -1, k,
                         float(values[grasp]), float(safe[0, 0]), float(reach[0, 0]))  # fmt: skip
