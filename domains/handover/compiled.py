"""Compiled code: a plain function in, the same function compiled by Numba out, kept on disk where that is possible."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compiles a function when it is first called; the machine code is kept for later processes."""
    prepare_cache(Path(__file__).parent / "__pycache__")
    from numba import njit

    return cast(Function, njit(cache=True)(function))


def prepare_cache(beside: Path) -> None:
    """Chooses a temporary folder for machine code if neither `beside` nor the home folder can be written."""
    folders = beside, Path(os.path.expanduser("~")) / ".cache" / "numba"
    if "NUMBA_CACHE_DIR" not in os.environ and not any(map(_writable, folders)):
        os.environ["NUMBA_CACHE_DIR"] = os.path.join(tempfile.gettempdir(), f"mlnlite-{os.getuid()}")


def _writable(folder: Path) -> bool:
    existing = next(f for f in (folder, *folder.parents) if f.exists())
    return os.access(existing, os.W_OK | os.X_OK)
