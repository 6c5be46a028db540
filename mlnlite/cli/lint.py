"""`mlnlite lint`: what is allowed and probably not meant."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mlnlite.cli.options import FILE, dialect_option, format_option
from mlnlite.errors import Contradiction, Diagnostic, LimitReached

if TYPE_CHECKING:
    from mlnlite.model.evidence import Evidence
    from mlnlite.model.model import Model
    from mlnlite.syntax.tree import AnyDialect

HUGE = 1e7


@click.command()
@click.argument("models", type=FILE, nargs=-1, required=True, metavar="MODEL...")
@click.option(
    "-e", "--evidence", type=FILE, multiple=True, metavar="FILE", help="Facts of one world, for more warnings."
)
@dialect_option
@format_option("text", "json")
@click.pass_context
def lint(
    ctx: click.Context,
    models: tuple[Path, ...],
    evidence: tuple[Path, ...],
    *,
    dialect: AnyDialect | None,
    format: str,
) -> None:
    """Warn of what is allowed and probably not meant. Exits with 1 if there is a warning.

    Spellings, variables that stand once, formulas that are always true, duplicates, hard formulas that contradict each
    other or the evidence, groundings that are huge.
    """
    import mlnlite as ml
    from mlnlite.model.check import check
    from mlnlite.model.lint import lint as warnings_of
    from mlnlite.syntax.files import read_source
    from mlnlite.syntax.parse import parse_model

    program = parse_model([read_source(path) for path in models], dialect)
    model = check(program)
    known = ml.read_evidence(*evidence, model=model, together=True) if evidence else ml.no_evidence(model)
    found = [*warnings_of(model, program), *known.warnings, *_contradictions(model, known), *_huge(model, known)]
    if format == "json":
        click.echo(json.dumps([d.to_dict() for d in found], indent=2))
    else:
        click.echo("\n\n".join(map(str, found)) or "nothing to warn of")
    if found:
        ctx.exit(1)


def _contradictions(model: Model, evidence: Evidence) -> Iterator[Diagnostic]:
    """The smallest set of hard formulas that no world satisfies, if there is one."""
    import mlnlite as ml

    hard = replace(model, templates=tuple(t for t in model.templates if t.hard))
    if not hard.templates:
        return
    try:
        ml.map_state(hard, evidence, time_limit=10.0)
    except Contradiction as error:
        for d in error.diagnostics:
            yield replace(d, code="W212", severity="warning")
    except LimitReached:
        return


def _huge(model: Model, evidence: Evidence) -> Iterator[Diagnostic]:
    """Formulas whose grounding is huge, and why."""
    import numpy as np

    from mlnlite.ground.ground import forecasts

    weighted = tuple(replace(t, weights=np.nan_to_num(t.weights, posinf=np.inf)) for t in model.templates)
    try:
        found = forecasts(replace(model, templates=weighted), evidence)
    except (Contradiction, LimitReached):
        return
    for forecast in found:
        if forecast.rows > HUGE:
            message = (
                f"{forecast.template.name} has about {forecast.rows:.1g} open groundings: {forecast.template.text}"
            )
            hint = "close predicates that the evidence knows (`*`), or give its variables narrower types"
            yield Diagnostic("W213", message, forecast.template.span, hint, "warning")
