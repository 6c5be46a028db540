"""Parametric solids: parts in, surface points with normals and region labels out. Meshes come from trimesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, locked, transform_points

Labels = NDArray[np.int64]
SIZES = {"box": 3, "cylinder": 2, "capsule": 2, "sphere": 1, "tube": 3}
"""Kinds of primitives and how many lengths each has."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A primitive of an object.

    Attributes:
        kind: one of `SIZES`.
        size: its lengths [m].
        pose: in the object.
        region: index of its region.
        cut: axis, place [m] and region index of the side below the place; or None.
    """

    kind: str
    size: tuple[float, ...]
    pose: Pose
    region: int
    cut: tuple[int, float, int] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Points on a surface.

    Attributes:
        points: shape (n, 3) [m].
        normals: outward unit normals, shape (n, 3).
        labels: region index of each point, shape (n,).
    """

    points: FloatArray
    normals: FloatArray
    labels: Labels


def part_mesh(part: Part) -> trimesh.Trimesh:
    """The mesh of a part in the frame of the object [m]."""
    size = part.size
    mesh: trimesh.Trimesh
    if part.kind == "box":
        mesh = trimesh.creation.box(extents=size)
    elif part.kind == "cylinder":
        mesh = trimesh.creation.cylinder(radius=size[0], height=size[1], sections=48)
    elif part.kind == "capsule":
        mesh = trimesh.creation.capsule(radius=size[0], height=size[1], count=[8, 16])
        mesh.apply_translation([0, 0, -mesh.bounds.mean(axis=0)[2]])
    elif part.kind == "sphere":
        mesh = trimesh.creation.icosphere(subdivisions=2, radius=size[0])
    else:
        mesh = trimesh.creation.annulus(r_min=size[0], r_max=size[1], height=size[2], sections=48)
    mesh.apply_transform(part.pose.matrix)
    return mesh


def is_inside(part: Part, points: FloatArray) -> NDArray[np.bool_]:
    """Which points, shape (n, 3) [m], lie inside a part; shape (n,)."""
    local = (points - part.pose.position) @ part.pose.rotation
    radius, height = np.hypot(local[:, 0], local[:, 1]), np.abs(local[:, 2])
    size = part.size
    if part.kind == "box":
        inside = (np.abs(local) < 0.5 * np.array(size)).all(axis=1)
    elif part.kind == "cylinder":
        inside = (radius < size[0]) & (height < 0.5 * size[1])
    elif part.kind == "capsule":
        inside = np.hypot(radius, np.maximum(0.0, height - 0.5 * size[1])) < size[0]
    elif part.kind == "sphere":
        inside = np.hypot(radius, height) < size[0]
    else:
        inside = (radius > size[0]) & (radius < size[1]) & (height < 0.5 * size[2])
    return np.asarray(inside, dtype=np.bool_)


def is_hidden(parts: tuple[Part, ...], points: FloatArray) -> NDArray[np.bool_]:
    """Which points, shape (n, 3) [m], lie inside any of the parts; shape (n,)."""
    hidden = np.zeros(len(points), dtype=np.bool_)
    for part in parts:
        hidden |= is_inside(part, points)
    return hidden


def sample_mesh(mesh: trimesh.Trimesh, n: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """`n` points, uniform by area, with the normals of their faces; each of shape (n, 3) [m]."""
    corners = np.asarray(mesh.triangles)
    faces = rng.choice(len(corners), size=n, p=mesh.area_faces / mesh.area_faces.sum())
    u, v = rng.random(n), rng.random(n)
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = (corners[faces, i] for i in range(3))
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return points, np.asarray(mesh.face_normals)[faces]


def sample_parts(parts: tuple[Part, ...], n: int, rng: np.random.Generator) -> Surface:
    """About `n` points on the outside of a union of parts: what a part hides in another is left out.

    A part gets points by the square root of its area, so that small regions are not missed.
    """
    meshes = [part_mesh(part) for part in parts]
    total = sum(np.sqrt(mesh.area) for mesh in meshes)
    found = []
    for part, mesh in zip(parts, meshes, strict=True):
        points, normals = sample_mesh(mesh, max(40, round(n * np.sqrt(mesh.area) / total)), rng)
        outside = points + 1e-3 * normals
        free = ~is_hidden(tuple(other for other in parts if other is not part), outside)
        found.append((points[free], normals[free], _labels(part, points[free])))
    points, normals, labels = (np.concatenate(columns) for columns in zip(*found, strict=True))
    labels.setflags(write=False)
    return Surface(locked(points), locked(normals), labels)


def _labels(part: Part, points: FloatArray) -> Labels:
    labels = np.full(len(points), part.region, dtype=np.int64)
    if part.cut:
        axis, place, low = part.cut
        labels[points[:, axis] < place] = low
    return labels


def moved(surface: Surface, pose: Pose) -> Surface:
    """The surface in the frame of the pose."""
    return Surface(transform_points(pose, surface.points), surface.normals @ pose.rotation.T, surface.labels)
