"""`mlnlite convert`: a model of any dialect in one of ours, with a list of what changes and where."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from mlnlite.cli.files import emit
from mlnlite.cli.options import FILE, dialect_option, output_option

if TYPE_CHECKING:
    from mlnlite.syntax.tree import AnyDialect


@click.command()
@click.argument("models", type=FILE, nargs=-1, required=True, metavar="MODEL...")
@click.option(
    "--to", type=click.Choice(["standard", "prac"]), default="standard", show_default=True, help="Dialect to write."
)
@dialect_option
@output_option
def convert(
    models: tuple[Path, ...], to: Literal["standard", "prac"], dialect: AnyDialect | None, output: Path | None
) -> None:
    """Rewrite a model in one of our dialects; what changes is listed on standard error.

    Included files become part of the text. Functions, arithmetic in arguments, `*P(x)`, `p|q(x)`, rules and macros are
    written out as what they mean.
    """
    from dataclasses import replace

    from mlnlite.model.check import check
    from mlnlite.syntax.convert import losses, rewritten
    from mlnlite.syntax.files import read_source
    from mlnlite.syntax.parse import parse_model
    from mlnlite.syntax.write import write_model

    sources = [read_source(path) for path in models]
    program = parse_model(sources, dialect)
    check(program)
    for line in losses(program, sources):
        click.echo(line, err=True)
    emit(write_model(replace(rewritten(program), dialect=to)).rstrip("\n"), output)
