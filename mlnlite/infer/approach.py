"""How marginal questions are to be answered: what a user may choose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from mlnlite.errors import QueryMistake, did_you_mean
from mlnlite.infer.exact.marginal import WIDTH_LIMIT

Sampler = Literal["gibbs", "mcsat", "tempering"]
MarginalMethod = Literal["auto", "exact", "lifted", "wmc", "gibbs", "mcsat", "tempering", "bp"]
SAMPLERS: dict[MarginalMethod, Sampler] = {"gibbs": "gibbs", "mcsat": "mcsat", "tempering": "tempering"}
PATIENCE = 60.0
LARGEST_SEED = 2**31 - 1
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

    def __post_init__(self) -> None:
        """Refuses what means nothing, however easy the question.

        Raises:
            QueryMistake: naming the option.
        """
        methods = get_args(MarginalMethod)
        if self.method not in methods:
            hint = did_you_mean(self.method, methods) or f"one of {', '.join(methods)}"
            raise QueryMistake(f"there is no method {self.method} for probabilities", hint)
        if not self.precision > 0:
            raise QueryMistake(f"a precision of {self.precision} is no standard error", "0.005 is the default")
        if self.chains < 2:
            raise QueryMistake(f"{self.chains} chains cannot be compared with each other", "give 2 or more")
        if self.width_limit < 1:
            raise QueryMistake(f"a table cannot have {self.width_limit} entries", f"{WIDTH_LIMIT} is the default")
        verify_run(self.time_limit, self.seed)


def verify_run(time_limit: float | None, seed: int) -> None:
    """Refuses a limit without time [s], and what is no seed.

    Raises:
        QueryMistake: naming the option.
    """
    if time_limit is not None and not time_limit > 0:
        raise QueryMistake(f"a time limit of {time_limit} s leaves no time", "give more than 0 s, or no limit")
    if not 0 <= seed <= LARGEST_SEED or int(seed) != seed:
        raise QueryMistake(f"{seed} is no seed", f"give a whole number from 0 to {LARGEST_SEED}")
