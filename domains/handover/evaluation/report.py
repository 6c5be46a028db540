"""The evaluation report: what was asked for in, Markdown with figures out. Generated; every number has its command."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from mlnlite.domains.handover.evaluation import figures, tables
from mlnlite.domains.handover.evaluation.grasp_choice import compare_grasps
from mlnlite.domains.handover.evaluation.protocol import Split, run_splits
from mlnlite.domains.handover.evaluation.published import read_published
from mlnlite.domains.handover.evaluation.quality import measure, quality_table
from mlnlite.domains.handover.evaluation.real import HeldOut, held_out
from mlnlite.domains.handover.figures import save
from mlnlite.domains.handover.instances.generate import LABELS, generate
from mlnlite.domains.handover.instances.poses import Cell, Placed, all_cells, place_all
from mlnlite.domains.handover.mobility import read_levels
from mlnlite.domains.handover.objects import object_names, read_object


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

Data made by the cost model and data published by the authors are never pooled. The authors' 1,657 instances, their
poses and their survey are not published, so nothing here repeats their 90.8 %.
"""


def write_report(asked: Asked, folder: Path, say: Callable[[str], None]) -> str:
    """Writes `index.md` and its figures; returns where.

    Args:
        asked: what to evaluate.
        folder: to write to.
        say: told of progress.
    """
    folder.mkdir(parents=True, exist_ok=True)
    start = monotonic()
    parts = [_HEAD.format(splits=asked.splits, data=" --data PATH" if asked.data else "")]
    parts.append(_protocol(asked, folder, say))
    parts.append(tables.ablation_of_roles(generate("preferred", seed=asked.seed)))
    say(f"{monotonic() - start:.0f} s: models without parts of the knowledge")
    if asked.data:
        parts.append(_real(asked, asked.data, folder))
        say(f"{monotonic() - start:.0f} s: the authors' rows")
    if asked.quality:
        parts.append(tables.QUALITY + quality_table(measure(workers=asked.workers)) + "\n")
        say(f"{monotonic() - start:.0f} s: quality of handovers")
    choices = compare_grasps([read_object(name) for name in object_names()])
    save(figures.draw_grasps(choices), folder / "grasps.png")
    parts.append(tables.grasp_section(choices))
    (folder / "index.md").write_text("\n".join(parts), encoding="utf-8")
    return f"written: {folder / 'index.md'} after {monotonic() - start:.0f} s"


def _protocol(asked: Asked, folder: Path, say: Callable[[str], None]) -> str:
    start = monotonic()
    things = [read_object(name) for name in object_names()]
    placed: dict[Cell, Placed] = place_all(all_cells(things, [x.name for x in read_levels()]), workers=asked.workers)
    say(f"{monotonic() - start:.0f} s: poses of {len(placed)} cells")
    found: dict[str, Sequence[Split]] = {}
    for labels in LABELS:
        rows = generate(labels, seed=asked.seed)
        found[labels] = run_splits(rows, placed, asked.splits, seed=asked.seed, workers=asked.workers)
        say(f"{monotonic() - start:.0f} s: {asked.splits} splits, labels {labels}")
    save(figures.draw_protocol(found), folder / "splits.png")
    return tables.protocol_section(found)


def _real(asked: Asked, data: Path, folder: Path) -> str:
    rows = read_published(data)
    found: list[HeldOut] = []
    for scheme in ("key", "block"):
        found += held_out(rows, scheme, seed=asked.seed, workers=asked.workers)
    save(figures.draw_calibration(found), folder / "calibration.png")
    return tables.real_section(found) + tables.cells_section(rows) + tables.real_ablation(rows)
