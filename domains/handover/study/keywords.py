"""Keywords of open answers: comments in, shares by level out. A word under a negation counts on its own."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

KEYWORDS: Mapping[str, tuple[str, ...]] = {
    "safety": ("safe", "danger", "hurt", "harm", "risk", "injur"),
    "comfort": ("comfort", "natural", "easy", "relax"),
    "reach": ("reach", "close", "near", "stretch", "far", "move", "distance"),
    "grasp": ("grasp", "grip", "hold", "handle"),
    "use": ("use", "task", "purpose"),
}
"""Stems of words: a word counts if it starts with one. The paper names no sets; these are ours."""
_NEGATIONS = frozenset({"not", "no", "never", "nobody", "without", "cannot", "hardly", "nothing"})
_WINDOW = 3
"""A keyword is negated if a negation stands among so many words before it in its clause."""


@dataclass(frozen=True, slots=True)
class Share:
    """How often a keyword is named.

    Attributes:
        level: of mobility.
        keyword: name of the set.
        plain: share of people who name it.
        negated: share of people who name it under a negation, and never plainly.
        n: people.
    """

    level: str
    keyword: str
    plain: float
    negated: float
    n: int


def mentions(comment: str) -> dict[str, bool]:
    """Keywords of a comment: True if named plainly somewhere, False if only under a negation.

    >>> mentions("It is not dangerous and easy to reach.")
    {'safety': False, 'comfort': True, 'reach': True}
    """
    found: dict[str, bool] = {}
    for clause in re.split(r"[.,;:!?]|\bbut\b|\band\b", comment.lower()):
        words = re.findall(r"[a-z']+", clause)
        for name, stems in KEYWORDS.items():
            for i in (i for i, word in enumerate(words) if word.startswith(stems)):
                found[name] = found.get(name, False) or not _negated(words, i)
    return {name: found[name] for name in KEYWORDS if name in found}


def _negated(words: Sequence[str], place: int) -> bool:
    before = words[max(0, place - _WINDOW) : place]
    return any(word in _NEGATIONS or word.endswith("n't") for word in before)


def keyword_shares(levels: Sequence[str], comments: Sequence[str]) -> tuple[Share, ...]:
    """Shares of each keyword by level, over people who wrote something."""
    out = []
    for level in dict.fromkeys(levels):
        texts = [mentions(c) for x, c in zip(levels, comments, strict=True) if x == level and c.strip()]
        for name in KEYWORDS:
            plain = sum(found.get(name, False) for found in texts)
            negated = sum(name in found and not found[name] for found in texts)
            n = max(len(texts), 1)
            out.append(Share(level, name, plain / n, negated / n, len(texts)))
    return tuple(out)
