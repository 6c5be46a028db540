"""`mlnlite learn`: databases to weights."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

import click

from mlnlite import __version__
from mlnlite.cli.files import write_whole
from mlnlite.cli.options import FILE, dialect_option, format_option, names, output_option, time_limit_option
from mlnlite.cli.terminal import working
from mlnlite.errors import MlnError

if TYPE_CHECKING:
    from mlnlite.learn.learned import LearnedModel
    from mlnlite.syntax.tree import Dialect

DEFAULT_SD = 5.0


class _Options(TypedDict):
    files: tuple[Path, ...]
    model: tuple[Path, ...]
    database: tuple[Path, ...]
    output: Path | None
    prior_sd: float | None
    prior: str
    predict: tuple[str, ...]
    time_limit: float | None
    dialect: Dialect | None
    format: str


@dataclass(frozen=True, slots=True)
class _Inputs:
    models: tuple[Path, ...]
    databases: tuple[Path, ...]


@click.command()
@click.argument("files", type=FILE, nargs=-1, metavar="MODEL... DATABASE...")
@click.option("-m", "--model", type=FILE, multiple=True, metavar="FILE", help="A model file, whatever its name.")
@click.option("-d", "--database", type=FILE, multiple=True, metavar="FILE", help="A database file, whatever its name.")
@output_option
@click.option(
    "--prior-sd",
    type=click.FloatRange(min=0, min_open=True),
    metavar="S",
    help=f"Standard deviation of the Gaussian prior (mean 0) of each weight. By default {DEFAULT_SD:g}.",
)
@click.option(
    "--prior",
    type=click.Choice(["gaussian", "none"]),
    default="gaussian",
    help="`none`: weights that the data push to infinity are reported, and clipped.",
)
@click.option(
    "--predict",
    multiple=True,
    metavar="NAMES",
    help="Predicates to predict from the others (conditional pseudo-likelihood). By default all.",
)
@time_limit_option("Stop after this long, with the best weights so far.")
@dialect_option
@format_option("text", "json")
def learn(**options: Unpack[_Options]) -> None:
    """Learn the weights of a model from databases, by pseudo-likelihood.

    Files that end in .mln are models, the others databases; -m and -d say so for files with other names. A database is
    complete: what is not a fact is false. Databases between `---` and in several files are worlds of their own.

    The model is written to -o, and a summary to standard output; without -o the model is written to standard output
    and the summary to standard error.
    """
    inputs = _inputs(options)
    learned = _learned(inputs, options)
    text = _header(learned, inputs) + learned_text(learned)
    output = options["output"]
    if output is not None:
        write_whole(output, text)
    if options["format"] == "json":
        where = {"model": text} if output is None else {"output": str(output)}
        click.echo(json.dumps({**learned.to_dict(), **where}, indent=2))
        return
    click.echo(str(learned), err=output is None)
    click.echo(text if output is None else f"{'written to':<36}{output}", nl=output is not None)


def _inputs(options: _Options) -> _Inputs:
    """Which files are models and which are databases."""
    files = options["files"]
    models = tuple(f for f in files if f.suffix == ".mln") + options["model"]
    databases = tuple(f for f in files if f.suffix != ".mln") + options["database"]
    if not models:
        raise MlnError("no file is a model", "a model ends in .mln; say `-m FILE` for one that does not")
    if not databases:
        raise MlnError("there is no database to learn from", "name one after the model; `-d FILE` if it ends in .mln")
    return _Inputs(models, databases)


def _learned(inputs: _Inputs, options: _Options) -> LearnedModel:
    import mlnlite as ml

    with working("reading"):
        model = ml.read_model(*inputs.models, dialect=options["dialect"])
        databases = ml.read_evidence(*inputs.databases, model=model)
    predict = names(options["predict"]) or None
    with working("learning"):
        return ml.learn(model, databases, prior=_prior_sd(options), predict=predict, time_limit=options["time_limit"])


def _prior_sd(options: _Options) -> float | None:
    if options["prior"] == "none":
        if options["prior_sd"] is not None:
            raise click.UsageError("--prior none and --prior-sd exclude each other")
        return None
    return options["prior_sd"] or DEFAULT_SD


def learned_text(learned: LearnedModel) -> str:
    """The text of a learnt model, ending in a new line."""
    import mlnlite as ml

    with working("writing"):
        return ml.model_text(learned.model).rstrip("\n") + "\n"


def _header(learned: LearnedModel, inputs: _Inputs) -> str:
    """How the weights came about, as comments."""
    from mlnlite.learn.prior import prior_text

    lines = [
        f"learnt by mlnlite {__version__}",
        f"{learned.objective} {learned.value:.6f}",
        f"prior: {prior_text(learned.prior)}",
        f"stopped: {learned.status} after {learned.iterations} steps",
        *(f"model: {_named(path)}" for path in inputs.models),
        *(f"data: {_named(path)}" for path in inputs.databases),
    ]
    return "".join(f"// {line}\n" for line in lines) + "\n"


def _named(path: Path) -> str:
    """Name and content of an input file: its SHA-256."""
    return f"{path.name} sha256:{hashlib.sha256(path.read_bytes()).hexdigest()}"
