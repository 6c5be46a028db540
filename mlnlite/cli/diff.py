"""`mlnlite diff`: two models, formulas matched, weights side by side."""

from __future__ import annotations

import json
from pathlib import Path

import click

from mlnlite.cli.options import FILE, dialect_option, format_option
from mlnlite.cli.terminal import table


@click.command()
@click.argument("left", type=FILE)
@click.argument("right", type=FILE)
@click.option("--tolerance", type=click.FloatRange(min=0), default=0.0, help="Weights this close count as equal.")
@dialect_option
@format_option("text", "json")
@click.pass_context
def diff(ctx: click.Context, left: Path, right: Path, *, tolerance: float, dialect: str | None, format: str) -> None:
    """Compare two models: declarations, formulas, weights. Exits with 1 if they differ.

    Formulas are matched by what they say: names of variables, order in the file and blanks do not count.
    """
    import mlnlite as ml
    from mlnlite.model.compare import declarations, differences

    models = [ml.read_model(path, dialect=dialect) for path in (left, right)]  # type: ignore[arg-type]
    declared = list(declarations(*models))
    found = differences(*models, tolerance=tolerance)
    if format == "json":
        rows = [{"formula": d.text, "left": d.left, "right": d.right} for d in found]
        click.echo(json.dumps({"declarations": declared, "formulas": rows}, indent=2))
    else:
        lines = [["", str(left), str(right)]] if found else []
        lines += [[d.text, _weight(d.left), _weight(d.right)] for d in found]
        click.echo("\n".join([*declared, *([table(lines, "<>>")] if lines else [])]) or "the models are the same")
    if declared or found:
        ctx.exit(1)


def _weight(weight: float | None) -> str:
    if weight is None:
        return "-"
    return "no weight" if weight != weight else "hard" if weight == float("inf") else f"{weight:g}"
