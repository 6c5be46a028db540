"""`mlnlite crossvalidate`: how well a model predicts databases that it was not learnt from."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

import click

from mlnlite.cli.files import emit
from mlnlite.cli.learning import learning_options, prior_of, read, split_files
from mlnlite.cli.options import dialect_option, format_option, names, output_option
from mlnlite.cli.terminal import working

if TYPE_CHECKING:
    from mlnlite.learn.evaluation.folds import By
    from mlnlite.learn.learned import Objective
    from mlnlite.syntax.tree import Dialect


class _Options(TypedDict):
    files: tuple[Path, ...]
    model: tuple[Path, ...]
    database: tuple[Path, ...]
    objective: Objective | None
    open_predicates: tuple[str, ...]
    prior_sd: float | None
    prior: str
    prior_of: tuple[str, ...]
    query: tuple[str, ...]
    given: tuple[str, ...]
    by: Literal["database", "cluster"]
    hold_out: tuple[str, ...]
    hold_out_constants: tuple[str, ...]
    folds: int
    repeats: int
    seed: int
    output: Path | None
    dialect: Dialect | None
    format: str


@click.command()
@learning_options
@click.option("-q", "--query", multiple=True, required=True, metavar="NAMES", help="Predicates that are predicted.")
@click.option(
    "--given", multiple=True, metavar="NAMES", help="Predicates that may be looked at. By default all others."
)
@click.option(
    "--by",
    type=click.Choice(["database", "cluster"]),
    default="database",
    show_default=True,
    help="What is kept in one fold: each database for itself, or databases with equal facts together.",
)
@click.option(
    "--hold-out", multiple=True, metavar="NAMES", help="Keep databases together that agree in the facts about these."
)
@click.option(
    "--hold-out-constants",
    multiple=True,
    metavar="TYPES",
    help="Keep databases together that share a constant of these types.",
)
@click.option("--folds", type=click.IntRange(min=2), default=10, show_default=True, help="How many folds.")
@click.option(
    "--repeats", type=click.IntRange(min=1), default=1, show_default=True, help="How often, with other folds."
)
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the folds and of the bootstrap."
)
@output_option
@dialect_option
@format_option("text", "json")
def crossvalidate(**options: Unpack[_Options]) -> None:
    """Learn from some databases, predict the others, and compare with baselines that know no logic.

    Each database is an instance. The baselines see the facts about the same conditions as categorical features: the
    most frequent label, a look-up table, naive Bayes, and logistic regression on pairs of features. Intervals and
    differences are of a bootstrap over what is kept together.
    """
    import mlnlite as ml

    models, files = split_files(options["files"], options["model"], options["database"])
    key, types = names(options["hold_out"]), names(options["hold_out_constants"])
    if key and types:
        raise click.UsageError("--hold-out and --hold-out-constants exclude each other")
    by: By = "key" if key else "constant" if types else options["by"]
    split = ml.Split(by, tuple(key or types), options["folds"], options["repeats"], options["seed"])
    prior = prior_of(options["prior"], options["prior_sd"], options["prior_of"])
    training = ml.Training(options["objective"], tuple(names(options["open_predicates"])), prior)
    model, databases = read(models, files, options["dialect"])
    with working("learning and predicting"):
        found = ml.crossvalidate(
            model,
            databases,
            predict=names(options["query"]),
            given=names(options["given"]) or None,
            split=split,
            training=training,
        )
    emit(found.to_json() if options["format"] == "json" else str(found), options["output"])
