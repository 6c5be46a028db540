"""What a database says, as a key: equal databases are worked on once."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mlnlite.model.evidence import Evidence


def content(evidence: Evidence, predicates: Iterable[str]) -> tuple[bytes, ...]:
    """The constants of one database, and its facts about some predicates."""
    parts = [np.packbits(p[0]).tobytes() for p in evidence.present.values()]
    for name in predicates:
        facts = evidence.facts[name]
        parts += [facts.arguments.tobytes(), facts.truth.tobytes()]
    return tuple(parts)
