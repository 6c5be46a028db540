"""Facts that come and go: evidence about one database and the new status of some atoms in, evidence out."""

from __future__ import annotations

from dataclasses import replace
from math import prod

import numpy as np
from numpy.typing import NDArray

from mlnlite.model.evidence import Evidence, Facts

Int8 = NDArray[np.int8]
Int64 = NDArray[np.int64]

UNKNOWN = -1


def with_status(evidence: Evidence, numbers: Int64, status: Int8) -> Evidence:
    """The evidence in which some atoms are true, false, or no facts any more.

    Args:
        evidence: of one database.
        numbers: shape (n,), of the atoms, each once.
        status: shape (n,), 1 true, 0 false, `UNKNOWN` for atoms that are to be no facts.
    """
    order = np.argsort(numbers)
    numbers, status = numbers[order], status[order]
    facts = dict(evidence.facts)
    for name, low in evidence.first_atom().items():
        start, stop = np.searchsorted(numbers, [low, low + prod(evidence.sizes(name))])
        if start < stop:
            facts[name] = _changed(evidence, name, numbers[start:stop], status[start:stop])
    return replace(evidence, facts=facts)


def _changed(evidence: Evidence, name: str, numbers: Int64, status: Int8) -> Facts:
    old = evidence.facts[name]
    place, there = find(evidence.atom_number(name, old.arguments), numbers)
    after = place - (np.cumsum(there) - there)  # where it would stand once all of them are taken out
    put, taken = status != UNKNOWN, place[there]
    arguments = np.insert(
        np.delete(old.arguments, taken, axis=0), after[put], evidence.arguments_of(name, numbers[put]), axis=0
    )
    truth = np.insert(np.delete(old.truth, taken), after[put], status[put] == 1)
    return Facts(np.zeros(len(truth), np.int32), arguments, truth)


def status_of(evidence: Evidence, numbers: Int64) -> Int8:
    """Whether facts make atoms true (1) or false (0), or are none about them (`UNKNOWN`)."""
    status = np.full(len(numbers), UNKNOWN, np.int8)
    for name, facts in evidence.facts.items():
        low = evidence.first_atom()[name]
        mine = np.flatnonzero((numbers >= low) & (numbers < low + prod(evidence.sizes(name))))
        if len(mine):
            place, there = find(evidence.atom_number(name, facts.arguments), numbers[mine])
            status[mine[there]] = facts.truth[place[there]]
    return status


def find(rising: Int64, numbers: Int64) -> tuple[Int64, NDArray[np.bool_]]:
    """Where numbers stand, or would stand, in a rising array, and whether they do."""
    place = np.searchsorted(rising, numbers)
    inside = np.minimum(place, max(len(rising) - 1, 0))
    there = rising[inside] == numbers if len(rising) else np.zeros(len(numbers), np.bool_)
    return place, there
