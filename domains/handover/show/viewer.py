"""A scene in the browser: `Scene` in, a viser server out, with sliders for mobility and method that answer anew."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypedDict

import matplotlib as mpl
import numpy as np
import pinocchio as pin
import trimesh
import viser

from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, transform_points
from mlnlite.domains.handover.scene.bodies import body_capsules
from mlnlite.domains.handover.scene.grasps import sample_grasps
from mlnlite.domains.handover.scene.mobility import read_levels
from mlnlite.domains.handover.scene.receiver import at_level
from mlnlite.domains.handover.scene.scene import Layout, Scene, make_scene
from mlnlite.domains.handover.search.checks import five_checks
from mlnlite.domains.handover.search.feasibility import human_grasp
from mlnlite.domains.handover.search.fields import Options, cost_field
from mlnlite.domains.handover.search.hierarchical import Configuration, Handover
from mlnlite.domains.handover.search.methods import METHODS, hand_over
from mlnlite.domains.handover.show.figures import joint_origins

SKIN, STEEL, THING, REGION = (214, 190, 168), (68, 84, 106), (91, 143, 217), (47, 127, 111)
"""Colours of receiver, robot, object and the receiver's region."""
CAMERA = (0.9, -1.35, 1.55), (0.50, 0.0, 1.05)
"""Where the camera is and where it looks [m]."""


def open_view(scene: Scene, *, port: int = 8080, host: str = "127.0.0.1") -> viser.ViserServer:
    """Starts a server that shows the scene; a change of the sliders draws it anew.

    Args:
        scene: who, what and where.
        port: of the web page.
        host: address to listen on.
    """
    server = viser.ViserServer(host=host, port=port, verbose=False)
    server.scene.set_up_direction("+z")
    server.initial_camera.position, server.initial_camera.look_at = CAMERA
    levels = [level.name for level in read_levels()]
    start = levels.index(scene.receiver.level.name) if scene.receiver.level.name in levels else 0
    marks = tuple((i, name) for i, name in enumerate(levels))
    level = server.gui.add_slider("mobility", 0, len(levels) - 1, 1, start, marks=marks)
    method = server.gui.add_dropdown("method", METHODS, initial_value="ours")
    field = server.gui.add_checkbox("reach cost over the map", initial_value=True)
    report = server.gui.add_markdown("")

    def redraw(_: object = None) -> None:
        current = rescaled(scene, levels[level.value])
        result = hand_over(current, method.value)
        report.content = summary(current, result)
        draw(server, current, result, show_field=field.value)

    for control in (level, method, field):
        control.on_update(redraw)
    redraw()
    return server


def serve(scene: Scene, *, port: int = 8080, stop: Callable[[], bool] = lambda: False) -> None:
    """Shows the scene until interrupted, or until `stop` says so (asked every half second)."""
    server = open_view(scene, port=port)
    try:
        while not stop():
            time.sleep(0.5)
    except KeyboardInterrupt:
        return
    finally:
        server.stop()


def rescaled(scene: Scene, level: str) -> Scene:
    """The same scene with another mobility of the receiver."""
    receiver = at_level(scene.receiver, level)
    inside = (receiver.chain.lower <= scene.posture).all() and (scene.posture <= receiver.chain.upper).all()
    hand = scene.hand.position if inside and not np.array_equal(scene.posture, receiver.comfort) else None
    layout = Layout(hand, scene.base, scene.voxels.counts, scene.voxels.step)
    return make_scene(scene.thing, scene.task, receiver, scene.robot, layout=layout)


def summary(scene: Scene, result: Handover) -> str:
    """The answer as Markdown."""
    found = result.configuration
    head = f"**{scene.thing.name}**, {scene.task}, {scene.robot.name}, mobility {scene.receiver.level.title}"
    if found is None:
        return "\n\n".join([head, *map(str, result.advice)])
    costs = f"C_A {found.appropriateness:.3f} m, C_S {found.safety:.3f} m, C_R {found.reach:.3f} m ({result.status})"
    checks = [f"- {'pass' if c.passed else '**fail**'} {c.name}: {c.finding}" for c in five_checks(scene, found)]
    return "\n\n".join([head, costs, "\n".join(checks)])


