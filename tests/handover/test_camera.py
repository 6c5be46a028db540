"""Eyes of a depth camera: places are found again, what is not seen is not invented, MediaPipe is optional."""

import sys
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest

import mlnlite as ml
from mlnlite.domains.handover.execution.camera import PALM, Camera, CameraEyes, Frame, first_of, mediapipe_landmarks
from mlnlite.domains.handover.execution.machine import Job, execute
from mlnlite.domains.handover.execution.simulate import Case, SimulatedArm, scene_at
from mlnlite.domains.handover.kinematics.pose import Pose, inverse, transform_points

SHAPE = (480, 640)
# 2 m ahead of the person, looking back at them: right is +y, down is -z, ahead is -x
CAMERA = Camera((500.0, 500.0), (320.0, 240.0), Pose([2.0, 0, 1.3], np.array([[0, 0, -1.0], [1, 0, 0], [0, -1, 0]])))


def project(place):
    """Where a place in the world is in the image, from 0 to 1, and its depth [m]."""
    x, y, z = transform_points(inverse(CAMERA.pose), np.asarray(place, dtype=float))
    pixel = np.array([x, y]) / z * CAMERA.focal + CAMERA.centre
    return pixel / SHAPE[::-1], z


def frame_of(places, time=0.0):
    depth = np.full(SHAPE, np.nan)
    for place in places:
        (u, v), z = project(place)
        depth[int(v * SHAPE[0]), int(u * SHAPE[1])] = z
    return Frame(time, np.zeros((*SHAPE, 3), np.uint8), depth)


def eyes_for(hand, face, frame):
    return CameraEyes(CAMERA, lambda time: frame, lambda image: project(hand)[0][None],
                      lambda image: project(face)[0][None])  # fmt: skip


def test_a_place_is_found_again():
    hand, face = np.array([0.41, -0.2, 1.05]), np.array([0.1, 0.02, 1.6])
    sight = eyes_for(hand, face, frame_of([hand, face], 0.7)).look(0.75)
    assert sight.time == 0.7
    assert sight.hand == pytest.approx(hand, abs=1e-9)
    assert sight.face == pytest.approx(face, abs=1e-9)


def test_what_is_not_seen_is_not_invented():
    hand, face = np.array([0.4, -0.2, 1.0]), np.array([0.1, 0.0, 1.6])
    assert eyes_for(hand, face, None).look(0.0) is None
    assert eyes_for(hand, face, frame_of([hand])).look(0.0) is None, "the face has no depth"
    assert eyes_for(hand, [0.4, 9.0, 1.0], frame_of([hand])).look(0.0) is None, "outside the image"
    blind = CameraEyes(CAMERA, lambda time: frame_of([hand, face]), lambda image: None, lambda image: None)
    assert blind.look(0.0) is None


def test_results_of_mediapipe_are_read():
    marks = [SimpleNamespace(x=i / 100, y=i / 50, z=0.0) for i in range(21)]
    assert first_of([]) is None
    assert first_of([marks]).shape == (21, 2)
    assert first_of([marks], PALM)[:, 0].tolist() == [i / 100 for i in PALM]


def test_a_handover_by_camera():
    """The whole loop with eyes that see a still person through images."""
    scene = scene_at(Case("ball"), None)
    hand, face = scene.hand.position, scene.face.position
    picture = frame_of([hand, face])
    eyes = CameraEyes(CAMERA, lambda time: Frame(time, picture.image, picture.depth),
                      lambda image: project(hand)[0][None], lambda image: project(face)[0][None])  # fmt: skip
    run = execute(Job(lambda: "ours", lambda sight: scene_at(Case("ball"), sight), eyes,
                      SimulatedArm(scene.robot.home, 10)))  # fmt: skip
    assert run.end == "done"


def test_without_the_package_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mediapipe", None)
    with pytest.raises(ml.MissingPart, match="mediapipe") as error:
        mediapipe_landmarks("hand.task", "face.task")
    assert "mlnlite[mediapipe]" in str(error.value)


@pytest.mark.skipif(find_spec("mediapipe") is None, reason="needs the extra mediapipe")
def test_models_that_are_none(tmp_path):
    with pytest.raises(ml.MlnError, match="no model at"):
        mediapipe_landmarks(tmp_path / "hand.task", tmp_path / "face.task")
    (tmp_path / "hand.task").write_text("nothing")
    with pytest.raises(ml.MlnError, match="is no model"):
        mediapipe_landmarks(tmp_path / "hand.task", tmp_path / "face.task")
