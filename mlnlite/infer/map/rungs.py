"""Which solver answers which component: come in components that elimination cannot do, go out answers with bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypedDict, get_args

from mlnlite.errors import QueryMistake, did_you_mean
from mlnlite.ground.network import Int64
from mlnlite.infer.approach import verify_run
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.map import ilp, maxsat, mincut, relaxation, toulbar2
from mlnlite.infer.map.cuts import cycles
from mlnlite.infer.map.search import annealing, walksat
from mlnlite.infer.reduce.parts import Part, PartAnswer, all_gains, value_of
from mlnlite.infer.workers.ask import Ask, workers

Method = Literal["auto", "ve", "mincut", "ilp", "wcsp", "maxsat", "annealing", "maxwalksat"]
METHODS: tuple[Method, ...] = get_args(Method)
_FEW, _MANY, _TOO_MANY = 400, 20_000, 3_000_000
_CYCLES_UP_TO = 20_000
_NODES, _BACKTRACKS, _WORK = 50, (200, 50_000), 10_000_000
"""How much of a rung is a try: nodes of an integer program; backtracks, at least, at most and by number of cells."""


class Search(TypedDict, total=False):
    """Options of a search for a most probable world, see `map.map_of`."""

    method: Method
    time_limit: float | None
    seed: int
    gap: float


def verify(*, method: str = "auto", time_limit: float | None = None, seed: int = 0, gap: float = 0.0) -> None:
    """Refuses options of a search that mean nothing, however easy the question.

    Raises:
        QueryMistake: naming the option.
    """
    if method not in METHODS:
        hint = did_you_mean(method, METHODS) or f"one of {', '.join(METHODS)}"
        raise QueryMistake(f"there is no method {method} for most probable worlds", hint)
    if not gap >= 0:
        raise QueryMistake(f"a gap of {gap} is no share of a cost", "0 asks for a proof, .01 for one per cent")
    verify_run(time_limit, seed)


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


Rung = Callable[[Part, Deadline, list[PartAnswer]], PartAnswer | None]
"""Answers a component, given what others said of it; None if it is not of a kind that the rung can answer."""


def answers_of(parts: Sequence[Part], options: Options) -> Iterator[list[PartAnswer]]:
    """What solvers say of each component.

    Args:
        parts: components.
        options: how to search; the time left is shared out evenly.
    """
    with workers() as ask:
        for i, part in enumerate(parts):
            yield _search(part, options, options.deadline.within(options.deadline.left / (len(parts) - i)), ask)


def _search(part: Part, options: Options, deadline: Deadline, ask: Ask) -> list[PartAnswer]:
    """Climbs until something is proved, or good enough."""
    answers: list[PartAnswer] = []
    for rung in _ladder(part, options, ask):
        answer = rung(part, deadline, answers)
        answers += [] if answer is None else [answer]
        if deadline.is_over or any(a.optimal for a in answers) or _is_close(part, answers, options.gap):
            break
    return answers


def _is_close(part: Part, answers: list[PartAnswer], gap: float) -> bool:
    """Whether the best world so far costs at most a share more than any other can."""
    values = [value_of(part, a.world) for a in answers if a.world is not None] if gap > 0 else []
    if not values:
        return False
    highest, bound = all_gains(part), min(a.bound for a in answers)
    return bound - max(values) <= gap * (highest - max(values))


def best_of(part: Part, answers: list[PartAnswer]) -> Int64 | None:
    """The best world that was found."""
    worlds = [a.world for a in answers if a.world is not None]
    return max(worlds, key=lambda world: value_of(part, world), default=None)


def _ladder(part: Part, options: Options, ask: Ask) -> list[Rung]:
    """Rungs in the order to try them; how far a try goes depends on the component alone, never on the clock."""
    single = _single(options, ask)
    if options.method in single:
        return single[options.method]
    n_cells = sum(len(c.amount) for c in part.cells)
    if n_cells > _TOO_MANY:
        return [_by_mincut, *single["annealing"]]
    tried = [_trying_wcsp(part, options, ask)] if toulbar2.is_available() else []
    widest = max((c.scope.shape[1] for c in part.cells), default=0)
    mixed = bool((part.cardinality > 2).any()) or widest == 3
    last: list[Rung] = [*single["annealing"][:1], *single["ilp"]]
    if part.chains:
        return [_trying_ilp(options), *tried, *last]
    if widest <= 2 and not mixed and len(part.variables) <= _CYCLES_UP_TO:
        return [_by_mincut, *tried, *single["annealing"][:1], _cycles(options), *single["ilp"]]
    if len(part.variables) <= _FEW and mixed:
        return [_by_mincut, *tried, *last]
    relaxed: list[Rung] = [_by_relaxation] if n_cells > _MANY else []
    first = tried if mixed or relaxed else [_trying_ilp(options), *tried]
    return [_by_mincut, *relaxed, *first, *last]


def _trying_wcsp(part: Part, options: Options, ask: Ask) -> Rung:
    """toulbar2 for so many backtracks."""
    n_cells = sum(len(c.amount) for c in part.cells)
    backtracks = min(max(_WORK // max(n_cells, 1), _BACKTRACKS[0]), _BACKTRACKS[1])
    return lambda part, deadline, _: toulbar2.solve_part(part, ask, deadline, options.seed, backtracks=backtracks)


def _trying_ilp(options: Options) -> Rung:
    """An integer program for so many nodes."""
    return lambda part, deadline, before: ilp.solve_part(
        part, deadline, options.seed, gap=options.gap, start=best_of(part, before), nodes=_NODES
    )


def _cycles(options: Options) -> Rung:
    """Odd cycles, then an integer program."""
    return lambda part, deadline, before: cycles.solve_part(
        part, deadline, options.seed, gap=options.gap, start=best_of(part, before)
    )


def _single(options: Options, ask: Ask) -> dict[str, list[Rung]]:
    """What each method does by itself; searches without a proof get the bound of the linear relaxation."""
    seed = options.seed

    def by_ilp(part: Part, deadline: Deadline, before: list[PartAnswer]) -> PartAnswer:
        return ilp.solve_part(part, deadline, seed, gap=options.gap, start=best_of(part, before))

    def by_wcsp(part: Part, deadline: Deadline, _: list[PartAnswer]) -> PartAnswer:
        return toulbar2.solve_part(part, ask, deadline, seed)

    def by_maxsat(part: Part, deadline: Deadline, _: list[PartAnswer]) -> PartAnswer:
        return maxsat.solve_part(part, ask, deadline)

    def by_annealing(part: Part, deadline: Deadline, before: list[PartAnswer]) -> PartAnswer:
        return annealing.solve_part(part, deadline, seed, start=best_of(part, before))

    def by_walksat(part: Part, deadline: Deadline, _: list[PartAnswer]) -> PartAnswer:
        return walksat.solve_part(part, deadline, seed)

    return {
        "ilp": [by_ilp],
        "wcsp": [by_wcsp],
        "maxsat": [by_maxsat],
        "mincut": [_only_mincut],
        "annealing": [by_annealing, _by_relaxation],
        "maxwalksat": [by_walksat, _by_relaxation],
    }


def _by_mincut(part: Part, deadline: Deadline, _: list[PartAnswer]) -> PartAnswer | None:
    return mincut.solve_part(part, deadline)


def _only_mincut(part: Part, deadline: Deadline, _: list[PartAnswer]) -> PartAnswer:
    answer = mincut.solve_part(part, deadline)
    if answer is None:
        hint = "try `auto`: it uses minimum cuts where they apply"
        raise QueryMistake("minimum cuts need formulas over pairs of atoms that attract, once some are negated", hint)
    return answer


def _by_relaxation(part: Part, deadline: Deadline, _: list[PartAnswer]) -> PartAnswer:
    return relaxation.solve_part(part, deadline)
