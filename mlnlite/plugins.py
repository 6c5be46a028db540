"""Plugins: fields of application found through the entry-point group `mlnlite.plugins`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mlnlite.errors import MlnError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    import click

GROUP = "mlnlite.plugins"


@dataclass(frozen=True, slots=True)
class Plugin:
    """What a field of application adds to mlnlite.

    Attributes:
        name: the word after `mlnlite` on the command line.
        summary: one line for `mlnlite --help`.
        commands: gives the click group with the plugin's commands; called when one of them is asked for.
    """

    name: str
    summary: str
    commands: Callable[[], click.Group]


def installed() -> dict[str, EntryPoint]:
    """The entry points of all installed plugins, by name, not yet loaded."""
    from importlib.metadata import entry_points  # late: most commands do without

    return {entry.name: entry for entry in entry_points(group=GROUP)}


def load(entry: EntryPoint) -> Plugin:
    """The plugin of an entry point.

    Raises:
        MlnError: if what the entry point names is not a plugin, or cannot be imported.
    """
    try:
        plugin = entry.load()
    except (ImportError, AttributeError) as error:
        raise MlnError(f"the plugin {entry.name} ({entry.value}) cannot be imported: {error}") from error
    if not isinstance(plugin, Plugin):
        raise MlnError(f"the plugin {entry.name} ({entry.value}) is a {type(plugin).__name__}, not a Plugin")
    return plugin
