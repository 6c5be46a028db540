"""Robots: a name or the path of a URDF in, a `Robot` on Pinocchio out. Kinematics and primitive collision bodies."""

from __future__ import annotations

import tomllib
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from mlnlite import MlnError, did_you_mean
from mlnlite.domains.handover.kinematics.chain import Chain, chain_of
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, locked, pose_at
from mlnlite.domains.handover.tables import DATA


@dataclass(frozen=True, slots=True)
class Gripper:
    """A parallel-jaw gripper, all lengths in [m].

    Attributes:
        width: largest opening.
        depth: how far the fingers reach beyond the grasp centre.
        palm: from the grasp centre back to the palm.
        thickness: of a finger, along the closing direction.
    """

    width: float = 0.08
    depth: float = 0.02
    palm: float = 0.05
    thickness: float = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Robot:
    """A serial arm with a parallel-jaw gripper.

    Attributes:
        name: as the user knows it.
        model: Pinocchio model of the chain from its base to the tool.
        geometry: collision bodies.
        chain: the same kinematics as numbers.
        tool: frame of the grasp centre: x along the approach, y along the closing direction.
        gripper: its sizes.
        bases: for `standing` and `seated`, pose of the base in the world [m].
        home: configuration in which the arm waits, shape (n,) [rad].
    """

    name: str
    model: pin.Model
    geometry: pin.GeometryModel
    chain: Chain
    tool: str
    gripper: Gripper
    bases: tuple[tuple[str, Pose], ...]
    home: FloatArray

    def base(self, posture: str) -> Pose:
        """Pose of the base in the world for a receiver who is `standing` or `seated`."""
        return dict(self.bases).get(posture, self.bases[0][1])


def robot_names() -> tuple[str, ...]:
    """Robots that come with the domain."""
    return tuple(_known())


@lru_cache(maxsize=1)
def _known() -> dict[str, Any]:
    return tomllib.loads((DATA / "robots.toml").read_text())


def read_robot(
    name: str, *, tool: str = "", base: Pose | None = None, gripper: Gripper | None = None, meshes: str = ""
) -> Robot:
    """A robot by name (`pr2`, `panda`) or by the path of a URDF.

    Args:
        name: known name, or path ending in `.urdf`.
        tool: frame of the grasp centre; by default the last frame of the file.
        base: pose of its base in the world [m]; by default 1.1 m in front of the receiver, looking at them.
        gripper: sizes of the jaws [m].
        meshes: folder in which `package://` meshes are found.

    Raises:
        MlnError: unknown name, missing or broken file, unknown frame.
    """
    known = _known()
    if name in known:
        return _known_robot(name, gripper)
    path = Path(name)
    if path.suffix.lower() != ".urdf":
        hint = did_you_mean(name, list(known)) or "give a known name or the path of a URDF"
        raise MlnError(f"unknown robot {name!r}; known: {', '.join(known)}, or the path of a .urdf file", hint=hint)
    try:
        text = path.read_text()
    except (OSError, UnicodeDecodeError) as reason:
        raise MlnError(f"cannot read the robot file {name}: {reason}", hint="give the path of a URDF file") from None
    return _own_robot((path.name, text, meshes), tool, gripper or Gripper(), base)


@lru_cache(maxsize=8)
def _own_robot(source: tuple[str, str, str], tool: str, gripper: Gripper, base: Pose | None) -> Robot:
    """Remembered by the text of the file, so that solvers are built once."""
    built, base = _build(*source), base or pose_at(1.1, -0.15, 0.0, np.pi)
    tool = tool or built[0].frames[built[0].nframes - 1].name
    return _robot(Path(source[0]).stem, built, tool, gripper, (("standing", base), ("seated", base)))


@lru_cache(maxsize=8)
def _known_robot(name: str, gripper: Gripper | None) -> Robot:
    entry = _known()[name]
    bases = tuple((posture, pose_at(*numbers)) for posture, numbers in entry["base"].items())
    built = _build(entry["urdf"], (DATA / entry["urdf"]).read_text(), "")
    robot = _robot(name, built, entry["tool"], gripper or Gripper(**entry["gripper"]), bases)
    return replace(robot, home=locked(entry["home"]))


def _robot(
    name: str,
    built: tuple[pin.Model, pin.GeometryModel],
    tool: str,
    gripper: Gripper,
    bases: tuple[tuple[str, Pose], ...],
) -> Robot:
    model, geometry = built
    if not model.existFrame(tool):
        frames = [frame.name for frame in model.frames]
        raise MlnError(f"robot {name!r} has no frame {tool!r}", hint=did_you_mean(tool, frames) or f"frames: {frames}")
    model, geometry = _only_chain(model, geometry, tool)
    chain = chain_of(model, tool)
    home = np.clip(np.zeros(model.nq), chain.lower, chain.upper)
    return Robot(name, model, geometry, chain, tool, gripper, bases, locked(home))


def _build(name: str, text: str, meshes: str) -> tuple[pin.Model, pin.GeometryModel]:
    """Model and collision bodies; a continuous joint becomes one turn, which reaches the same poses."""
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as reason:
        line, column = reason.position
        raise MlnError(f"{name}:{line}:{column + 1}: not well-formed XML: {reason}", hint="repair the URDF") from None
    for joint in root.iter("joint"):
        if joint.get("type") == "continuous":
            _one_turn(joint)
    plain = ElementTree.tostring(root, encoding="unicode")
    try:
        model = pin.buildModelFromXML(plain)
        geometry = pin.buildGeomFromUrdfString(model, plain, pin.GeometryType.COLLISION, None, meshes or None)
    except (ValueError, RuntimeError) as reason:
        hint = "check joints, limits and parents; for meshes give their folder, or use primitive collision bodies"
        raise MlnError(f"{name}: not a usable URDF: {str(reason).splitlines()[0]}", hint=hint) from None
    if model.nq == 0:
        raise MlnError(f"{name}: the robot has no moving joint", hint="an arm needs revolute or prismatic joints")
    return model, geometry


def _one_turn(joint: ElementTree.Element) -> None:
    joint.set("type", "revolute")
    limit = joint.find("limit")
    limit = ElementTree.SubElement(joint, "limit", effort="100", velocity="3") if limit is None else limit
    limit.set("lower", repr(-float(np.pi)))
    limit.set("upper", repr(float(np.pi)))


def _only_chain(model: pin.Model, geometry: pin.GeometryModel, tool: str) -> tuple[pin.Model, pin.GeometryModel]:
    """Locks every joint that does not move the tool."""
    wanted = set(model.supports[model.frames[model.getFrameId(tool)].parentJoint])
    others = [i for i in range(1, model.njoints) if i not in wanted]
    if not others:
        return model, geometry
    locked_model, (locked_geometry,) = pin.buildReducedModel(model, [geometry], others, pin.neutral(model))
    return locked_model, locked_geometry