def draw(server: viser.ViserServer, scene: Scene, result: Handover, *, show_field: bool = True) -> None:
    """Puts receiver, robot, object, voxels and hand into the view, in place of what was there."""
    server.scene.reset()
    server.scene.add_grid("/floor", width=4.0, height=4.0, position=(0.5, 0.0, 0.0))
    draw_receiver(server, scene)
    server.scene.add_icosphere("/palm", radius=0.012, color=(180, 60, 50), position=tuple(scene.hand.position))
    found = result.configuration
    if found is not None:
        _draw_found(server, scene, found)
        if show_field:
            _draw_field(server, scene, found)


def draw_receiver(server: viser.ViserServer, scene: Scene) -> None:
    """The body of the receiver as capsules."""
    for i, capsule in enumerate(body_capsules(scene.receiver, scene.posture)):
        _add_segment(server, f"/receiver/{capsule.name}_{i}", (capsule.start, capsule.end), capsule.radius, SKIN)


def _draw_found(server: viser.ViserServer, scene: Scene, found: Configuration) -> None:
    joints = transform_points(scene.base, joint_origins(scene.robot.chain, found.hold.q))
    for i in range(1, len(joints) - 1):
        _add_segment(server, f"/robot/link_{i}", (joints[i], joints[i + 1]), 0.045 if i < 5 else 0.03, STEEL)
    _add_segment(server, "/robot/column", (joints[0], joints[1]), 0.09, STEEL)
    server.scene.add_frame("/tool", axes_length=0.08, axes_radius=0.004, **_at(found.hold.tool))
    mesh = scene.thing.mesh
    server.scene.add_mesh_simple(
        "/object", mesh.vertices, mesh.faces, color=THING, flat_shading=True, **_at(found.thing)
    )
    region = scene.thing.surface.points[scene.thing.surface.labels == scene.region]
    server.scene.add_point_cloud("/region", region, REGION, point_size=0.006, **_at(found.thing))
    place = human_grasp(scene, found.thing)
    server.scene.add_line_segments(
        "/reach", np.stack([scene.hand.position, place])[None], (230, 120, 40), thickness=3.0, thickness_units="screen"
    )


def _draw_field(server: viser.ViserServer, scene: Scene, found: Configuration) -> None:
    costs = cost_field(scene, sample_grasps(scene.thing, scene.robot.gripper), found.grasp, Options())
    best = np.where(costs.allowed, costs.reach, np.inf).min(axis=1)
    shown = np.isfinite(best)
    if shown.any():
        low, high = best[shown].min(), best[shown].max()
        colours = mpl.colormaps["viridis"]((best[shown] - low) / max(high - low, 1e-9))[:, :3]
        server.scene.add_point_cloud("/voxels", costs.centres[shown], colours, point_size=0.004)


def _add_segment(
    server: viser.ViserServer,
    name: str,
    ends: tuple[FloatArray, FloatArray],
    radius: float,
    colour: tuple[int, int, int],
) -> None:
    length = float(np.linalg.norm(ends[1] - ends[0]))
    if length < 1e-6:
        server.scene.add_icosphere(name, radius=radius, color=colour, position=tuple(ends[0]))
        return
    mesh = trimesh.creation.capsule(height=length, radius=radius, count=[12, 12])
    mesh.apply_translation([0, 0, -mesh.bounds.mean(axis=0)[2]])
    turn = np.eye(4)
    turn[:3, :3] = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), ends[1] - ends[0]).matrix()
    mesh.apply_transform(turn)
    middle = tuple(0.5 * (ends[0] + ends[1]))
    server.scene.add_mesh_simple(name, mesh.vertices, mesh.faces, color=colour, position=middle)


class _Place(TypedDict):
    wxyz: FloatArray
    position: FloatArray


def _at(pose: Pose) -> _Place:
    return _Place(wxyz=pose.quaternion, position=pose.position)
