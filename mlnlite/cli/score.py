"""`mlnlite score`: what a given world is worth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

import click

from mlnlite.cli.files import emit
from mlnlite.cli.options import (
    FILE,
    TOGETHER,
    database_option,
    dialect_option,
    evidence_option,
    format_option,
    models_argument,
    output_option,
)
from mlnlite.cli.terminal import working
from mlnlite.cli.worlds import evidence_of_one_world

if TYPE_CHECKING:
    from mlnlite.syntax.tree import Dialect


class _Options(TypedDict):
    models: tuple[Path, ...]
    evidence: tuple[Path, ...]
    world: Path
    database: int | None
    output: Path | None
    dialect: Dialect | None
    format: Literal["text", "json"]


@click.command()
@models_argument
@evidence_option(TOGETHER)
@click.option("--world", type=FILE, required=True, metavar="FILE", help="A .db file with the atoms that are true.")
@database_option
@output_option
@dialect_option
@format_option("text", "json")
def score(**options: Unpack[_Options]) -> None:
    """Score a world: its log-weight, and what it pays, formula by formula.

    The cost is the weight of all false groundings of formulas with positive weight and of all true groundings of
    formulas with negative weight; `open` is the part on groundings that the evidence does not decide. Atoms that
    neither the evidence nor the world mentions are false.
    """
    import mlnlite as ml

    with working("reading"):
        model = ml.read_model(*options["models"], dialect=options["dialect"])
        evidence = evidence_of_one_world(model, options["evidence"], options["database"])
        known = ml.Model(evidence.types, model.predicates, (), model.dialect)
        world = ml.read_evidence(options["world"], model=known)
    with working("scoring"):
        found = ml.score(model, evidence, world)
    emit(found.to_json() if options["format"] == "json" else str(found), options["output"])
