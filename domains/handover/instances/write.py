"""Files of instances: rows and poses in, a `.db`, a table of rows and a table of mean poses out; and back again."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

import mlnlite as ml
from mlnlite.domains.handover.instances.generate import Instance, facts_of
from mlnlite.domains.handover.instances.poses import Cell, MeanPose, Placed, cell_of
from mlnlite.domains.handover.knowledge.facts import databases_text, kept
from mlnlite.domains.handover.knowledge.words import LEVELS, METHODS, environments_of, read_knowledge, role_of
from mlnlite.domains.handover.scene.objects import object_names, read_object
from mlnlite.domains.handover.tables import choose

_POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
_GRASP = tuple(f"grasp_{name}" for name in _POSE)
_OBJECT = ("shape", "category", "material", "texture", "environments", "region_name", "role")


def write_db(instances: Sequence[Instance], path: Path) -> None:
    """What the domain's own model has words for, one database for each instance."""
    known = read_knowledge().predicates
    path.write_text(databases_text([kept(facts, known) for facts in facts_of(instances)]), encoding="utf-8")


def write_rows(instances: Sequence[Instance], placed: Mapping[Cell, Placed], path: Path) -> None:
    """One line for each instance: who, what, how; the object's semantics; poses of object and grasp, if known."""
    head = (*(f.name for f in fields(Instance)), *_OBJECT, *_POSE, *_GRASP, "reach_m")
    _write(path, head, (_row(instance, placed.get(cell_of(instance))) for instance in instances))


def _row(instance: Instance, placed: Placed | None) -> tuple[Any, ...]:
    thing = read_object(instance.thing)
    region = thing.regions[instance.region - 1]
    semantics = (thing.shape, thing.category, thing.material, thing.texture, " ".join(environments_of(thing)), region,
                 role_of(thing, region))  # fmt: skip
    return (*astuple(instance), *semantics, *_numbers(placed))


def _numbers(placed: Placed | None) -> list[str]:
    if placed is None or placed.status != "optimal":
        return [""] * (len(_POSE) + len(_GRASP) + 1)
    values = (*placed.position, *placed.quaternion, *placed.grasp_position, *placed.grasp_quaternion, placed.reach)
    return [f"{value:.9g}" for value in values]


def write_templates(means: Mapping[tuple[str, str], MeanPose], path: Path) -> None:
    """The mean pose of each shape context and method, with its spread."""
    head = ("shape", "method", "n", *_POSE, "spread_m", "spread_rad")
    rows = ((*key, m.n, *(f"{v:.9g}" for v in (*m.position, *m.quaternion, m.spread, m.angle)))
            for key, m in means.items())  # fmt: skip
    _write(path, head, rows)


def read_rows(path: str | Path) -> tuple[Instance, ...]:
    """Instances of a table that `write_rows` wrote.

    Raises:
        MlnError: no such file, a column is missing, or a cell is not what it should be; with the line.
    """
    names = [f.name for f in fields(Instance)]
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [name for name in names if name not in (reader.fieldnames or ())]
            if missing:
                raise ml.MlnError(f"{path}:1: columns are missing: {', '.join(missing)}",
                                  hint="write the table with `mlnlite handover dataset`")  # fmt: skip
            rows = tuple(_instance(row, f"{path}:{reader.line_num}") for row in reader)
    except (OSError, UnicodeDecodeError) as reason:
        raise ml.MlnError(f"cannot read {path}: {reason}", hint="give the path of a table of instances") from None
    if not rows:
        raise ml.MlnError(f"{path}: no instances", hint="one line for each instance below the head")
    return rows


def _instance(row: Mapping[str, str], where: str) -> Instance:
    thing = read_object(choose(row["thing"], object_names(), f"object in {where}"))
    task = choose(row["task"], dict(thing.affordances), f"task of {thing.name} in {where}")
    level = choose(row["level"], LEVELS, f"mobility level in {where}")
    method = choose(row["method"], METHODS, f"method in {where}")
    numbers = [str(i + 1) for i in range(len(thing.regions))]
    region = choose(row["region"], numbers, f"region of {thing.name} in {where}")
    return Instance(row["source"], thing.name, task, level, method, int(region))


def _write(path: Path, head: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        writer.writerows(rows)
