"""Static pictures: cost fields, configurations and tables in, image files out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mlnlite.domains.handover.kinematics.chain import Chain, tool_poses
from mlnlite.domains.handover.kinematics.pose import FloatArray, transform_points
from mlnlite.domains.handover.scene.bodies import body_capsules
from mlnlite.domains.handover.scene.grasps import sample_grasps
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.search.fields import CostField, Options, cost_field
from mlnlite.domains.handover.search.hierarchical import Configuration
from mlnlite.domains.handover.search.methods import METHODS
from mlnlite.domains.handover.show.report import PAPER, Row, common, pick

COLOURS = {"A": "#b5483a", "B": "#d9a441", "ours": "#2f7f6f"}


def save(figure: Figure, path: str | Path) -> None:
    """Writes a figure; the same figure gives the same bytes."""
    with mpl.rc_context({"svg.hashsalt": "mlnlite"}):
        figure.savefig(
            path, dpi=120, bbox_inches="tight", metadata={"Date": None} if str(path).endswith(".svg") else None
        )


def draw_configuration(scene: Scene, found: Configuration, options: Options | None = None) -> Figure:
    """A horizontal slice of C_S and of C_R at the height of the object, and the scene from the side."""
    costs = cost_field(scene, sample_grasps(scene.thing, scene.robot.gripper), found.grasp, options or Options())
    figure = Figure(figsize=(15, 4.6))
    axes = figure.subplots(1, 3)
    level = _nearest_level(scene, found)
    _slice(axes[0], scene, np.where(costs.safety > 0, costs.safety, np.nan).max(axis=1), level, "safety C_S [m]")
    _slice(axes[1], scene, np.where(np.isfinite(costs.reach), costs.reach, np.nan).min(axis=1), level, "reach C_R [m]")
    for axis in axes[:2]:
        axis.plot(*scene.hand.position[:2], "wo", markeredgecolor="k", label="palm")
        axis.plot(*found.thing.position[:2], "k*", markersize=13, label="object")
        axis.legend(loc="upper right", fontsize=8)
    _side(axes[2], scene, found)
    return figure


def _nearest_level(scene: Scene, found: Configuration) -> int:
    low = scene.voxels.pose.position[2] - 0.5 * scene.voxels.step * (scene.voxels.counts[2] - 1)
    return int(np.clip(round((found.thing.position[2] - low) / scene.voxels.step), 0, scene.voxels.counts[2] - 1))


def _slice(axis: Axes, scene: Scene, values: FloatArray, level: int, title: str) -> None:
    nx, ny, nz = scene.voxels.counts
    grid = values.reshape(nx, ny, nz)[:, :, level]
    half = 0.5 * scene.voxels.step * np.array([nx, ny])
    x, y = scene.voxels.pose.position[:2]
    image = axis.imshow(
        grid.T, origin="lower", extent=(x - half[0], x + half[0], y - half[1], y + half[1]), cmap="viridis"
    )
    axis.set(title=title, xlabel="x [m], to the robot", ylabel="y [m]")
    axis.figure.colorbar(image, ax=axis, shrink=0.85)


def _side(axis: Axes, scene: Scene, found: Configuration) -> None:
    for capsule in body_capsules(scene.receiver, scene.posture):
        ends = np.stack([capsule.start, capsule.end])
        axis.plot(ends[:, 0], ends[:, 2], "-", color="#c9b6a3", linewidth=160 * capsule.radius, solid_capstyle="round")
    arm = joint_origins(scene.robot.chain, found.hold.q)
    arm = transform_points(scene.base, arm)
    axis.plot(arm[:, 0], arm[:, 2], "-o", color="#44546a", linewidth=5, label=scene.robot.name)
    surface = transform_points(found.thing, scene.thing.surface.points)
    human = scene.thing.surface.labels == scene.region
    axis.plot(surface[~human, 0], surface[~human, 2], ".", color="#5b8fd9", markersize=2, label=scene.thing.name)
    axis.plot(surface[human, 0], surface[human, 2], ".", color="#2f7f6f", markersize=2, label="receiver's region")
    axis.set(title=f"{scene.thing.name}, {scene.task}, {scene.receiver.level.name}, method {found.method}",
             xlabel="x [m]", ylabel="z [m]", aspect="equal")  # fmt: skip
    axis.legend(fontsize=7, loc="lower right")


def joint_origins(chain: Chain, q: FloatArray) -> FloatArray:
    """Origins of the joints and the tool in the base at q, shape (n + 2, 3) [m], the base first."""
    points = [np.zeros(3)]
    for i in range(1, len(chain.names) + 1):
        rows = np.vstack([chain.table[:i], np.hstack([np.eye(4).ravel(), np.zeros(6)])])
        points.append(tool_poses(Chain(rows, chain.names[:i]), q[None, :i])[0, :3, 3])
    points.append(tool_poses(chain, q[None])[0, :3, 3])
    return np.array(points)


def draw_field(costs: CostField) -> Figure:
    """C_R over the allowed voxels in 3-D."""
    figure = Figure(figsize=(6, 5))
    axis: Any = figure.add_subplot(projection="3d")
    best = np.where(costs.allowed, costs.reach, np.inf).min(axis=1)
    shown = np.isfinite(best)
    x, y, z = costs.centres[shown].T
    image = axis.scatter(x, y, z, c=best[shown], cmap="viridis")
    axis.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", title="C_R over allowed voxels [m]")
    figure.colorbar(image, shrink=0.7)
    return figure


def draw_effort(rows: Sequence[Row]) -> Figure:
    """Mean arm effort by level and method over the scenes that all methods reach, beside the paper's figures."""
    levels = list(dict.fromkeys(row.level for row in rows))
    figure = Figure(figsize=(8, 4))
    axis = figure.subplots()
    for i, method in enumerate(METHODS):
        heights = [_mean_arm(rows, method, level) for level in levels]
        axis.bar(np.arange(len(levels)) + 0.27 * (i - 1), heights, 0.25, color=COLOURS[method], label=method)
        axis.axhline(PAPER[method], color=COLOURS[method], linestyle=":", linewidth=1)
    axis.set(xticks=np.arange(len(levels)), xticklabels=levels, ylabel="arm effort, sum of |torque| [N m]",
             xlabel="mobility level (dotted: the paper's figures)")  # fmt: skip
    axis.legend()
    return figure


def _mean_arm(rows: Sequence[Row], method: str, level: str) -> float:
    both = common(rows, level)
    efforts = [r.effort.arm for r in pick(rows, method, level) if r.effort is not None and (r.thing, r.robot) in both]
    return float(np.mean(efforts)) if efforts else 0.0
