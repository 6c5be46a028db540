"""`mlnlite learn`: databases to weights."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

import click

from mlnlite import __version__
from mlnlite.cli.files import write_whole
from mlnlite.cli.learning import learning_options, prior_of, split_files
from mlnlite.cli.options import dialect_option, format_option, names, output_option, time_limit_option
from mlnlite.cli.terminal import working

if TYPE_CHECKING:
    from mlnlite.learn.learned import LearnedModel, Objective
    from mlnlite.learn.report import Report
    from mlnlite.model.evidence import Evidence
    from mlnlite.model.model import Model
    from mlnlite.syntax.tree import Dialect


class _Options(TypedDict):
    files: tuple[Path, ...]
    model: tuple[Path, ...]
    database: tuple[Path, ...]
    output: Path | None
    objective: Objective
    open_predicates: tuple[str, ...]
    prior_sd: float | None
    prior: str
    predict: tuple[str, ...]
    structure: bool
    report: Literal["sandwich", "information", "bootstrap"] | None
    seed: int
    time_limit: float | None
    dialect: Dialect | None
    format: str


@dataclass(frozen=True, slots=True)
class _Inputs:
    models: tuple[Path, ...]
    databases: tuple[Path, ...]


@click.command()
@learning_options
@output_option
@click.option(
    "--predict",
    multiple=True,
    metavar="NAMES",
    help="Predicates to predict from the others (conditional likelihoods). By default all.",
)
@click.option(
    "--structure",
    is_flag=True,
    help="First add rules that the data show; needs `--predict`. All other predicates are conditions.",
)
@click.option(
    "--report",
    type=click.Choice(["sandwich", "information", "bootstrap"]),
    help="Also say how sure each weight is, from clusters of the data, the curvature, or simulated data; and which "
    "weights not to trust.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the bootstrap.")
@time_limit_option("Stop after this long, with the best weights so far.")
@dialect_option
@format_option("text", "json")
def learn(**options: Unpack[_Options]) -> None:
    """Learn the weights of a model from databases, by default by pseudo-likelihood.

    Files that end in .mln are models, the others databases; -m and -d say so for files with other names. A database is
    complete: what is not a fact is false. Databases between `---` and in several files are worlds of their own.

    The model is written to -o, and a summary to standard output; without -o the model is written to standard output
    and the summary to standard error.
    """
    inputs = _Inputs(*split_files(options["files"], options["model"], options["database"]))
    learned, report = _learned(inputs, options)
    text = _header(learned, inputs, options) + learned_text(learned)
    output = options["output"]
    if output is not None:
        write_whole(output, text)
    if options["format"] == "json":
        where = {"model": text} if output is None else {"output": str(output)}
        more = {} if report is None else {"report": report.to_dict()}
        click.echo(json.dumps({**learned.to_dict(), **more, **where}, indent=2))
        return
    summary = str(learned) if report is None else f"{learned}\n\n{report}\n"
    click.echo(summary, err=output is None)
    click.echo(text if output is None else f"{'written to':<36}{output}", nl=output is not None)


def _learned(inputs: _Inputs, options: _Options) -> tuple[LearnedModel, Report | None]:
    import mlnlite as ml

    with working("reading"):
        model = ml.read_model(*inputs.models, dialect=options["dialect"])
        databases = ml.read_evidence(*inputs.databases, model=model)
    if options["structure"]:
        model = _with_rules(model, databases, names(options["predict"]), options["seed"])
    with working("learning"):
        learned = ml.learn(
            model,
            databases,
            objective=options["objective"],
            predict=names(options["predict"]) or None,
            open_predicates=names(options["open_predicates"]),
            prior=prior_of(options["prior"], options["prior_sd"]),
            time_limit=options["time_limit"],
        )
    method = options["report"]
    if method is None:
        return learned, None
    from mlnlite.learn.report import report

    with working("measuring"):
        return learned, report(learned, databases, method=method, seed=options["seed"])


def _with_rules(model: Model, databases: Evidence, predict: list[str], seed: int) -> Model:
    """The model with the rules that were found, which are shown."""
    import mlnlite as ml

    if not predict:
        raise click.UsageError("--structure needs --predict: what the rules are to conclude")
    given = [name for name in model.predicates if name not in predict]
    with working("looking for rules"):
        found = ml.find_rules(model, databases, predict=predict, given=given, seed=seed)
    click.echo(f"{found}\n", err=True)
    return found.model


def learned_text(learned: LearnedModel) -> str:
    """The text of a learnt model, ending in a new line."""
    import mlnlite as ml

    with working("writing"):
        return ml.model_text(learned.model).rstrip("\n") + "\n"


def _header(learned: LearnedModel, inputs: _Inputs, options: _Options) -> str:
    """How the weights came about, as comments: for people, then as JSON."""
    from mlnlite.learn.prior import prior_data, prior_text

    data = {
        "mlnlite": __version__,
        "objective": learned.objective,
        "value": learned.value,
        "prior": prior_data(learned.prior),
        "predict": learned.how.predict,
        "open": learned.how.open_predicates,
        "status": learned.status,
        "iterations": learned.iterations,
        "seed": options["seed"],
        "models": {path.name: _hash(path) for path in inputs.models},
        "databases": {path.name: _hash(path) for path in inputs.databases},
    }
    lines = [
        f"learnt by mlnlite {__version__}",
        f"{learned.objective} {learned.value:.6f}",
        f"prior: {prior_text(learned.prior)}",
        f"stopped: {learned.status} after {learned.iterations} steps",
        *(f"model: {path.name} sha256:{_hash(path)}" for path in inputs.models),
        *(f"data: {path.name} sha256:{_hash(path)}" for path in inputs.databases),
        f"json: {json.dumps(data)}",
    ]
    return "".join(f"// {line}\n" for line in lines) + "\n"


def _hash(path: Path) -> str:
    """Content of an input file: its SHA-256."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
