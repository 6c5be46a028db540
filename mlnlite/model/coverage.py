"""Warnings about databases that lack what the others have, and about constants that look like one and are two."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mlnlite.errors import Diagnostic
from mlnlite.model.evidence import Evidence
from mlnlite.model.numbers import number_of


def coverage(evidence: Evidence) -> tuple[Diagnostic, ...]:
    """A warning for each predicate that has facts in most databases and none in some.

    Learning takes what is not a fact as false, so a fact that was not recorded is learnt as a false one.
    """
    return tuple(_warnings(evidence))


_FIRST_OF_NUMBERS = frozenset("-0123456789")


def _warnings(evidence: Evidence) -> Iterator[Diagnostic]:
    for name, facts in evidence.facts.items():
        lacking = np.setdiff1d(np.arange(evidence.n_databases), facts.database)
        if not 0 < len(lacking) < evidence.n_databases / 2:
            continue
        message = f"{name} has no fact in {len(lacking)} of {evidence.n_databases} databases"
        hint = f"the first is {evidence.names[lacking[0]]}; learning takes what is not a fact as false"
        yield Diagnostic("W310", message, hint=hint, severity="warning")


def same_number(constants: Sequence[str]) -> tuple[int, int] | None:
    """The first two constants that name the same number, such as `3` and `3.0`, or None.

    >>> same_number(["Anna", "3", "007", "3.0"])
    (1, 3)
    """
    seen: dict[float, int] = {}
    for i in [i for i, name in enumerate(constants) if name[:1] in _FIRST_OF_NUMBERS]:
        value = number_of(constants[i])
        if value is not None and seen.setdefault(value, i) != i:
            return seen[value], i
    return None
