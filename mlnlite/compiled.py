"""Compiled code: where its cache goes, and a word to the user while it is made for the first time."""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from time import monotonic
from typing import Any

_FIRST = "compiling fast code for the first time; this is kept for later"
_EVERY = 2.0
"""[s] between words about it."""


def prepare_cache() -> None:
    """Chooses a folder for compiled code if neither the installed package nor the home folder can be written."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    folders = Path(__file__).parent / "__pycache__", Path(os.path.expanduser("~")) / ".cache" / "numba"
    if not any(map(_writable, folders)):
        os.environ["NUMBA_CACHE_DIR"] = os.path.join(tempfile.gettempdir(), f"mlnlite-{os.getuid()}")


def _writable(folder: Path) -> bool:
    """Whether a folder can be made and written."""
    existing = next(f for f in (folder, *folder.parents) if f.exists())
    return os.access(existing, os.W_OK | os.X_OK)


def compiled(function: Callable[..., Any]) -> Any:  # noqa: ANN401
    """A function that Numba compiles when it is first called and keeps in a cache; a user hears of it if it does."""
    prepare_cache()
    from numba import njit

    _announce_compiling()
    return njit(cache=True, nogil=True)(function)


def compiled_part(function: Callable[..., Any]) -> Any:  # noqa: ANN401
    """The same for a small function that compiled functions call often and that makes no arrays.

    It does not count references to the arrays it gets, which could take several times as long as what it does.
    """
    prepare_cache()
    from numba import njit

    options: dict[str, Any] = {"_nrt": False}
    return njit(cache=True, nogil=True, **options)(function)


@cache
def _announce_compiling() -> None:
    """Says what takes so long, through the logger `mlnlite`, which by default writes to standard error."""
    numba_events: Any = import_module("numba.core.event")

    class Announcer(numba_events.Listener):  # type: ignore[misc]
        """Hears when Numba begins to compile something that its cache does not hold."""

        def on_start(self, event: object) -> None:
            """Says so, the first time, and then every two seconds."""
            if monotonic() >= due[0]:
                logging.getLogger("mlnlite").warning("compiling more of it" if due[0] else _FIRST)
                due[0] = monotonic() + _EVERY

        def on_end(self, event: object) -> None:
            """Nothing to say."""

    due = [0.0]
    numba_events.register("numba:compile", Announcer())
