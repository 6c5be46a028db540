"""Compiled code: where its cache goes, and a word to the user while it is made for the first time."""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from threading import Timer
from time import monotonic
from typing import Any

_FIRST = "compiling fast code for the first time; this is kept for later"
_EVERY, _PATIENCE = 2.0, 1.5
"""[s] between words about it, and before one about what takes long every time."""


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
    _load_compiler()
    from numba import njit

    return njit(cache=True, nogil=True)(function)


def compiled_part(function: Callable[..., Any]) -> Any:  # noqa: ANN401
    """The same for a small function that compiled functions call often and that makes no arrays.

    It does not count references to the arrays it gets, which could take several times as long as what it does.
    """
    _load_compiler()
    from numba import njit

    options: dict[str, Any] = {"_nrt": False}
    return njit(cache=True, nogil=True, **options)(function)


@cache
def _load_compiler() -> None:
    """Loads Numba, and has it say so when it compiles."""
    prepare_cache()
    slow = _later(_PATIENCE, lambda: _say("loading the compiler"))
    try:
        import_module("numba")
    finally:
        slow.cancel()
    numba_events: Any = import_module("numba.core.event")
    numba_events.register("numba:compile", _announcer())


def _say(what: str) -> None:
    """A word to the user, through the logger `mlnlite`, which by default writes to standard error."""
    logging.getLogger("mlnlite").warning(what)


def _later(seconds: float, what: Callable[[], None]) -> Timer:
    """Has something done in so many seconds, unless it is cancelled or the program ends before."""
    timer = Timer(seconds, what)
    timer.daemon = True
    timer.start()
    return timer


def _announcer() -> Any:  # noqa: ANN401
    """Says what takes so long: when Numba begins to compile something that its cache does not hold, and while."""
    numba_events: Any = import_module("numba.core.event")
    depth, due, reminders = [0], [0.0], list[Timer]()

    def remind() -> None:
        if depth[0] and monotonic() >= due[0]:
            _say("compiling more of it" if due[0] else _FIRST)
            due[0] = monotonic() + _EVERY
        if depth[0]:
            reminders[:] = [_later(max(due[0] - monotonic(), 0.01), remind)]

    class Announcer(numba_events.Listener):  # type: ignore[misc]
        """Hears of functions and of those that they call, which are compiled meanwhile."""

        def on_start(self, event: object) -> None:
            """Says so, the first time, and then every two seconds."""
            depth[0] += 1
            if depth[0] == 1:
                remind()

        def on_end(self, event: object) -> None:
            """Is silent once the outermost is done."""
            depth[0] -= 1
            if depth[0] == 0:
                reminders[0].cancel()

    return Announcer()
