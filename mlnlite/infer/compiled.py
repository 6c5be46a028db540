"""Compiled code: where its cache goes, and a word to the user while it is made for the first time."""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Timer

PATIENCE = 1.5
"""Seconds of compiling after which it is announced."""


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


@contextmanager
def announced() -> Iterator[None]:
    """Says what takes so long, through the logger `mlnlite`, which by default writes to standard error."""
    logger = logging.getLogger("mlnlite")
    timer = Timer(PATIENCE, logger.warning, ["compiling the sampler; this is done once and kept"])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
