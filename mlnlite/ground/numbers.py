"""Numbers of atoms while grounding: like `Evidence.atom_number`, but with the closed predicates last.

So the numbers of open atoms, the only ones that are listed, stay small however many atoms a closed relation has.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import prod

import numpy as np
from numpy.typing import NDArray

from mlnlite.model.evidence import Evidence

Int64 = NDArray[np.int64]


def first_numbers(evidence: Evidence) -> dict[str, int]:
    """The number of the first atom of each predicate."""
    first, at = {}, 0
    for name in sorted(evidence.predicates, key=lambda name: evidence.predicates[name].closed):
        first[name] = at
        at += prod(evidence.sizes(name))
    return first


def atoms_numbered(numbers: Int64, evidence: Evidence) -> Int64:
    """The atoms, as `Evidence.atom_number` has them, of rising numbers of open atoms."""
    return _moved(numbers, first_numbers(evidence), evidence.first_atom(), evidence)


def numbers_of(atoms: Int64, evidence: Evidence) -> Int64:
    """The numbers of rising open atoms, which are given as `Evidence.atom_number` has them."""
    return _moved(atoms, evidence.first_atom(), first_numbers(evidence), evidence)


def known_numbers(predicate: str, evidence: Evidence) -> Int64:
    """The numbers of the atoms of a predicate that are facts, rising."""
    by = first_numbers(evidence)[predicate] - evidence.first_atom()[predicate]
    return np.asarray(evidence.atom_number(predicate, evidence.facts[predicate].arguments) + by, np.int64)


def _moved(rising: Int64, first: Mapping[str, int], to: Mapping[str, int], evidence: Evidence) -> Int64:
    """Rising numbers of open atoms with their predicates' first numbers changed."""
    names = [name for name, predicate in evidence.predicates.items() if not predicate.closed]
    by = np.array([to[name] - first[name] for name in names], np.int64)
    if not by.any():
        return rising
    ends = np.append(np.searchsorted(rising, [first[name] for name in names]), len(rising))
    return np.asarray(rising + np.repeat(by, np.diff(ends)), np.int64)
