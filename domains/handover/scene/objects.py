"""Objects to hand over: a name or a TOML file in, semantics with geometry and affordance regions out.

The frame of an object is at the centre of its bounding box.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from mlnlite import MlnError
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose, locked
from mlnlite.domains.handover.scene.geometry import SIZES, Part, Surface, part_mesh, sample_mesh, sample_parts
from mlnlite.domains.handover.tables import DATA, choose, read_table, take

SHAPES = ("cube", "cylinder", "sphere", "irregular", "elongated")
CATEGORIES = ("work_tool", "cleaning_tool", "crockery", "cooking_tool", "electronics")
MATERIALS = ("plastic", "rubber", "fabric", "glass", "cardboard", "aluminium")
TEXTURES = ("smooth", "bumpy", "slippery", "grainy", "fluffy")
_VERBS = (
    "clean",
    "clip",
    "contain",
    "cut",
    "hand_over",
    "pour",
    "read",
    "screw",
    "shake",
    "shape",
    "squeeze",
    "stack",
    "write",
)
AFFORDANCES = tuple(f"to_{verb}" for verb in _VERBS)
"""The thirteen of the published data."""
N_POINTS = 600


@dataclass(frozen=True, slots=True, eq=False)
class HandoverObject:
    """What the domain knows about an object.

    Attributes:
        name: as the user knows it.
        shape: shape context, one of `SHAPES`.
        category: one of `CATEGORIES`.
        material: one of `MATERIALS`.
        texture: one of `TEXTURES`.
        mass: [kg].
        known: whether the name is known from the paper's work.
        affordances: pairs of a task and the region that the receiver needs for it.
        regions: names of the regions; number i + 1 in the published data is index i here.
        surface: points with normals and region indices, in the frame of the object [m].
        mesh: triangles for pictures and collisions, in the frame of the object [m].
        parts: primitives, or empty for a mesh.
    """

    name: str
    shape: str
    category: str
    material: str
    texture: str
    mass: float
    known: bool
    affordances: tuple[tuple[str, str], ...]
    regions: tuple[str, ...]
    surface: Surface
    mesh: trimesh.Trimesh
    parts: tuple[Part, ...]


def object_names() -> tuple[str, ...]:
    """The objects of the catalogue."""
    return tuple(read_table(DATA / "objects.toml"))


def read_object(name: str, *, catalogue: str | Path | None = None) -> HandoverObject:
    """An object of the catalogue, or of a TOML file of your own in the same form.

    Raises:
        MlnError: unknown object, or a mistake in its entry, with file and key.
    """
    return _known_object(name) if catalogue is None else _read_entry(name, Path(catalogue))


@lru_cache(maxsize=64)
def _known_object(name: str) -> HandoverObject:
    return _read_entry(name, DATA / "objects.toml")


def _read_entry(name: str, source: Path | Traversable) -> HandoverObject:
    table = read_table(source)
    entry = table[choose(name, table, "object")]
    where = f"{source if isinstance(source, Path) else source.name}: [{name}]"
    if not isinstance(entry, dict):
        raise MlnError(f"{where}: expected a table of attributes", hint=f"write [{name}] and its keys below")
    return _object(name, entry, where, source.parent if isinstance(source, Path) else Path())


def _object(name: str, entry: dict[str, Any], where: str, folder: Path) -> HandoverObject:
    words = {"shape": SHAPES, "category": CATEGORIES, "material": MATERIALS, "texture": TEXTURES}
    found = {key: choose(take(entry, key, str, where), known, f"{key} in {where}") for key, known in words.items()}
    mass = float(take(entry, "mass", (int, float), where))
    if not 0 < mass < 100:
        raise MlnError(f"{where}: mass is {mass} kg, expected between 0 and 100 kg", hint="masses are in kilograms")
    regions, parts, surface, mesh = _shape(entry, where, folder)
    affordances = take(entry, "affordances", dict, where)
    for task, region in affordances.items():
        choose(task, AFFORDANCES, f"affordance in {where}")
        choose(region, regions, f"region in {where}")
    known = bool(entry.get("known", False))
    return HandoverObject(name, **found, mass=mass, known=known, affordances=tuple(affordances.items()),
                          regions=regions, surface=surface, mesh=mesh, parts=parts)  # fmt: skip


def region_of(thing: HandoverObject, task: str) -> int:
    """Index of the region that the receiver needs for a task.

    Raises:
        MlnError: the object does not afford the task.
    """
    regions = dict(thing.affordances)
    return thing.regions.index(regions[choose(task, regions, f"task of {thing.name!r}")])


def region_points(thing: HandoverObject, region: int) -> FloatArray:
    """Surface points of a region, shape (m, 3) [m]."""
    points: FloatArray = thing.surface.points[thing.surface.labels == region]
    return points


def region_centre(thing: HandoverObject, region: int) -> FloatArray:
    """The surface point of a region nearest to the mean of its points, shape (3,) [m]: where the receiver grasps."""
    points = region_points(thing, region)
    centre: FloatArray = points[np.linalg.norm(points - points.mean(axis=0), axis=1).argmin()]
    return centre


_Shape = tuple[tuple[str, ...], tuple[Part, ...], Surface, trimesh.Trimesh]


def _shape(entry: dict[str, Any], where: str, folder: Path) -> _Shape:
    return _mesh_shape(entry, where, folder) if "mesh" in entry else _part_shape(entry, where)


def _part_shape(entry: dict[str, Any], where: str) -> _Shape:
    rows = take(entry, "parts", list, where)
    regions: dict[str, int] = {}
    parts = tuple(_part(row, regions, f"{where}: part {i + 1}") for i, row in enumerate(rows))
    if not parts:
        raise MlnError(f"{where}: no parts", hint="give at least one primitive, or mesh = 'file.stl'")
    middle = _union(parts).bounds.mean(axis=0)
    parts = tuple(_shifted(part, middle) for part in parts)
    surface = sample_parts(parts, N_POINTS, np.random.default_rng(0))
    missing = [name for name, i in regions.items() if not (surface.labels == i).any()]
    if missing:
        raise MlnError(f"{where}: no surface is left for {', '.join(missing)}", hint="its parts are hidden in others")
    return tuple(regions), parts, surface, _union(parts)


def _union(parts: tuple[Part, ...]) -> trimesh.Trimesh:
    """All triangles of the parts, those inside as well."""
    meshes = [part_mesh(part) for part in parts]
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [np.asarray(mesh.faces) + n for mesh, n in zip(meshes, offsets[:-1], strict=True)]
    return trimesh.Trimesh(np.vstack([mesh.vertices for mesh in meshes]), np.vstack(faces), process=False)


def _part(row: dict[str, Any], regions: dict[str, int], where: str) -> Part:
    kind = choose(take(row, "shape", str, where), SIZES, f"primitive in {where}")
    size = _numbers(row, "size", SIZES[kind], where)
    if min(size) <= 0 or (kind == "tube" and size[0] >= size[1]):
        raise MlnError(f"{where}: size is {size}, expected positive lengths, the inner radius below the outer")
    at = _numbers(row, "at", 3, where) if "at" in row else (0.0, 0.0, 0.0)
    turn = _numbers(row, "turn", 3, where) if "turn" in row else (0.0, 0.0, 0.0)
    pose = Pose(locked(at), Rotation.from_euler("xyz", turn, degrees=True).as_matrix(), "object")
    region = regions.setdefault(take(row, "region", str, where), len(regions))
    return Part(kind, size, pose, region, _cut(row, regions, where))


def _cut(row: dict[str, Any], regions: dict[str, int], where: str) -> tuple[int, float, int] | None:
    if "split" not in row:
        return None
    split = take(row, "split", dict, where)
    axis = "xyz".index(choose(take(split, "axis", str, where), "xyz", f"axis in {where}"))
    low = regions.setdefault(take(split, "low", str, where), len(regions))
    return axis, float(take(split, "at", (int, float), where)), low


def _numbers(row: dict[str, Any], key: str, n: int, where: str) -> tuple[float, ...]:
    values = take(row, key, list, where)
    if len(values) != n or not all(isinstance(v, (int, float)) and np.isfinite(v) for v in values):
        raise MlnError(f"{where}: {key!r} is {values!r}, expected {n} numbers", hint="lengths in m, angles in degrees")
    return tuple(float(v) for v in values)


def _shifted(part: Part, middle: FloatArray) -> Part:
    cut = None if part.cut is None else (part.cut[0], part.cut[1] - float(middle[part.cut[0]]), part.cut[2])
    pose = Pose(part.pose.position - middle, part.pose.rotation, "object")
    return Part(part.kind, part.size, pose, part.region, cut)


def _mesh_shape(entry: dict[str, Any], where: str, folder: Path) -> _Shape:
    """A mesh file [m]; its regions are boxes `[[low], [high]]` [m], the first that holds a point; others are `rest`."""
    path = folder / take(entry, "mesh", str, where)
    try:
        mesh = trimesh.load_mesh(path)
    except (OSError, ValueError, IndexError, KeyError, NotImplementedError) as reason:
        raise MlnError(f"{where}: cannot read the mesh {path}: {reason}", hint="use a sound STL, OBJ or PLY") from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        raise MlnError(f"{where}: the mesh {path} has no usable triangles", hint="export one closed surface")
    scale = float(entry.get("scale", 1.0))
    if not 0.005 <= scale * float(np.max(mesh.extents)) <= 2.0:
        raise MlnError(f"{where}: the mesh is {scale * float(np.max(mesh.extents)):.3g} m long",
                       hint="lengths are in metres; for a mesh in millimetres write scale = 0.001")  # fmt: skip
    middle = mesh.bounds.mean(axis=0)
    boxes = take(entry, "regions", dict, where)
    points, normals = sample_mesh(mesh, N_POINTS, np.random.default_rng(0))
    labels = np.full(len(points), len(boxes), dtype=np.int64)
    for i, (name, box) in reversed(list(enumerate(boxes.items()))):
        if np.shape(box) != (2, 3):
            raise MlnError(
                f"{where}: region {name!r} is {box!r}, expected [[x, y, z], [x, y, z]]", hint="low, high [m]"
            )
        low, high = np.array(box, dtype=np.float64)
        labels[((scale * points >= low) & (scale * points <= high)).all(axis=1)] = i
    names = (*boxes, "rest") if (labels == len(boxes)).any() else tuple(boxes)
    empty = [name for i, name in enumerate(names) if not (labels == i).any()]
    if empty:
        raise MlnError(
            f"{where}: no surface lies in the region {', '.join(empty)}", hint=f"the mesh spans {mesh.bounds}"
        )
    labels.setflags(write=False)
    mesh.apply_translation(-middle)
    mesh.apply_transform(np.diag([scale, scale, scale, 1.0]))
    return names, (), Surface(locked(scale * (points - middle)), locked(normals), labels), mesh
