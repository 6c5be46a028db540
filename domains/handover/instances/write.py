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
from mlnlite.domains.handover.knowledge.words import environments_of, read_knowledge, role_of
from mlnlite.domains.handover.objects import read_object

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
        MlnError: no such file, or a column is missing; with the line.
    """
    names = [f.name for f in fields(Instance)]
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [name for name in names if name not in (reader.fieldnames or ())]
            if missing:
                raise ml.MlnError(f"{path}:1: columns are missing: {', '.join(missing)}",
                                  hint="write the table with `mlnlite handover dataset`")  # fmt: skip
            return tuple(_instance(row, f"{path}:{reader.line_num}") for row in reader)
    except OSError as reason:
        raise ml.MlnError(f"cannot read {path}: {reason}", hint="give the path of a table of instances") from None


def _instance(row: Mapping[str, str], where: str) -> Instance:
    if not (row["region"] or "").isdigit():
        raise ml.MlnError(f"{where}: region is {row['region']!r}, expected a number from 1")
    return Instance(row["source"], row["thing"], row["task"], row["level"], row["method"], int(row["region"]))


def _write(path: Path, head: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        writer.writerows(rows)
