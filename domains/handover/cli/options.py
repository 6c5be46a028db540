"""Kinds of command-line options: words in, checked values out, before any work is done."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import click

COUNT = click.IntRange(min=1)
"""How many of something."""
SOLVERS = click.Choice(["auto", "ve", "mincut", "ilp", "wcsp", "maxsat"])
"""Ways to the most probable world that end with a proof."""
PICTURES = (".png", ".svg", ".pdf")


class OutFile(click.ParamType):  # type: ignore[type-arg]
    """A file to be written: its folder is there, and its ending is one that can be written."""

    name = "file"

    def __init__(self, endings: Sequence[str] = ()) -> None:
        """The endings allowed; by default any."""
        self.endings = tuple(endings)

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The path, if it can be written."""
        path = Path(value)
        if self.endings and path.suffix not in self.endings:
            self.fail(f"{value!r} ends in {path.suffix!r}; known endings: {', '.join(self.endings)}", param, ctx)
        if not path.parent.is_dir():
            self.fail(f"there is no folder {str(path.parent)!r} for {path.name!r}; make it first", param, ctx)
        if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
            self.fail(f"{value!r} cannot be written", param, ctx)
        return value
