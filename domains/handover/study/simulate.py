"""A simulated survey, for trying the analysis: nobody was asked.

Preferences have the published counts; the ratings, ranks and comments are inventions of this file, and every output
says so.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mlnlite.domains.handover.study.preferences import published, shares
from mlnlite.domains.handover.study.survey import METHODS, RANKED, RATED, Survey

SOURCE = "SIMULATED: preferences as published, ratings, ranks and comments invented"
_PHRASES = {
    "A": (
        "It is far, so nobody gets hurt.",
        "I have to stretch but it is not dangerous.",
        "Enough space to feel safe.",
    ),
    "B": ("Comfortable distance, easy to grasp.", "It feels natural.", "Not too close and not too far."),
    "ours": ("I do not need to move my arm.", "It is close and easy to reach.", "The handle is free, I can use it."),
}
_IMPORTANCE = {"H": (0.0, 0.3, 0.6, 1.4, 1.2), "L": (0.4, 0.1, 0.7, 0.0, 1.6)}


def simulate(*, seed: int = 0, effect: float = 1.0) -> Survey:
    """The 259 participants with invented answers.

    Args:
        seed: of all draws.
        effect: how many points a participant gives the preferred method on top; 0 makes ratings pure chance.
    """
    rng, table = np.random.default_rng(seed), published()
    levels = np.repeat(table.levels, table.participants)
    preferred = np.concatenate([_preferred(i, rng) for i in range(len(table.levels))])
    liking = np.array([[m == p for m in METHODS] for p in preferred], dtype=np.float64)
    person = rng.normal(0.0, 0.5, (len(levels), 1, 1))
    noise = rng.normal(0.0, 0.8, (len(levels), len(METHODS), len(RATED)))
    ratings = np.clip(np.rint(3.1 + effect * liking[:, :, None] + person + noise), 1, 5).astype(np.int64)
    comments = tuple(str(rng.choice(_PHRASES[p])) for p in preferred)
    names = tuple(str(level) for level in levels)
    return Survey(f"{SOURCE} (seed {seed})", names, tuple(map(str, preferred)), ratings, _ranks(names, rng), comments)


def _preferred(level: int, rng: np.random.Generator) -> NDArray[np.str_]:
    """Exactly the published counts; who did not say gets a draw."""
    table = published()
    told = np.repeat(table.methods, table.counts[level])
    n = int(table.participants[level]) - len(told)
    return np.concatenate([told, rng.choice(table.methods, n, p=shares(table)[level])])


def _ranks(levels: tuple[str, ...], rng: np.random.Generator) -> NDArray[np.int64]:
    """Noisy orders: people of low mobility care more about reach."""
    weights = np.array([_IMPORTANCE["L" if level in ("L", "L-M") else "H"] for level in levels])
    scores = weights + rng.gumbel(0.0, 0.7, (len(levels), len(RANKED)))
    out: NDArray[np.int64] = scores.argsort(axis=1).argsort(axis=1) + 1
    return out
