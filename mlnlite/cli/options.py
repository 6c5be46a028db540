"""Options that several commands share."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from mlnlite.cli.files import verify_writable

Command = TypeVar("Command", bound=Callable[..., Any])

FILE = click.Path(path_type=Path)


def _remember(ctx: click.Context, _: click.Parameter, value: str) -> str:
    """Keeps the format where the error report finds it."""
    ctx.meta["mlnlite.format"] = value
    return value


def writable(_: click.Context, __: click.Parameter, value: Path | None) -> Path | None:
    """A file to write, refused before any work if it cannot be."""
    if value is not None:
        verify_writable(value)
    return value


def format_option(*names: str) -> Callable[[Command], Command]:
    """`--format`; the first name is the default."""
    return click.option(
        "--format",
        type=click.Choice(names),
        default=names[0],
        show_default=True,
        is_eager=True,
        callback=_remember,
        help="How the answer is written.",
    )


dialect_option = click.option(
    "--dialect",
    type=click.Choice(["standard", "prac", "alchemy", "tuffy", "rockit", "lomrf"]),
    help="`standard`: variables start lower case; `prac`: variables are written ?x; others: files of these systems. "
    "By default found out; `mlnlite check -v` says why.",
)
output_option = click.option(
    "-o",
    "--output",
    type=FILE,
    callback=writable,
    help="File to write; it appears when it is complete. By default standard output.",
)
TOGETHER = "Facts that are known: .db files, NAME=TABLE (CSV, Parquet, ...), .toml mappings; together one world."
APART = "Facts that are known: .db files, each database a world of its own; NAME=TABLE and .toml mappings, one world."


def _no_facts(_: click.Context, __: click.Parameter, value: tuple[Path, ...]) -> tuple[Path, ...]:
    """Facts in the place of a model would be read as formulas of weight 1."""
    facts = next((path for path in value if path.suffix == ".db"), None)
    if facts is not None:
        raise click.UsageError(f"{facts} is named as a model and holds facts by its name; write `-e {facts}`")
    return value


models_argument = click.argument("models", type=FILE, nargs=-1, required=True, metavar="MODEL...", callback=_no_facts)


def evidence_option(text: str) -> Callable[[Command], Command]:
    """`-e`, with what several files mean."""
    return click.option("-e", "--evidence", type=FILE, multiple=True, metavar="FILE", help=text)


def time_limit_option(text: str) -> Callable[[Command], Command]:
    """`--time-limit`, with what happens after it."""
    limit = click.FloatRange(min=0, min_open=True)
    return click.option("--time-limit", type=limit, metavar="SECONDS", help=text)


UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9}


def _memory(_: click.Context, __: click.Parameter, value: str | None) -> int | None:
    if value is None:
        return None
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([KMG]?)B?", value.strip().upper())
    if match is None:
        raise click.BadParameter("expected a number of bytes such as 500MB or 2GB")
    return int(float(match[1]) * UNITS[match[2]])


def limit_options(command: Command) -> Command:
    """`--max-groundings` and `--max-memory`."""
    memory = click.option(
        "--max-memory", callback=_memory, metavar="SIZE", help="Memory for one formula, such as 500MB or 2GB."
    )
    groundings = click.option(
        "--max-groundings", type=click.IntRange(min=0), metavar="N", help="Open groundings of one formula."
    )
    return groundings(memory(command))


database_option = click.option(
    "--database", type=click.IntRange(min=1), metavar="N", help="Which of the databases of the file, the first being 1."
)
closed_world_option = click.option(
    "--closed-world",
    multiple=True,
    metavar="NAMES",
    help="Predicates whose atoms are false unless they are facts; `all`: all that are not asked about.",
)
open_world_option = click.option(
    "--open-world", multiple=True, metavar="NAMES", help="Predicates whose world stays open nevertheless."
)


def names(values: Sequence[str]) -> list[str]:
    """The names of a repeated, comma-separated option; commas in brackets separate nothing.

    >>> names(["isA,hasShape", "Friends(+, -)"])
    ['isA', 'hasShape', 'Friends(+, -)']
    """
    found = [name.strip() for value in values for name in re.split(r",(?![^()]*\))", value)]
    return [name for name in found if name]
