"""Replay in the browser: a run and its scene in, a recording that a browser plays out."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pinocchio as pin
import trimesh
import viser

from mlnlite.domains.handover.bodies import body_capsules
from mlnlite.domains.handover.execution.machine import Moment, Run
from mlnlite.domains.handover.pose import FloatArray, Pose, compose, inverse, pose_from_matrix, transform_points
from mlnlite.domains.handover.scene import Scene

_EVERY = 4
"""Steps per frame."""


def record(scene: Scene, run: Run, path: str | Path, *, port: int = 0) -> None:
    """Writes a run as a `.viser` recording.

    Args:
        scene: who and where.
        run: what happened.
        path: of the recording.
        port: on which the server runs meanwhile; 0 for any.
    """
    with redirect_stdout(StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=port or 8191, verbose=False)
    try:
        server.scene.set_up_direction("+z")
        _draw_body(server, scene)
        recording = server.get_scene_serializer()
        for moment in run.moments[::_EVERY]:
            _draw_moment(server, scene, run, moment)
            recording.insert_sleep(_EVERY * 0.02)
        Path(path).write_bytes(recording.serialize())
    finally:
        server.stop()


def _draw_body(server: viser.ViserServer, scene: Scene) -> None:
    for i, capsule in enumerate(body_capsules(scene.receiver, scene.posture)):
        middle, length = 0.5 * (capsule.start + capsule.end), float(np.linalg.norm(capsule.end - capsule.start))
        mesh = trimesh.creation.capsule(height=length, radius=capsule.radius, count=[10, 10])
        mesh.apply_translation([0, 0, -mesh.bounds.mean(axis=0)[2]])
        turn = np.eye(4)
        along = capsule.end - capsule.start if length > 1e-6 else np.array([0.0, 0.0, 1.0])
        turn[:3, :3] = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along).matrix()
        mesh.apply_transform(turn)
        server.scene.add_mesh_simple(
            f"/person/{i}", mesh.vertices, mesh.faces, color=(214, 190, 168), position=tuple(middle)
        )


def _draw_moment(server: viser.ViserServer, scene: Scene, run: Run, moment: Moment) -> None:
    points, tool = arm_points(scene, moment.q)
    server.scene.add_line_segments(
        "/robot", np.stack([points[:-1], points[1:]], axis=1), (68, 84, 106), thickness=9.0, thickness_units="screen"
    )
    if run.plan is not None:
        thing = compose(tool, inverse(run.plan.grasp, "tool"))
        server.scene.add_point_cloud("/object", transform_points(thing, scene.thing.surface.points), (91, 143, 217),
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
