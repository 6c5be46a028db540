"""Where atoms stand in a network: numbers of atoms in, indices out."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]

DENSEST = 1 << 28
"""Atom numbers that a look-up table may span."""

Index: TypeAlias = Callable[[Int64], Int32]
"""Gives the index in the network of atoms by their numbers."""


def index_in(atoms: Int64, n_sought: int) -> Index:
    """The function that gives the place of atoms in the rising array `atoms`.

    Args:
        atoms: shape (n,), rising.
        n_sought: about how many will be looked for.
    """
    span = int(atoms[-1] - atoms[0]) + 1 if len(atoms) else 0
    if not len(atoms) or span > min(DENSEST, 16 * len(atoms) + 4096):
        return lambda numbers: np.searchsorted(atoms, numbers).astype(np.int32)
    low = atoms[0]
    if span == len(atoms):
        return lambda numbers: (numbers - low if low else numbers).astype(np.int32, copy=False)
    if 16 * n_sought < span:
        return lambda numbers: np.searchsorted(atoms, numbers).astype(np.int32)
    place = np.zeros(span, np.int32)
    place[atoms - low] = np.arange(len(atoms), dtype=np.int32)
    return lambda numbers: place.take(numbers - low if low else numbers, mode="clip")
