"""What a database says, as a key: equal databases are worked on once. And which constants databases have."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from mlnlite.model.evidence import Evidence


def content(evidence: Evidence, predicates: Iterable[str]) -> tuple[bytes, ...]:
    """The constants of one database, its facts about some predicates, and whether their worlds are closed."""
    parts = [np.packbits(p[0]).tobytes() for p in evidence.present.values()]
    for name in predicates:
        facts = evidence.facts[name]
        parts += [facts.arguments.tobytes(), facts.truth.tobytes(), bytes([evidence.predicates[name].closed])]
    return tuple(parts)


def with_shared_constants(evidence: Evidence) -> Evidence:
    """The same databases, each with the constants of all: what one does not mention is false or unknown there, too."""
    return replace(evidence, present={name: np.ones_like(p) for name, p in evidence.present.items()})
