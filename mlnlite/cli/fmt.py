"""`mlnlite fmt`: one style for models and evidence."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mlnlite.cli.files import verify_writable, write_whole
from mlnlite.cli.options import FILE, dialect_option

if TYPE_CHECKING:
    from mlnlite.syntax.tree import AnyDialect


@click.command()
@click.argument("files", type=FILE, nargs=-1, required=True, metavar="FILE...")
@click.option("--check", is_flag=True, help="Write nothing; exit with 1 if a file is not in the style.")
@dialect_option
@click.pass_context
def fmt(ctx: click.Context, files: tuple[Path, ...], *, check: bool, dialect: AnyDialect | None) -> None:
    """Write models (.mln) and evidence in one style, in place; comments stay.

    A file that cannot be read is left as it is. What is written means the same: it is read again before.
    """
    changed = 0
    for path in files:
        text, new = _texts(path, dialect)
        if new == text:
            continue
        changed += 1
        if not check:
            verify_writable(path)
            write_whole(path, new)
        click.echo(f"{'would change' if check else 'changed'} {path}")
    click.echo(f"{len(files) - changed} of {len(files)} files were in the style", err=True)
    if check and changed:
        ctx.exit(1)


def _texts(path: Path, dialect: AnyDialect | None) -> tuple[str, str]:
    """The text of a file, and in the style."""
    from mlnlite.errors import MlnError
    from mlnlite.source import Source
    from mlnlite.syntax.evidence import parse_evidence
    from mlnlite.syntax.files import read_source
    from mlnlite.syntax.layout import formatted
    from mlnlite.syntax.parse import parse_model

    source = read_source(path)
    new = formatted(source.text)
    again = Source(source.name, new)
    if path.suffix == ".db":
        same = parse_evidence(source) == parse_evidence(again)
    else:
        same = parse_model([source], dialect) == parse_model([again], dialect)
    if not same:
        raise MlnError(
            f"{path} would mean something else in the style; it was left as it is", "please report this file"
        )
    with path.open(encoding="utf-8-sig", newline="") as file:
        return file.read(), new
