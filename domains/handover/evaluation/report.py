"""The evaluation report: what was asked for in, Markdown with figures out. Generated; every number has its command."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from mlnlite.domains.handover.evaluation import figures, tables
from mlnlite.domains.handover.evaluation.goals import goals_section
from mlnlite.domains.handover.evaluation.grasp_choice import compare_grasps
from mlnlite.domains.handover.evaluation.predictions import write_rows, write_splits
from mlnlite.domains.handover.evaluation.protocol import Split, run_splits
from mlnlite.domains.handover.evaluation.protocol_tables import ablation_of_roles, protocol_section
from mlnlite.domains.handover.evaluation.published import PublishedRow, read_published
from mlnlite.domains.handover.evaluation.quality import measure, quality_section
from mlnlite.domains.handover.evaluation.real import HeldOut, held_out
from mlnlite.domains.handover.instances.generate import LABELS, generate
from mlnlite.domains.handover.instances.poses import Cell, Placed, all_cells, place_all
from mlnlite.domains.handover.scene.mobility import read_levels
from mlnlite.domains.handover.scene.objects import object_names, read_object
from mlnlite.domains.handover.show.figures import save


@dataclass(frozen=True, slots=True)
class Asked:
    """What to evaluate.

    Attributes:
        splits: repetitions of the paper's protocol.
        data: folder of the authors' files, or None.
        seed: of instances, splits and folds.
        workers: processes.
        quality: whether to look at the handovers themselves.
    """

    splits: int = 200
    data: Path | None = None
    seed: int = 0
    workers: int = 2
    quality: bool = True


_HEAD = """# Evaluation

Written by `mlnlite handover evaluate --splits {splits}{data} --out docs/handover/evaluation`; do not edit.

Three kinds of rows are never pooled in one number: rows of the study (the published counts of preferences, with objects
and tasks drawn by us), synthetic rows, and the rows that the authors published. The authors' 1,657 instances, their
poses and their survey are not published, so nothing here repeats their 90.8 %.
"""


def write_report(asked: Asked, folder: Path, say: Callable[[str], None]) -> None:
    """Writes `index.md`, its figures, and what was predicted.

    Args:
        asked: what to evaluate.
        folder: to write to.
        say: told of progress.
    """
    folder.mkdir(parents=True, exist_ok=True)
    start = monotonic()

    def told(stage: str) -> None:
        say(f"{monotonic() - start:4.0f} s, {sum(os.times()[:4]):4.0f} s of processors: {stage}")

    rows = read_published(asked.data) if asked.data else ()
    protocol = _protocol(asked, folder, told)
    parts = [protocol_section(protocol)]
    parts.append(ablation_of_roles(generate("preferred", seed=asked.seed), workers=asked.workers))
    told("models without parts of the knowledge")
    real: Sequence[HeldOut] = ()
    if rows:
        real = _real(rows, asked, folder)
        parts.append(tables.real_section(real) + tables.cells_section(rows))
        told("the authors' rows")
        parts.append(tables.real_ablation(rows, workers=asked.workers))
        told("the authors' rows, parts of the knowledge left out")
    if asked.quality:
        names = object_names()
        parts.append(quality_section(measure(names, workers=asked.workers), len(names)))
        told("quality of handovers")
    choices = compare_grasps([read_object(name) for name in object_names()])
    save(figures.draw_grasps(choices), folder / "grasps.png")
    head = _HEAD.format(splits=asked.splits, data=" --data PATH" if asked.data else "")
    whole = [head, goals_section(protocol, real), *parts, tables.grasp_section(choices)]
    (folder / "index.md").write_text("\n".join(whole), encoding="utf-8")
    told(f"written: {folder / 'index.md'}")


def _protocol(asked: Asked, folder: Path, told: Callable[[str], None]) -> dict[str, Sequence[Split]]:
    things = [read_object(name) for name in object_names()]
    placed: dict[Cell, Placed] = place_all(all_cells(things, [x.name for x in read_levels()]), workers=asked.workers)
    told(f"poses of {len(placed)} cells")
    found: dict[str, Sequence[Split]] = {}
    for labels in LABELS:
        rows = generate(labels, seed=asked.seed)
        found[labels] = run_splits(rows, placed, asked.splits, seed=asked.seed, workers=asked.workers)
        told(f"{asked.splits} splits, labels {labels}")
    save(figures.draw_protocol(found), folder / "splits.png")
    write_splits(found, folder / "splits.parquet")
    return found


def _real(rows: Sequence[PublishedRow], asked: Asked, folder: Path) -> Sequence[HeldOut]:
    found: list[HeldOut] = []
    for scheme in ("key", "block"):
        found += held_out(rows, scheme, seed=asked.seed, workers=asked.workers)
    save(figures.draw_calibration(found), folder / "calibration.png")
    write_rows(found, folder / "rows.parquet")
    return found
