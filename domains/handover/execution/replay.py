"""Replay in the browser: a run and its scene in, a page or recording that a browser plays out."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pinocchio as pin
import viser

import mlnlite as ml
from mlnlite.domains.handover.execution.machine import Moment, Run, Timing
from mlnlite.domains.handover.kinematics.pose import (
    FloatArray,
    Pose,
    compose,
    inverse,
    pose_from_matrix,
    transform_points,
)
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.show.viewer import CAMERA, STEEL, THING, draw_receiver
from mlnlite.domains.handover.tables import choose

_EVERY = 4
"""Steps per frame."""


def record(scene: Scene, run: Run, path: str | Path, *, port: int = 8191) -> None:
    """Writes a run as a page that plays in any browser (`.html`), or as a recording for the viewer (`.viser`).

    Args:
        scene: who and where.
        run: what happened.
        path: of the page or recording.
        port: on which the viewer's server runs meanwhile, or the next that is free.

    Raises:
        MlnError: another kind of file, or it cannot be written.
    """
    place = Path(path)
    choose(place.suffix, (".html", ".viser"), "kind of recording")
    with redirect_stdout(StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=port, verbose=False)
    try:
        server.scene.set_up_direction("+z")
        server.initial_camera.position, server.initial_camera.look_at = CAMERA
        draw_receiver(server, scene)
        recording = server.get_scene_serializer()
        for moment in run.moments[::_EVERY]:
            _draw_moment(server, scene, run, moment)
            recording.insert_sleep(_EVERY * Timing().step)
        place.write_bytes(recording.as_html().encode() if place.suffix == ".html" else recording.serialize())
    except OSError as reason:
        raise ml.MlnError(f"cannot write {path}: {reason}", hint="give the path of a file in a folder") from None
    finally:
        with redirect_stdout(StringIO()):
            server.stop()


def _draw_moment(server: viser.ViserServer, scene: Scene, run: Run, moment: Moment) -> None:
    points, tool = arm_points(scene, moment.q)
    server.scene.add_line_segments(
        "/robot", np.stack([points[:-1], points[1:]], axis=1), STEEL, thickness=9.0, thickness_units="screen"
    )
    if run.plan is not None:
        thing = compose(tool, inverse(run.plan.grasp, "tool"))
        server.scene.add_point_cloud("/object", transform_points(thing, scene.thing.surface.points), THING,
                                     point_size=0.006)  # fmt: skip
    if moment.sight is not None:
        server.scene.add_icosphere("/hand", radius=0.04, color=(230, 120, 40), position=tuple(moment.sight.hand))


def arm_points(scene: Scene, q: FloatArray) -> tuple[FloatArray, Pose]:
    """Places of the robot's joints and tool in the world, shape (m, 3) [m], and the pose of the tool."""
    model = scene.robot.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.asarray(q, dtype=np.float64))
    tool = compose(scene.base, pose_from_matrix(data.oMf[model.getFrameId(scene.robot.tool)].homogeneous, "base"))
    origins: Sequence[FloatArray] = [np.array(data.oMi[i].translation) for i in range(model.njoints)]
    return np.vstack([transform_points(scene.base, np.array(origins)), tool.position]), tool
