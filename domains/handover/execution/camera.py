"""Eyes of a depth camera: colour and depth images in, hand and face in the world out.

Landmarks come from any detector; `mediapipe_landmarks` makes those of MediaPipe (Lugaresi et al. 2019; extra
`mlnlite[mediapipe]`). A landmark is lifted to a place by the depth beneath it, seen by a pinhole camera.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mlnlite as ml
from mlnlite.domains.handover.execution.sockets import Sight
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, transform_points

Image = NDArray[np.uint8]
Landmarks = Callable[[Image], "FloatArray | None"]
"""Finds landmarks in an image of shape (h, w, 3): positions x, y of shape (n, 2), 0 to 1 across the image; or None."""
PALM = (0, 5, 9, 13, 17)
"""Wrist and knuckles among the 21 landmarks of a hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A pinhole camera.

    Attributes:
        focal: focal lengths along x and y [px].
        centre: where the axis meets the image [px].
        pose: of the camera in the world; its x axis points right, y down, z ahead.
    """

    focal: tuple[float, float]
    centre: tuple[float, float]
    pose: Pose


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """What a camera took.

    Attributes:
        time: when [s].
        image: red, green, blue, shape (h, w, 3).
        depth: distance along the camera's axis, shape (h, w) [m]; 0 or nan where it is not known.
    """

    time: float
    image: Image
    depth: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class CameraEyes:
    """`Perception` by a depth camera.

    Attributes:
        camera: where it is and how it sees.
        take: the latest frame at a time [s], or None.
        hand: finds the landmarks of a palm.
        face: finds those of a face.
    """

    camera: Camera
    take: Callable[[float], Frame | None]
    hand: Landmarks
    face: Landmarks

    def look(self, time: float) -> Sight | None:
        """Hand and face in the latest frame; None if either is not found or has no depth."""
        frame = self.take(time)
        if frame is None:
            return None
        hand, face = (self._place(frame, found(frame.image)) for found in (self.hand, self.face))
        return None if hand is None or face is None else Sight(frame.time, hand, face)

    def _place(self, frame: Frame, landmarks: FloatArray | None) -> FloatArray | None:
        """The middle of landmarks in the world, shape (3,) [m]; of those that have a depth."""
        if landmarks is None:
            return None
        height, width = frame.depth.shape
        pixels = np.asarray(landmarks, dtype=np.float64) * (width, height)
        column, row = np.floor(pixels).astype(int).T
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        depth = frame.depth[row[inside], column[inside]]
        known = np.isfinite(depth) & (depth > 0)
        if not known.any():
            return None
        rays = (pixels[inside][known] - self.camera.centre) / self.camera.focal
        points = np.column_stack([rays, np.ones(len(rays))]) * depth[known, None]
        middle: FloatArray = transform_points(self.camera.pose, np.median(points, axis=0))
        return middle


def mediapipe_landmarks(hand_model: str | Path, face_model: str | Path) -> tuple[Landmarks, Landmarks]:
    """Finders of palm and face by MediaPipe, for `CameraEyes`.

    The models are files that MediaPipe's authors publish apart from the package: `hand_landmarker.task` and
    `face_landmarker.task`.

    Raises:
        MissingPart: the extra is not installed.
        MlnError: a model file is missing, or is not one.
    """
    try:
        import mediapipe
        from mediapipe.tasks.python import BaseOptions, vision
    except ModuleNotFoundError as reason:
        hint = 'pip install "mlnlite[mediapipe]"'
        raise ml.MissingPart(f"eyes by MediaPipe need the package {reason.name!r}", hint=hint) from None
    kinds: list[tuple[Any, Any, str | Path, str]] = [
        (vision.HandLandmarker, vision.HandLandmarkerOptions, hand_model, "hand_landmarks"),
        (vision.FaceLandmarker, vision.FaceLandmarkerOptions, face_model, "face_landmarks"),
    ]
    finders = []
    for kind, options, path, name in kinds:
        if not Path(path).is_file():
            raise ml.MlnError(f"no model at {path}", hint=f"give the path of MediaPipe's {name[:4]}_landmarker.task")
        try:
            detector = kind.create_from_options(options(base_options=BaseOptions(model_asset_path=str(path))))
        except (RuntimeError, ValueError) as reason:
            raise ml.MlnError(
                f"{path} is no model for {name}: {reason}", hint="get it from MediaPipe's pages"
            ) from None
        finders.append(_finder(mediapipe, detector, name, PALM if name == "hand_landmarks" else None))
    return finders[0], finders[1]


def _finder(mediapipe: Any, detector: Any, name: str, chosen: Iterable[int] | None) -> Landmarks:  # noqa: ANN401
    def find(image: Image) -> FloatArray | None:
        shown = mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=np.ascontiguousarray(image))
        return first_of(getattr(detector.detect(shown), name), chosen)

    return find


def first_of(found: Any, chosen: Iterable[int] | None = None) -> FloatArray | None:  # noqa: ANN401 - MediaPipe's result
    """The first hand or face of a MediaPipe result as positions, shape (n, 2); all landmarks, or some by index."""
    if not found:
        return None
    positions = np.array([(mark.x, mark.y) for mark in found[0]], dtype=np.float64)
    return positions if chosen is None else positions[list(chosen)]
