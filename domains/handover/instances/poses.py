"""Poses of instances: cells of object, region, level and method in, configurations and their means per shape out.

The mean rotation is that of Markley et al. (2007): the eigenvector of the largest eigenvalue of `sum_i q_i q_i^T`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import groupby

import numpy as np

from mlnlite.domains.handover.instances.generate import Instance
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, compose, inverse, locked
from mlnlite.domains.handover.scene.objects import HandoverObject, read_object
from mlnlite.domains.handover.scene.scene import make_scene
from mlnlite.domains.handover.search.hierarchical import Configuration
from mlnlite.domains.handover.search.methods import hand_over


@dataclass(frozen=True, slots=True)
class Cell:
    """What decides a configuration; `level` is empty for the methods that do not look at it.

    Attributes:
        thing: name of the object.
        region: number of the receiver's region, from 1.
        level: of mobility, or empty.
        method: `A`, `B` or `ours`.
    """

    thing: str
    region: int
    level: str
    method: str


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Where a cell puts things; positions [m], quaternions (w, x, y, z).

    Attributes:
        cell: what was asked.
        status: of the search: `optimal`, `infeasible` or `limit`.
        position: of the object in the world, shape (3,); nan if there is none.
        quaternion: of the object in the world, shape (4,).
        grasp_position: of the tool in the object, shape (3,).
        grasp_quaternion: of the tool in the object, shape (4,).
        reach: C_R, how far the receiver's hand has to move [m].
    """

    cell: Cell
    status: str
    position: FloatArray
    quaternion: FloatArray
    grasp_position: FloatArray
    grasp_quaternion: FloatArray
    reach: float


@dataclass(frozen=True, slots=True, eq=False)
class MeanPose:
    """A pose averaged over objects.

    Attributes:
        position: mean, shape (3,) [m].
        quaternion: mean (w, x, y, z).
        spread: root mean square distance from the mean [m].
        angle: root mean square angle from the mean [rad].
        n: how many poses.
    """

    position: FloatArray
    quaternion: FloatArray
    spread: float
    angle: float
    n: int


def cell_of(instance: Instance) -> Cell:
    """The cell of an instance."""
    level = instance.level if instance.method == "ours" else ""
    return Cell(instance.thing, instance.region, level, instance.method)


def all_cells(things: Iterable[HandoverObject], levels: Sequence[str]) -> tuple[Cell, ...]:
    """Every region that some task needs, every level and method."""
    cells: list[Cell] = []
    for thing in things:
        for region in dict.fromkeys(thing.regions.index(name) + 1 for _, name in thing.affordances):
            cells += [Cell(thing.name, region, "", method) for method in ("A", "B")]
            cells += [Cell(thing.name, region, level, "ours") for level in levels]
    return tuple(cells)


def place_all(cells: Sequence[Cell], *, robot: str = "pr2", workers: int = 1) -> dict[Cell, Placed]:
    """The configuration of each cell, by the cost model; with several workers in as many processes."""
    groups = [tuple(group) for _, group in groupby(cells, key=lambda cell: (cell.thing, cell.region))]
    work = partial(_place_group, robot=robot)
    if workers == 1:
        found = list(map(work, groups))
    else:
        with ProcessPoolExecutor(workers) as pool:
            found = list(pool.map(work, groups))
    return {placed.cell: placed for group in found for placed in group}


def _place_group(cells: Sequence[Cell], robot: str) -> list[Placed]:
    return [place(cell, robot=robot) for cell in cells]


def place(cell: Cell, *, robot: str = "pr2") -> Placed:
    """The configuration of one cell, the receiver standing with the hand at rest."""
    thing = read_object(cell.thing)
    task = next(task for task, region in thing.affordances if region == thing.regions[cell.region - 1])
    scene = make_scene(thing, task, cell.level or "H", robot)
    result = hand_over(scene, cell.method)
    if result.configuration is None:
        nowhere = np.full(4, np.nan)
        return Placed(cell, result.status, nowhere[:3], nowhere, nowhere[:3], nowhere, float("nan"))
    found = result.configuration
    grasp = tool_in_object(found)
    return Placed(cell, result.status, found.thing.position, found.thing.quaternion, grasp.position,
                  grasp.quaternion, found.reach)  # fmt: skip


def tool_in_object(found: Configuration) -> Pose:
    """The robot's grasp: pose of the tool in the object [m]."""
    return compose(inverse(found.thing, "object"), found.hold.tool)


def mean_pose(positions: FloatArray, quaternions: FloatArray) -> MeanPose:
    """The mean of poses, shapes (n, 3) [m] and (n, 4), with its spread."""
    centre = positions.mean(axis=0)
    q = mean_quaternion(quaternions)
    away = np.linalg.norm(positions - centre, axis=1)
    angles = quaternion_angles(quaternions, q)
    return MeanPose(locked(centre), locked(q), float(np.sqrt((away**2).mean())),
                    float(np.sqrt((angles**2).mean())), len(positions))  # fmt: skip


def mean_quaternion(quaternions: FloatArray) -> FloatArray:
    """Markley's mean of unit quaternions, shape (n, 4), with w >= 0; q and -q are the same rotation."""
    _, vectors = np.linalg.eigh(quaternions.T @ quaternions)
    q = vectors[:, -1]
    out: FloatArray = q if q[0] >= 0 else -q
    return out


def quaternion_angles(first: FloatArray, second: FloatArray) -> FloatArray:
    """Angles [rad] between rotations, shapes (..., 4)."""
    dots = np.abs((first * second).sum(axis=-1))
    out: FloatArray = 2 * np.arccos(np.clip(dots, 0.0, 1.0))
    return out


def templates(placed: Mapping[Cell, Placed], shapes: Mapping[str, str]) -> dict[tuple[str, str], MeanPose]:
    """The mean pose of each shape context and method, as the paper averages them.

    Args:
        placed: configurations.
        shapes: shape of each object by name; objects that are not in it are left out.
    """
    groups: dict[tuple[str, str], list[Placed]] = {}
    for cell, one in placed.items():
        if cell.thing in shapes and one.status == "optimal":
            groups.setdefault((shapes[cell.thing], cell.method), []).append(one)
    return {
        key: mean_pose(np.array([p.position for p in group]), np.array([p.quaternion for p in group]))
        for key, group in sorted(groups.items())
    }
