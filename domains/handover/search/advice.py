"""Why nothing was found: cost fields and counts in, the constraint in the way and its nearest relaxation out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mlnlite import Diagnostic
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.search.fields import CostField, Options

UNSOLVED = "E815"
"""The costs leave candidates, and each fails on something that only a solver can tell."""
BLAMES = ("receiver", "kinematics", "collision")
"""What a candidate that the costs allow can fail on."""


def explain(
    scene: Scene, fields: Sequence[CostField], options: Options, refused: Mapping[str, int]
) -> tuple[Diagnostic, ...]:
    """One diagnostic per constraint that leaves nothing by itself; else of the constraint that ruled out most."""
    if not fields:
        return (_no_grasp(scene),)
    found = [d for d in (_unsafe(fields, options), _far(fields, options), _out_of_arm(scene, fields)) if d]
    if found:
        return tuple(found)
    if not any(field.allowed.any() for field in fields):
        return (_no_overlap(fields),)
    return (_unsolved(scene, refused, options),)


def _no_grasp(scene: Scene) -> Diagnostic:
    width = scene.robot.gripper.width
    region = scene.thing.regions[scene.region]
    return Diagnostic(
        "E810", f"{scene.robot.name} has no grasp of {scene.thing.name} outside the region {region!r} of the receiver: "
        f"nothing there fits between jaws of {width:.3f} m",
        hint="use a gripper with a wider opening, or give the task another region in the object's file",
    )  # fmt: skip


def _least(field: CostField) -> float:
    parts = field.parts
    return float(np.minimum(np.minimum(parts.to_hand, parts.to_face), parts.gripper_to_hand).max())


def _unsafe(fields: Sequence[CostField], options: Options) -> Diagnostic | None:
    best = max(_least(field) for field in fields)
    if best >= options.limits.safety:
        return None
    return Diagnostic(
        "E811", f"safety: no voxel keeps {options.limits.safety:.3f} m from hand and face; the best keeps {best:.3f} m",
        hint=f"use a safety distance of at most {best:.3f} m, or a larger voxel map",
    )  # fmt: skip


def _far(fields: Sequence[CostField], options: Options) -> Diagnostic | None:
    best = min(float(field.parts.to_grasp.min()) for field in fields)
    if best <= options.limits.reach:
        return None
    return Diagnostic(
        "E812", f"reach: every voxel is more than {options.limits.reach:.3f} m from the hand; the nearest {best:.3f} m",
        hint=f"allow a reach of {best:.3f} m, or move the voxel map to the receiver's hand",
    )  # fmt: skip


def _out_of_arm(scene: Scene, fields: Sequence[CostField]) -> Diagnostic | None:
    excess = min(float(field.excess.min()) for field in fields)
    if excess <= 1e-3:
        return None
    return Diagnostic(
        "E813", f"robot: every voxel is out of the reach of {scene.robot.name}; the nearest by {excess:.3f} m",
        hint=f"move the base of the robot {excess:.3f} m nearer to the receiver",
    )  # fmt: skip


def _no_overlap(fields: Sequence[CostField]) -> Diagnostic:
    safe = sum(int((field.safety > 0).sum()) for field in fields)
    near = sum(int(np.isfinite(field.reach).sum()) for field in fields)
    arm = sum(int((field.excess <= 1e-3).sum()) for field in fields)
    needed = min(float(np.where(field.safety > 0, field.parts.to_grasp, np.inf).min()) for field in fields)
    return Diagnostic(
        "E814", f"no candidate satisfies all constraints at once: {safe} are safe, {near} near enough to the receiver, "
        f"{arm} within the robot's reach bound",
        hint=f"the nearest safe candidate asks for a reach of {needed:.3f} m; or move the robot nearer",
    )  # fmt: skip


def _unsolved(scene: Scene, refused: Mapping[str, int], options: Options) -> Diagnostic:
    worst = max(BLAMES, key=lambda name: refused.get(name, 0))
    level, robot = scene.receiver.level.name, scene.robot.name
    n = sum(refused.get(name, 0) for name in BLAMES)
    message, hint = {
        "receiver": (f"receiver: at mobility {level} the arm does not reach {{}} of {n} candidates",
                     "centre the voxel map on the receiver's hand, or plan with `receiver=False`"),
        "kinematics": (f"robot: {robot} has no inverse kinematics for {{}} of {n} candidates",
                       "move the robot's base, use more orientations, grasps or approaches"),
        "collision": (f"collision: {robot}, object and receiver cannot stay apart in {{}} of {n} candidates",
                      "move the robot's base, enlarge the voxel map, or use more orientations"),
    }[worst]  # fmt: skip
    stopped = f" within {options.ik_calls} calls" if refused.get("calls", 0) >= options.ik_calls else ""
    return Diagnostic(UNSOLVED, message.format(refused.get(worst, 0)) + stopped, hint=hint)


def with_hints(diagnostic: Diagnostic, hints: Sequence[str]) -> Diagnostic:
    """The diagnostic with what was found out in addition."""
    return replace(diagnostic, hint="; ".join([*hints, diagnostic.hint]))
