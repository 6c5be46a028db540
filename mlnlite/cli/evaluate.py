"""`mlnlite evaluate`: how well a model predicts labels."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

import click

from mlnlite.cli.files import emit
from mlnlite.cli.options import (
    TOGETHER,
    closed_world_option,
    dialect_option,
    evidence_option,
    format_option,
    models_argument,
    names,
    open_world_option,
    output_option,
)
from mlnlite.cli.terminal import warn, working
from mlnlite.cli.worlds import closed_world, opened

if TYPE_CHECKING:
    from mlnlite.syntax.tree import Dialect


class _Options(TypedDict):
    models: tuple[Path, ...]
    evidence: tuple[Path, ...]
    query: tuple[str, ...]
    closed_world: tuple[str, ...]
    open_world: tuple[str, ...]
    calibration: bool
    output: Path | None
    dialect: Dialect | None
    format: Literal["text", "json"]


@click.command()
@models_argument
@evidence_option(TOGETHER)
@click.option(
    "-q", "--query", multiple=True, required=True, metavar="NAMES", help="Predicates whose facts are the labels."
)
@closed_world_option
@open_world_option
@click.option("--calibration", is_flag=True, help="Also plot how often what is said is so.")
@output_option
@dialect_option
@format_option("text", "json")
def evaluate(**options: Unpack[_Options]) -> None:
    """Measure how well a model predicts what databases already say.

    In each database the facts about the predicates of -q are hidden together, their marginals are asked given the
    rest, and compared with the facts: accuracy (for `P(x, y!)` of each block's most probable value), balanced accuracy,
    log-loss, Brier score, and the accuracy of always saying the most frequent label.

    If some fact about a predicate is negative, its labels are the facts; otherwise all its atoms in databases that have
    a fact about it, those that are not facts being false. The other predicates have closed worlds, as in learning,
    unless --closed-world names which have, or --open-world which have not. Several files describe one world together.
    """
    import mlnlite as ml

    labels = names(options["query"])
    with working("reading"):
        model = opened(ml.read_model(*options["models"], dialect=options["dialect"]), names(options["open_world"]))
        files = options["evidence"]
        evidence = ml.read_evidence(*files, model=model, together=len(files) > 1)
    warn(evidence.warnings)
    closed = closed_world(model, labels, names(options["closed_world"]) or ["all"], names(options["open_world"]))
    with working("inferring"):
        found = ml.evaluate(model, evidence, predicates=labels, closed_world=closed)
    if options["format"] == "json":
        emit(found.to_json(), options["output"])
        return
    plots = [f"\n{s.predicate}\n{s.calibration}" for s in found.scores] if options["calibration"] else []
    emit("\n".join([str(found), *plots]), options["output"])
