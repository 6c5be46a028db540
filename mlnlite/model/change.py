"""Facts that come and go: evidence about one database and the new status of some atoms in, evidence out."""

from __future__ import annotations

from dataclasses import replace
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.model.evidence import Evidence, Facts

Int8 = NDArray[np.int8]
Int64 = NDArray[np.int64]
Array = NDArray[Any]

UNKNOWN = -1

MANY = 1 << 15
"""Facts up to which all are numbered to find some."""

MOST_PARTS = 1000
"""Parts that an array is cut into: they are copied whole, which is faster than by an index or a mask."""


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
    place, there = places_of(evidence, name, numbers)
    after = place - (np.cumsum(there) - there)  # where it would stand once all of them are taken out
    put, gone = status != UNKNOWN, place[there]
    arguments = spliced(old.arguments, gone, after[put], evidence.arguments_of(name, numbers[put]))
    truth = spliced(old.truth, gone, after[put], status[put] == 1)
    return Facts(np.zeros(len(truth), np.int32), arguments, truth)


def status_of(evidence: Evidence, numbers: Int64) -> Int8:
    """Whether facts make atoms true (1) or false (0), or are none about them (`UNKNOWN`)."""
    status = np.full(len(numbers), UNKNOWN, np.int8)
    for name, facts in evidence.facts.items():
        low = evidence.first_atom()[name]
        mine = np.flatnonzero((numbers >= low) & (numbers < low + prod(evidence.sizes(name))))
        if len(mine):
            place, there = places_of(evidence, name, numbers[mine])
            status[mine[there]] = facts.truth[place[there]]
    return status


def facts_about(evidence: Evidence, name: str, numbers: Int64) -> Facts:
    """Those facts of a predicate that are about some atoms, given by rising numbers."""
    place, there = places_of(evidence, name, numbers)
    facts, known = evidence.facts[name], place[there]
    return Facts(facts.database[known], facts.arguments[known], facts.truth[known])


def places_of(evidence: Evidence, name: str, numbers: Int64) -> tuple[Int64, NDArray[np.bool_]]:
    """Where atoms of a predicate stand, or would stand, among its facts about one database, and whether they do.

    Few are looked for by bisection, which leaves almost all facts alone.
    """
    arguments = evidence.facts[name].arguments
    if len(arguments) <= max(MANY, 8 * len(numbers)):
        return find(evidence.atom_number(name, arguments), numbers)
    low, high = np.zeros(len(numbers), np.int64), np.full(len(numbers), len(arguments), np.int64)
    for _ in range(len(arguments).bit_length()):
        middle = (low + high) // 2
        less = evidence.atom_number(name, arguments.take(middle, axis=0, mode="clip")) < numbers
        low, high = np.where(less & (low < high), middle + 1, low), np.where(less, high, middle)
    there = evidence.atom_number(name, arguments.take(low, axis=0, mode="clip")) == numbers
    return low, there & (low < len(arguments))


def find(rising: Int64, numbers: Int64) -> tuple[Int64, NDArray[np.bool_]]:
    """Where numbers stand, or would stand, in a rising array, and whether they do."""
    place = np.searchsorted(rising, numbers)
    inside = np.minimum(place, max(len(rising) - 1, 0))
    there = rising[inside] == numbers if len(rising) else np.zeros(len(numbers), np.bool_)
    return place, there


def spliced(array: Array, gone: Int64, at: Int64, new: Array) -> Array:
    """An array without some rows, and with others put in.

    Args:
        array: shape (n, ...).
        gone: indices of the rows to leave out, rising.
        at: for each new row before which of those that are left it comes, rising.
        new: the new rows.
    """
    if len(gone) + len(at) > MOST_PARTS:
        return np.insert(np.delete(array, gone, axis=0), at, new, axis=0)
    if not len(gone) + len(at):
        return array
    before = at + np.searchsorted(gone - np.arange(len(gone)), at, side="right")
    parts, start = [], 0
    for cut, i in sorted([(c, -1) for c in gone.tolist()] + [(c, i) for i, c in enumerate(before.tolist())]):
        parts += [array[start:cut], new[i : i + 1] if i >= 0 else new[:0]]
        start = cut if i >= 0 else cut + 1
    return np.concatenate([*parts, array[start:]])
