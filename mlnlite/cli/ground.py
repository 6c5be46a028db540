"""`mlnlite ground`: model and evidence to a network, or to what it would take."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

import click

from mlnlite.cli.files import emit, verify_writable
from mlnlite.cli.options import (
    FILE,
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
)
from mlnlite.cli.terminal import working
from mlnlite.cli.worlds import closed_world, evidence_of_one_world, opened

if TYPE_CHECKING:
    from mlnlite.ground.forecast import Forecast
    from mlnlite.ground.network import Network
    from mlnlite.syntax.tree import Dialect


class _Options(TypedDict):
    models: tuple[Path, ...]
    evidence: tuple[Path, ...]
    closed_world: tuple[str, ...]
    open_world: tuple[str, ...]
    database: int | None
    forecast: bool
    max_groundings: int | None
    max_memory: int | None
    export: tuple[Path, ...]
    engine: str | None
    output: Path | None
    dialect: Dialect | None
    format: Literal["text", "json"]


def _all_writable(_: click.Context, __: click.Parameter, value: tuple[Path, ...]) -> tuple[Path, ...]:
    for path in value:
        verify_writable(path)
    return value


@click.command()
@models_argument
@evidence_option(TOGETHER)
@closed_world_option
@open_world_option
@database_option
@click.option("--forecast", is_flag=True, help="Only say what each formula would take.")
@limit_options
@click.option(
    "--export",
    type=FILE,
    multiple=True,
    metavar="FILE",
    callback=_all_writable,
    help="Write the network; the ending says how: .txt, .wcnf, .uai, .cfn, .dot, .graphml, .parquet. Repeatable.",
)
@click.option("--engine", type=click.Choice(["numpy", "duckdb"]), help="What runs the joins; by default by size.")
@output_option
@dialect_option
@format_option("text", "json")
def ground(**options: Unpack[_Options]) -> None:
    """Ground a model: what evidence leaves open, formula by formula.

    With --max-groundings or --max-memory a formula that would take more is named, with what would help, before any
    work is done; the exit code is then 1.
    """
    import mlnlite as ml
    from mlnlite.engines.choose import engine_named
    from mlnlite.ground.forecast import Limits
    from mlnlite.ground.ground import forecasts

    with working("reading"):
        model = opened(ml.read_model(*options["models"], dialect=options["dialect"]), names(options["open_world"]))
        evidence = evidence_of_one_world(model, options["evidence"], options["database"])
        closed = closed_world(model, [], names(options["closed_world"]), names(options["open_world"]))
        evidence = ml.closed(evidence, closed if not isinstance(closed, str) else list(model.predicates))
    if options["forecast"]:
        found = forecasts(model, evidence)
        emit(_forecast_json(found) if options["format"] == "json" else _forecast_text(found), options["output"])
        return
    engine = engine_named(options["engine"]) if options["engine"] else None
    with working("grounding"):
        limits = Limits(options["max_groundings"], options["max_memory"])
        network = ml.ground(model, evidence, engine=engine, limits=limits)
    if options["export"]:
        from mlnlite.ground.export.write import export  # late: most calls do without

        for path in options["export"]:
            export(network, path)
    emit(_json(network) if options["format"] == "json" else _text(network), options["output"])


def _forecast_text(found: list[Forecast]) -> str:
    lines = [f"{'open groundings':>16}  {'widest join':>14}  {'memory':>10}  {'time':>8}  formula"]
    for f in found:
        memory, time = f"{f.memory / 1e6:,.1f} MB", f"{f.seconds:.2f} s"
        lines.append(f"{f.rows:>16,.0f}  {f.widest:>14,.0f}  {memory:>10}  {time:>8}  {f.template.text}")
    total = sum(f.rows for f in found)
    lines.append(f"{total:>16,.0f}  open groundings in all, by estimate")
    return "\n".join(lines)


def _forecast_json(found: list[Forecast]) -> str:
    rows = [
        {"formula": f.template.text, "rows": f.rows, "widest": f.widest, "memory": f.memory, "seconds": f.seconds}
        for f in found
    ]
    return json.dumps({"forecast": rows}, indent=2)


def _per_template(network: Network) -> list[dict[str, object]]:
    import numpy as np

    n = len(network.model.templates)
    columns = {
        "groundings": network.n_groundings,
        "true": network.decided_true,
        "open": network.n_open,
    }
    sums = {k: np.bincount(network.template, v, n).astype(int).tolist() for k, v in columns.items()}
    return [
        {"formula": t.text, **{name: sums[name][i] for name in columns}} for i, t in enumerate(network.model.templates)
    ]


def _sizes(network: Network) -> dict[str, int]:
    from mlnlite.infer.reduce.components import components_of

    return {
        "n_atoms": network.n_atoms,
        "n_variables": network.n_variables,
        "n_factors": network.n_factors,
        "n_components": int(components_of(network).max(initial=-1)) + 1,
    }


def _text(network: Network) -> str:
    lines = [f"{'groundings':>14}  {'true':>14}  {'open':>14}  formula"]
    lines += [
        f"{row['groundings']:>14,}  {row['true']:>14,}  {row['open']:>14,}  {row['formula']}"
        for row in _per_template(network)
    ]
    sizes = _sizes(network)
    lines.append("")
    lines.append(f"unknown atoms {sizes['n_atoms']:,}, variables {sizes['n_variables']:,}")
    lines.append(f"factors       {sizes['n_factors']:,} (equal groundings merged)")
    lines.append(f"components    {sizes['n_components']:,}")
    return "\n".join(lines)


def _json(network: Network) -> str:
    return json.dumps({**_sizes(network), "formulas": _per_template(network)}, indent=2)
