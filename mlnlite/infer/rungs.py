"""Which solver answers which component: come in components that elimination cannot do, go out answers with bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Literal

from mlnlite.infer import ilp, toulbar2
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.parts import Part, PartAnswer
from mlnlite.infer.workers import Ask, workers

Method = Literal["auto", "ve", "wcsp", "ilp"]
_FIRST_TRY = 5.0
_SMALL = 400


@dataclass(frozen=True, slots=True)
class Options:
    """How to search.

    Attributes:
        method: which rung, or "auto".
        deadline: when to stop.
        seed: where chance starts.
        gap: share of the cost that the best world may be missed by.
    """

    method: Method = "auto"
    deadline: Deadline = field(default_factory=Deadline)
    seed: int = 0
    gap: float = 0.0


Rung = Callable[[Part, Deadline, list[PartAnswer]], PartAnswer]


def answers_of(parts: Sequence[Part], options: Options) -> Iterator[list[PartAnswer]]:
    """What solvers say of each component; equal components are solved once.

    Args:
        parts: components.
        options: how to search; the time left is shared out evenly.
    """
    known: dict[object, list[PartAnswer]] = {}
    with workers() as ask:
        for i, part in enumerate(parts):
            key = _identity(part)
            if key not in known:
                deadline = options.deadline.within(options.deadline.left / (len(parts) - i))
                known[key] = _search(part, options, deadline, ask)
            yield known[key]


def _identity(part: Part) -> object:
    """Equal for components that differ in the names of their variables only (if they stand in the same order)."""
    arrays = [a.tobytes() for c in part.cells for a in (c.scope, c.value, c.amount)]
    return part.cardinality.tobytes(), *arrays


def _search(part: Part, options: Options, deadline: Deadline, ask: Ask) -> list[PartAnswer]:
    """Climbs until something is proved."""
    answers: list[PartAnswer] = []
    for rung, seconds in _ladder(part, options, ask):
        answers.append(rung(part, deadline.within(seconds), answers))
        if answers[-1].optimal or deadline.is_over:
            break
    return answers


def _ladder(part: Part, options: Options, ask: Ask) -> list[tuple[Rung, float]]:
    """Rungs in the order to try them, and how long each may take [s]."""

    def by_ilp(part: Part, deadline: Deadline, _: list[PartAnswer]) -> PartAnswer:
        return ilp.solve_part(part, deadline, options.seed, gap=options.gap)

    def by_wcsp(part: Part, deadline: Deadline, _: list[PartAnswer]) -> PartAnswer:
        return toulbar2.solve_part(part, ask, deadline, options.seed)

    single: dict[str, Rung] = {"ilp": by_ilp, "wcsp": by_wcsp}
    if options.method in single:
        return [(single[options.method], inf)]
    if not toulbar2.is_available():
        return [(by_ilp, inf)]
    return [(by_ilp, _FIRST_TRY), (by_wcsp, _FIRST_TRY), (by_ilp, inf)]
