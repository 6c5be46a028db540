"""`mlnlite query`: model, evidence and a question to an answer."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack, cast

import click

from mlnlite.cli.files import emit
from mlnlite.cli.options import (
    TOGETHER,
    closed_world_option,
    database_option,
    dialect_option,
    evidence_option,
    format_option,
    limit_options,
    models_argument,
    names,
    open_world_option,
    output_option,
    time_limit_option,
)
from mlnlite.cli.terminal import working
from mlnlite.cli.worlds import closed_world, evidence_of_one_world, opened
from mlnlite.errors import QueryMistake

if TYPE_CHECKING:
    from mlnlite.ground.forecast import Limits
    from mlnlite.infer.approach import MarginalMethod
    from mlnlite.infer.map.rungs import Method as MapMethod
    from mlnlite.model.evidence import Evidence
    from mlnlite.model.model import Model
    from mlnlite.results import MapState, Marginals
    from mlnlite.syntax.tree import Dialect


_METHODS = {
    "auto": ("marginal", "map"),
    "exact": ("marginal",),
    "lifted": ("marginal",),
    "gibbs": ("marginal",),
    "mcsat": ("marginal",),
    "tempering": ("marginal",),
    "wmc": ("marginal",),
    "bp": ("marginal",),
    "ve": ("map",),
    "wcsp": ("map",),
    "mincut": ("map",),
    "ilp": ("map",),
    "maxsat": ("map",),
    "annealing": ("map",),
    "maxwalksat": ("map",),
}


class _Options(TypedDict):
    models: tuple[Path, ...]
    evidence: tuple[Path, ...]
    query: tuple[str, ...]
    task: Literal["marginal", "map"]
    closed_world: tuple[str, ...]
    open_world: tuple[str, ...]
    method: str
    database: int | None
    output: Path | None
    time_limit: float | None
    seed: int
    precision: float
    chains: int
    gap: float
    margins: bool
    joint: bool
    k: int
    diverse: float | None
    why: bool
    explain: str | None
    width_limit: int | None
    max_groundings: int | None
    max_memory: int | None
    dialect: Dialect | None
    format: Literal["text", "json", "csv"]


@click.command()
@models_argument
@evidence_option(TOGETHER)
@click.option(
    "-q",
    "--query",
    multiple=True,
    metavar="QUERY",
    help="Predicates, ground atoms or formulas, comma separated. `--task map` without it shows all unknown atoms.",
)
@click.option("--joint", is_flag=True, help="A joint table of what is asked, at most 8 atoms or formulas.")
@click.option(
    "--task", type=click.Choice(["marginal", "map"]), default="marginal", show_default=True, help="What to ask."
)
@closed_world_option
@open_world_option
@click.option(
    "--method",
    type=click.Choice(list(_METHODS)),
    default="auto",
    show_default=True,
    help="For probabilities: "
    + ", ".join(f"`{m}`" for m, tasks in _METHODS.items() if "marginal" in tasks)
    + "; for the most probable world: "
    + ", ".join(f"`{m}`" for m, tasks in _METHODS.items() if "map" in tasks)
    + ".",
)
@database_option
@output_option
@time_limit_option("Stop sampling, or the search for the most probable world, after this long with what there is.")
@click.option(
    "--precision",
    type=click.FloatRange(min=0, min_open=True),
    default=0.005,
    show_default=True,
    help="Largest standard error of probabilities that are sampled.",
)
@click.option("--chains", type=click.IntRange(min=2), default=4, show_default=True, help="How many are sampled.")
@click.option(
    "--gap",
    type=click.FloatRange(min=0),
    default=0.0,
    show_default=True,
    help="Of the most probable world: what share of its cost it may be away from the best.",
)
@click.option("--k", type=click.IntRange(min=1), default=1, show_default=True, help="How many most probable worlds.")
@click.option(
    "--diverse",
    type=click.FloatRange(min=0),
    metavar="PENALTY",
    help="With --k: good worlds that differ; each loses so much log-weight for every value as in one before.",
)
@click.option("--why", is_flag=True, help="List the groundings that the most probable world pays for.")
@click.option("--explain", metavar="ATOM", help="Show the best world in which this atom is the other way round.")
@click.option("--margins", is_flag=True, help="For each atom of that world, what the opposite would lose.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Where chance starts.")
@click.option(
    "--width-limit",
    type=click.IntRange(min=2),
    metavar="ENTRIES",
    help="Largest number of entries of a table in exact marginals, 2^25 by default, 8 bytes each.",
)
@limit_options
@dialect_option
@format_option("text", "json", "csv")
def query(**options: Unpack[_Options]) -> None:
    """Ask a model: probabilities, or the most probable world.

    An atom that is not a fact is unknown, unless its predicate's world is closed: by `*` in the model, or here.
    Several evidence files describe one world together; of a file with several databases choose one by --database.
    With --max-groundings or --max-memory a formula that would take more is named, with what would help; the exit code
    is then 1.
    """
    import mlnlite as ml
    from mlnlite.syntax.queries import split_queries

    items = [item for text in options["query"] for item in split_queries(text)]
    _verify(options, items)
    with working("reading"):
        model = opened(ml.read_model(*options["models"], dialect=options["dialect"]), names(options["open_world"]))
        evidence = evidence_of_one_world(model, options["evidence"], options["database"])
    whole = options["output"] is not None
    if options["k"] > 1:
        with working("inferring"):
            states = _states(model, evidence, items, options)
        emit(_several(states, options["format"], whole=whole), options["output"])
        return
    with working("inferring"):
        answer = _answer(model, evidence, items, options)
    emit(_formatted(answer, options["format"], whole=whole), options["output"])


def _answer(model: Model, evidence: Evidence, items: list[str], options: _Options) -> Marginals | MapState:
    import mlnlite as ml
    from mlnlite.infer.exact.marginal import WIDTH_LIMIT

    closed = closed_world(model, items, names(options["closed_world"]), names(options["open_world"]))
    if options["task"] == "map":
        return ml.map_state(
            model,
            evidence,
            items or None,
            closed_world=closed,
            method=cast("MapMethod", options["method"]),
            time_limit=options["time_limit"],
            seed=options["seed"],
            gap=options["gap"],
            margins=options["margins"],
            why=options["why"],
            explain=options["explain"],
            limits=_limits(options),
        )
    ask = ml.joint if options["joint"] else ml.marginal
    return ask(
        model,
        evidence,
        items,
        closed_world=closed,
        method=cast("MarginalMethod", options["method"]),
        width_limit=options["width_limit"] or WIDTH_LIMIT,
        precision=options["precision"],
        time_limit=options["time_limit"],
        chains=options["chains"],
        seed=options["seed"],
        limits=_limits(options),
    )


def _states(model: Model, evidence: Evidence, items: list[str], options: _Options) -> tuple[MapState, ...]:
    import mlnlite as ml

    return ml.map_states(
        model,
        evidence,
        items or None,
        k=options["k"],
        diverse=options["diverse"],
        closed_world=closed_world(model, items, names(options["closed_world"]), names(options["open_world"])),
        time_limit=options["time_limit"],
        seed=options["seed"],
        limits=_limits(options),
    )


def _limits(options: _Options) -> Limits:
    import mlnlite as ml

    return ml.Limits(options["max_groundings"], options["max_memory"])


def _several(states: tuple[MapState, ...], format_name: str, *, whole: bool) -> str:
    """Several worlds as text, one after the other, or as a list in JSON."""
    if format_name == "json":
        return json.dumps([state.to_dict() for state in states], indent=2)
    return "\n\n".join(_formatted(state, format_name, whole=whole) for state in states)


def _verify(options: _Options, items: list[str]) -> None:
    """Complains about options that do not fit the task."""
    tasks = _METHODS[options["method"]]
    if options["task"] not in tasks:
        raise click.UsageError(f"--method {options['method']} is for --task {tasks[0]}")
    if options["task"] == "map" and options["joint"]:
        raise click.UsageError("--joint is for --task marginal")
    if options["task"] == "map" and options["width_limit"] is not None:
        raise click.UsageError("--width-limit is for --task marginal; --task map takes --time-limit")
    for name, default in (("precision", 0.005), ("chains", 4)):
        if options["task"] == "map" and options[name] != default:  # type: ignore[literal-required]
            raise click.UsageError(f"--{name} is for --task marginal")
    _verify_worlds(options)
    if options["task"] == "marginal" and not items:
        raise QueryMistake("nothing is asked", "name predicates, atoms or formulas: `-q Smokes,Cancer(Ann)`")


def _verify_worlds(options: _Options) -> None:
    """Complains about options of most probable worlds that do not fit each other."""
    of_map = ("k", "diverse", "why", "explain", "margins", "gap")
    for name in of_map if options["task"] == "marginal" else ():
        if options[name] not in (None, False, 0.0) and (name, options[name]) != ("k", 1):  # type: ignore[literal-required]
            raise click.UsageError(f"--{name} is for --task map")
    if options["diverse"] is not None and options["k"] == 1:
        raise click.UsageError("--diverse needs --k: how many worlds that differ")
    if options["k"] > 1 and (options["margins"] or options["why"] or options["explain"] or options["method"] != "auto"):
        raise click.UsageError("--k goes without --margins, --why, --explain and --method")
    if options["k"] > 1 and options["format"] == "csv":
        raise click.UsageError("--k writes text or JSON")


def _formatted(answer: Marginals | MapState, format_name: str, *, whole: bool) -> str:
    """The answer as text; `whole`: with all its rows."""
    if format_name == "json":
        return answer.to_json()
    if format_name == "csv":
        return _csv(answer).rstrip("\n")
    return answer.to_text(None) if whole else str(answer)


def _csv(answer: Marginals | MapState) -> str:
    """One row for each atom or formula."""
    from mlnlite.results import Marginals

    rows: list[tuple[object, ...]]
    if isinstance(answer, Marginals):
        columns = answer.columns()
        rows = [tuple(columns), *zip(*columns.values(), strict=True)]
    else:
        rows = [("name", "truth", "method"), *zip(answer.names, answer.truth.tolist(), answer.methods, strict=True)]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
