"""How marginal questions are to be answered: what a user may choose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mlnlite.infer.exact.marginal import WIDTH_LIMIT

Sampler = Literal["gibbs", "mcsat", "tempering"]
MarginalMethod = Literal["auto", "exact", "lifted", "wmc", "gibbs", "mcsat", "tempering", "bp"]
SAMPLERS: dict[MarginalMethod, Sampler] = {"gibbs": "gibbs", "mcsat": "mcsat", "tempering": "tempering"}
PATIENCE = 60.0
BOUNDED = "bounded elimination"


@dataclass(frozen=True, slots=True)
class Approach:
    """How to answer.

    Attributes:
        method: "auto" for the ladder, "exact" to refuse what is too wide, or one method by name.
        width_limit: largest number of entries of a table.
        precision: largest standard error of what is sampled.
        time_limit: [s] for all sampling; None for 60. For model counting by name None is for ever.
        chains: how many are sampled.
        seed: where chance starts.
    """

    method: MarginalMethod = "auto"
    width_limit: int = WIDTH_LIMIT
    precision: float = 0.005
    time_limit: float | None = None
    chains: int = 4
    seed: int = 0
