"""`mlnlite learn`: databases to weights."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

import click

from mlnlite.cli.files import write_whole
from mlnlite.cli.header import header
from mlnlite.cli.learning import learning_options, prior_of, read, split_files
from mlnlite.cli.options import (
    FILE,
    dialect_option,
    format_option,
    names,
    output_option,
    time_limit_option,
    writable,
)
from mlnlite.cli.terminal import working

if TYPE_CHECKING:
    from mlnlite.learn.learned import How, LearnedModel, Objective
    from mlnlite.learn.trust.report import Report
    from mlnlite.model.evidence import Evidence
    from mlnlite.model.model import Model
    from mlnlite.syntax.tree import Dialect


class _Options(TypedDict):
    files: tuple[Path, ...]
    model: tuple[Path, ...]
    database: tuple[Path, ...]
    output: Path | None
    objective: Objective | None
    open_predicates: tuple[str, ...]
    prior_sd: float | None
    prior: str
    prior_of: tuple[str, ...]
    predict: tuple[str, ...]
    tie: tuple[str, ...]
    times: tuple[str, ...]
    shared_constants: bool
    resume: bool
    held_out: Path | None
    laplace_path: Path | None
    structure: bool
    given: tuple[str, ...]
    report: Literal["sandwich", "information", "bootstrap"] | None
    seed: int
    time_limit: float | None
    dialect: Dialect | None
    format: str


@dataclass(frozen=True, slots=True)
class _Inputs:
    models: tuple[Path, ...]
    databases: tuple[Path, ...]


@dataclass(frozen=True, slots=True)
class _Data:
    """What weights are learnt from, and what else is asked about; `unseen` are held-out databases."""

    model: Model
    databases: Evidence
    unseen: Evidence | None


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
    "--tie", multiple=True, metavar="FORMULAS", help="Formulas that have the same weight: `formula 1; formula 3`."
)
@click.option("--times", multiple=True, metavar="FILE=N", help="The databases of a file count N times.")
@click.option("--shared-constants", is_flag=True, help="Each database has the constants of all.")
@click.option("--resume", is_flag=True, help="Start with the weights that the model has, such as a learnt one.")
@click.option("--held-out", type=FILE, metavar="FILE", help="Also say how probable these databases are.")
@click.option(
    "--laplace-path",
    type=FILE,
    callback=writable,
    metavar="FILE",
    help="Also write a table (CSV) of the weights under Laplace priors of all scales.",
)
@click.option(
    "--structure",
    is_flag=True,
    help="First add rules that the data show about what `--predict` names; there, `way(+, #)` is one rule for each "
    "constant.",
)
@click.option(
    "--given",
    multiple=True,
    metavar="MODES",
    help="What these rules may ask about: predicates, or modes: `Smokes, Friends(+, -), level(+, #)`, with `+` known "
    "before, `-` known or new, `#` a constant. By default all others.",
)
@click.option(
    "--report",
    type=click.Choice(["sandwich", "information", "bootstrap"]),
    help="Also say how sure each weight is, from clusters of the data, the curvature, or simulated data; and which "
    "weights not to trust.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of all that is drawn.")
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
    learned, data = _learned(inputs, options)
    text = header(learned, inputs.models, inputs.databases, options["seed"]) + learned_text(learned)
    output = options["output"]
    if output is not None:
        write_whole(output, text)
    if options["laplace_path"] is not None:
        _write_path(learned, options["laplace_path"])
    unseen = None if data.unseen is None else _held_out(learned, data.unseen)
    report = None if options["report"] is None else _report(learned, data.databases, options)
    if options["format"] == "json":
        where = {"model": text} if output is None else {"output": str(output)}
        more: dict[str, object] = {} if report is None else {"report": report.to_dict()}
        more |= {} if unseen is None else {"held_out": unseen[1]}
        click.echo(json.dumps({**learned.to_dict(), **more, **where}, indent=2))
        return
    summary = str(learned) if report is None else f"{learned}\n\n{report}\n"
    summary += "" if unseen is None else f"\n{f'held-out {unseen[0]}':<36}{unseen[1]:.6f} per atom or block"
    click.echo(summary, err=output is None)
    click.echo(text if output is None else f"{'written to':<36}{output}", nl=output is not None)


def _learned(inputs: _Inputs, options: _Options) -> tuple[LearnedModel, _Data]:
    """What was learnt, and from what; all that is asked is verified first."""
    import mlnlite as ml

    data = _read(inputs, options)
    prior = prior_of(options["prior"], options["prior_sd"], options["prior_of"])
    worth = _database_weights(data.databases, options["times"])
    how = _how(data, options, worth)
    if options["structure"]:
        data = replace(data, model=_with_rules(data.model, data.databases, options))
        data = replace(data, unseen=_unseen(data.model, data.databases, options))
        how = _how(data, options, worth)
    _verify(data, how, options)
    with working("learning"):
        learned = ml.learn(
            data.model,
            data.databases,
            objective=how.objective,
            predict=how.predict,
            open_predicates=how.open_predicates,
            prior=prior,
            tied=how.tied,
            database_weights=how.database_weights,
            resume=options["resume"],
            seed=options["seed"],
            time_limit=options["time_limit"],
        )
    return learned, data


def _read(inputs: _Inputs, options: _Options) -> _Data:
    """The files."""
    import mlnlite as ml

    if options["given"] and not options["structure"]:
        raise click.UsageError("--given says what rules may ask about; add --structure to look for some")
    if options["structure"] and not options["predict"]:
        raise click.UsageError("--structure needs --predict: what the rules are to conclude")
    model, databases = read(inputs.models, inputs.databases, options["dialect"])
    if options["shared_constants"]:
        databases = ml.with_shared_constants(databases)
    return _Data(model, databases, _unseen(model, databases, options))


def _unseen(model: Model, databases: Evidence, options: _Options) -> Evidence | None:
    """The held-out databases."""
    import mlnlite as ml
    from mlnlite.learn.weights import with_constants

    file = options["held_out"]
    return None if file is None else ml.read_evidence(file, model=with_constants(model, databases))


def _how(data: _Data, options: _Options, worth: list[float] | None) -> How:
    """What is to be learnt."""
    from mlnlite.learn.weights import how_of

    predict = names(options["predict"])
    targets = (_predicates(predict) if options["structure"] else predict) or None
    tied = [[name.strip() for name in group.split(";")] for group in options["tie"]]
    opened = names(options["open_predicates"])
    return how_of(data.model, data.databases, options["objective"], (targets, opened), tied, worth)


def _verify(data: _Data, how: How, options: _Options) -> None:
    """Complains of what is asked of the weights and cannot be had, before a long wait for them."""
    method, path = options["report"], options["laplace_path"] is not None
    if method is None and not path and data.unseen is None:
        return
    from mlnlite.learn.trust.verify import verify  # late: most learning needs no tests of weights

    with working("verifying"):
        verify(data.model, data.databases, how, method=method, path=path, held_out=data.unseen)


def _report(learned: LearnedModel, databases: Evidence, options: _Options) -> Report:
    """How sure the weights are."""
    from mlnlite.learn.trust.report import report

    assert options["report"] is not None
    with working("measuring"):
        return report(learned, databases, method=options["report"], seed=options["seed"])


def _held_out(learned: LearnedModel, databases: Evidence) -> tuple[str, float]:
    """How probable other databases are, and by which measure."""
    import mlnlite as ml
    from mlnlite.learn.trust.effects import has_unknown

    unknown = has_unknown(learned.model, databases, learned.how)
    measure = "log-likelihood" if unknown else "pseudo-log-likelihood"
    return measure, ml.held_out(learned, databases)


def _database_weights(databases: Evidence, times: tuple[str, ...]) -> list[float] | None:
    """How often each database counts; a database is named `file#3`."""
    if not times:
        return None
    found = dict.fromkeys((name.rpartition("#")[0] for name in databases.names), 1.0)
    for one in times:
        file, _, number = one.rpartition("=")
        match = [name for name in found if file in (name, Path(name).name)]
        often = _number(number)
        if not match or not 0 < often < float("inf"):
            message = f"--times takes FILE=N with one of the database files and a positive number, found {one}"
            raise click.UsageError(message)
        found |= dict.fromkeys(match, often)
    return [found[name.rpartition("#")[0]] for name in databases.names]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def _write_path(learned: LearnedModel, file: Path) -> None:
    """The weights under Laplace priors of all scales, a line for each scale and weight that is not 0."""
    import mlnlite as ml

    path = ml.laplace_path(learned)
    rows = [
        f'{scale:.6g},{weight:.6f},"{formula.replace(chr(34), chr(34) * 2)}"'
        for scale, weights in zip(path.scales.tolist(), path.weights.tolist(), strict=True)
        for weight, formula in zip(weights, path.formulas, strict=True)
        if weight
    ]
    write_whole(file, "\n".join(["scale,weight,formula", *rows]) + "\n")


def _with_rules(model: Model, databases: Evidence, options: _Options) -> Model:
    """The model with the rules that were found, which are shown."""
    import mlnlite as ml

    predict = names(options["predict"])
    every = (name for name, predicate in model.predicates.items() if predicate.comparison is None)
    others = [name for name in every if name not in _predicates(predict)]
    given = names(options["given"]) or others
    with working("looking for rules"):
        found = ml.find_rules(
            model,
            databases,
            predict=predict,
            given=given,
            open_predicates=names(options["open_predicates"]),
            seed=options["seed"],
        )
    click.echo(f"{found}\n", err=True)
    return found.model


def _predicates(modes: list[str]) -> list[str]:
    """The predicates of modes, each once."""
    return list(dict.fromkeys(mode.partition("(")[0].strip() for mode in modes))


def learned_text(learned: LearnedModel) -> str:
    """The text of a learnt model, ending in a new line."""
    import mlnlite as ml

    with working("writing"):
        return ml.model_text(learned.model).rstrip("\n") + "\n"
