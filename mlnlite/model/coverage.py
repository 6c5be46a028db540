"""Warnings about databases that lack what the others have."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mlnlite.errors import Diagnostic
from mlnlite.model.evidence import Evidence


def coverage(evidence: Evidence) -> tuple[Diagnostic, ...]:
    """A warning for each predicate that has facts in most databases and none in some.

    Learning takes what is not a fact as false, so a fact that was not recorded is learnt as a false one.
    """
    return tuple(_warnings(evidence))


def _warnings(evidence: Evidence) -> Iterator[Diagnostic]:
    for name, facts in evidence.facts.items():
        lacking = np.setdiff1d(np.arange(evidence.n_databases), facts.database)
        if not 0 < len(lacking) < evidence.n_databases / 2:
            continue
        message = f"{name} has no fact in {len(lacking)} of {evidence.n_databases} databases"
        hint = f"the first is {evidence.names[lacking[0]]}; learning takes what is not a fact as false"
        yield Diagnostic("W310", message, hint=hint, severity="warning")
