"""The command `evaluate`: the report of all evaluations, with figures."""

from __future__ import annotations

from pathlib import Path

import click

from mlnlite.domains.handover import load
from mlnlite.domains.handover.cli.options import COUNT


@click.command()
@click.option(
    "--out", "-o", default="out/evaluation", show_default=True, type=click.Path(file_okay=False), help="Folder."
)
@click.option("--splits", default=200, type=COUNT, show_default=True, help="Repetitions of the paper's protocol.")
@click.option("--data", type=click.Path(file_okay=False), help="Folder with the authors' files, handover/dataset.db.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of instances, splits, folds.")
@click.option("--workers", default=2, type=COUNT, show_default=True, help="Processes.")
@click.option("--quality/--no-quality", default=True, show_default=True, help="Also the quality of handovers.")
def evaluate(out: str, splits: int, data: str | None, seed: int, workers: int, quality: bool) -> None:
    """Evaluate on unseen objects, on the authors' rows, and the handovers themselves."""
    reporting = load("evaluation.report")
    asked = reporting.Asked(splits, Path(data) if data else None, seed, workers, quality)
    reporting.write_report(asked, Path(out), click.echo)
