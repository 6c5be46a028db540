"""The commands. Here, and nowhere else, something is printed and the process ends with an exit code.

Exit codes: 0 an answer, 1 no answer within the limits, 2 a mistake of the user, 130 interrupted, 143 terminated.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import FrameType
from typing import TYPE_CHECKING

import click

from mlnlite import __version__
from mlnlite.errors import LimitReached, MlnError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

COMMANDS = {
    "check": "Say what a model and its evidence are, and what is wrong with them.",
    "learn": "Learn the weights of a model from databases.",
    "query": "Ask a model: probabilities, or the most probable world.",
    "ground": "Ground a model: what evidence leaves open, or what that would take; export it.",
    "score": "Score a world: its log-weight and what it pays, formula by formula.",
    "fmt": "Write models in one style, keeping comments.",
    "lint": "Warn of what is allowed and probably not meant.",
    "convert": "Rewrite a model in our dialects, and list what changes.",
    "diff": "Compare two models: formulas matched, weights side by side.",
    "test": "Run the @test lines of a model.",
    "evaluate": "Measure how well a model predicts what databases already say.",
    "crossvalidate": "Measure how well a model predicts databases that it was not learnt from.",
}
"""The built-in commands with a line each; `mlnlite.cli.NAME` is imported when NAME is asked for."""

NO_ANSWER, USER_ERROR, INTERRUPTED, TERMINATED = 1, 2, 130, 143


class Commands(click.Group):
    """The built-in commands and those of plugins, each loaded when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Built-in commands first."""
        return [*COMMANDS, *sorted(_plugins())]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """A command by name."""
        if cmd_name in COMMANDS:
            command = getattr(import_module(f"mlnlite.cli.{cmd_name}"), cmd_name)
            return command if isinstance(command, click.Command) else None
        entry = _plugins().get(cmd_name)
        return _plugin_commands(entry) if entry else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """One line for each command, without loading the built-in ones."""
        rows = list(COMMANDS.items())
        rows += [(name, _summary(entry)) for name, entry in sorted(_plugins().items())]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def invoke(self, ctx: click.Context) -> object:
        """Runs a command; a user's mistake becomes a message and an exit code."""
        with _terminable() as terminated:
            try:
                return super().invoke(ctx)
            except MlnError as error:
                click.echo(_message(error, ctx.meta.get("mlnlite.format")), err=True)
                ctx.exit(NO_ANSWER if isinstance(error, LimitReached) else USER_ERROR)
            except MemoryError:
                hint = "`mlnlite ground --forecast` says what formulas take; ask, or learn, about fewer predicates"
                click.echo(_message(LimitReached("there is not enough memory for this", hint), None), err=True)
                ctx.exit(NO_ANSWER)
            except (KeyboardInterrupt, SystemExit) as error:
                if isinstance(error, SystemExit) and not terminated:
                    raise
                click.echo("terminated" if terminated else "interrupted", err=True)
                ctx.exit(TERMINATED if terminated else INTERRUPTED)


@contextmanager
def _terminable() -> Iterator[list[int]]:
    """Makes SIGTERM end a command as Ctrl-C does, so that all is tidied up; the list then has the signal."""
    received: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield received
        return

    def end(number: int, _: FrameType | None) -> None:
        received.append(number)
        raise SystemExit(TERMINATED)

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield received
    finally:
        signal.signal(signal.SIGTERM, before)


def _message(error: MlnError, format_name: object) -> str:
    if format_name != "json":
        return str(error)
    import json

    kind = type(error).__name__
    return json.dumps({"error": kind, "diagnostics": [d.to_dict() for d in error.diagnostics]}, indent=2)


def _plugins() -> dict[str, EntryPoint]:
    from mlnlite.plugins import installed

    return {name: entry for name, entry in installed().items() if name not in COMMANDS}


def _plugin_commands(entry: EntryPoint) -> click.Group:
    from mlnlite.plugins import load

    return load(entry).commands()


def _summary(entry: EntryPoint) -> str:
    """The plugin's own line, or why there is none: a broken plugin is not hidden."""
    from mlnlite.plugins import load

    try:
        return load(entry).summary
    except MlnError as error:
        return f"broken: {error.diagnostics[0].message}"


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="mlnlite")
def mlnlite() -> None:
    """Markov logic networks: exact where affordable, fast, and clear.

    Exit codes: 0 an answer, 1 no answer within the limits, 2 a mistake in the input, 130 interrupted, 143 terminated.
    """


def main() -> None:
    """The entry point of the `mlnlite` command."""
    mlnlite(prog_name="mlnlite")
