"""Room for arrays: long ones, and many short ones that are cut from longer ones.

Memory that a process has not had yet is handed out page by page. NumPy asks for huge pages where arrays have 4 MB or
more, and the first touch of one of these took up to 5 ms in a virtual machine, ten times as long as that of the small
pages it consists of. These arrays do without them, and time does not depend on what the machine has done before.
"""

from __future__ import annotations

import mmap
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

LONG = 1 << 22
"""[byte] from which on NumPy asks for huge pages."""

SHORT = 1 << 16
"""[byte] of arrays that are not worth to be cut from others."""

Cut = Callable[[int, DTypeLike], NDArray[Any]]
"""Gives an array of some length and type, with anything in it."""


def long_array(n: int, kind: DTypeLike) -> NDArray[Any]:
    """An array with anything in it.

    Raises:
        MemoryError: if there is not so much.
    """
    size = n * np.dtype(kind).itemsize
    if size < LONG or not hasattr(mmap, "MAP_PRIVATE"):
        return np.empty(n, kind)
    try:
        return np.frombuffer(mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS), kind)
    except OSError as error:
        raise MemoryError(f"no {size:,} bytes") from error


def room() -> Cut:
    """What cuts arrays one after the other from long ones."""
    block = np.empty(0, np.byte)

    def cut(n: int, kind: DTypeLike) -> NDArray[Any]:
        nonlocal block
        size = n * np.dtype(kind).itemsize
        if not SHORT <= size <= 4 * LONG:
            return long_array(n, kind)
        if size > len(block):
            block = long_array(4 * LONG, np.byte)
        array, block = block[:size].view(kind), block[-(-size // 64) * 64 :]
        return array

    return cut
