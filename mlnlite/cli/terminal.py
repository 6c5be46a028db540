"""What a person sees while a command works, and tables."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from threading import Timer

import click

from mlnlite.errors import Diagnostic

PATIENCE = 1.0
"""Seconds of work after which it is announced."""


@contextmanager
def working(what: str) -> Iterator[None]:
    """Shows `what` with the time it takes on standard error, if that is a terminal and it takes over a second."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    bar = Progress(
        SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console, transient=True
    )
    bar.add_task(what, total=None)
    timer = Timer(PATIENCE, bar.start)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        bar.stop()


def table(rows: Sequence[Sequence[str]], align: str) -> str:
    """Rows of text in columns.

    Args:
        rows: the cells.
        align: for each column `<` or `>`; the last `<` column is not padded.

    >>> print(table([["1", "a b"], ["22", "c"]], "><"))
       1  a b
      22  c
    """
    if not rows:
        return ""
    widths = [max(len(row[i]) for row in rows) for i in range(len(align))]
    lines = ("  ".join(f"{cell:{a}{w}}" for cell, a, w in zip(row, align, widths, strict=True)) for row in rows)
    return "\n".join(f"  {line}".rstrip() for line in lines)


def shortened(words: Sequence[str], width: int) -> str:
    """As many words as fit into `width`, then how many there are more.

    >>> shortened(["cup", "knife", "spoon"], 12)
    'cup, ... (2 more)'
    """
    text = ", ".join(words)
    if len(text) <= width:
        return text
    kept: list[str] = []
    for word in words:
        if len(", ".join([*kept, word])) > width - 5 and kept:
            break
        kept.append(word)
    return f"{', '.join(kept)}, ... ({len(words) - len(kept):,} more)" if len(kept) < len(words) else text


def warn(warnings: Iterable[Diagnostic]) -> None:
    """Writes what reading found strange to standard error."""
    for warning in warnings:
        click.echo(f"{warning}\n", err=True)
