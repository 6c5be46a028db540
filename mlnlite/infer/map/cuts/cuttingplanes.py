"""Best worlds by cutting planes: comes in a network that lacks groundings, goes out a world of the whole with a bound.

Solve without these formulas, ask the engine which of their groundings the solution violates, add these, solve again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from mlnlite.engines.plan import Engine
from mlnlite.ground.network import Bool
from mlnlite.infer.conflict import contradiction
from mlnlite.infer.deadline import interruptible
from mlnlite.infer.map.cuts.lazy_program import grow
from mlnlite.infer.map.cuts.partition import partitioned
from mlnlite.infer.map.cuts.waiting import Lazy, violated_weight, with_violated
from mlnlite.infer.map.ladder import BestWorld, map_of
from mlnlite.infer.map.rungs import Options
from mlnlite.infer.map.satisfy import feasible_world
from mlnlite.infer.reduce.parts import Part
from mlnlite.infer.reduce.potentials import potentials_of
from mlnlite.infer.score import cost, counts, log_weight, truth_of

CUTTING_PLANES = "cutting planes"
_CLOSE = 1e-4


def map_lazily(lazy: Lazy, options: Options, engine: Engine | None = None) -> tuple[Lazy, BestWorld]:
    """A most probable world of the whole model, and what had to be generated for it.

    Args:
        lazy: a network that lacks groundings.
        options: how to search; on the way worlds are kept that violate nothing hard.
        engine: what runs the queries for violated groundings.

    Raises:
        Contradiction: no world satisfies the hard formulas.
    """
    if options.method in ("auto", "ilp"):
        return _by_program(lazy, options, engine)
    found: list[tuple[float, BestWorld]] = []
    bound, answer = np.inf, _solved(lazy, options)
    while True:
        more = with_violated(lazy, answer.truth, engine)
        bound = min(bound, answer.log_weight + answer.gap)
        found.append((log_weight(more.network, answer.truth), answer))
        if more is lazy or options.deadline.is_over or _is_close(more, found, bound, options.gap):
            break
        lazy = more
        answer = _solved(lazy, options)
        if not answer.gap <= _CLOSE:  # a search that ends early may as well look for worlds that violate nothing
            other = _solved(lazy, replace(options, method="annealing"))
            lazy = with_violated(lazy, other.truth, engine)
            found.append((log_weight(lazy.network, other.truth), other))
    lazy, found = _with_nothing(lazy, found, engine)
    value, best = max(found, key=lambda f: f[0])
    gap = max(0.0, bound - value)
    status: Literal["optimal", "feasible"] = "optimal" if gap <= _CLOSE else "feasible"
    return more if more.generated > lazy.generated else lazy, replace(
        best, log_weight=value, bound=value + gap, status=status, component_gap=np.array([gap])
    )


def _by_program(lazy: Lazy, options: Options, engine: Engine | None) -> tuple[Lazy, BestWorld]:
    """By a program that grows, from a partition where one is asked for."""
    start = partitioned(lazy, options.seed)
    with interruptible(options.deadline):
        found = grow(lazy, start, options, engine)
    if found.truth is None:
        found.truth = _allowed(lazy, engine)
        found.value = log_weight(lazy.network, found.truth) - violated_weight(lazy, found.truth, engine)
    lazy = replace(with_violated(lazy, found.truth, engine), in_rows=found.n_groundings)
    gap = max(0.0, found.gap)
    n = lazy.network.n_atoms
    status: Literal["optimal", "feasible"] = "optimal" if gap <= _CLOSE else "feasible"
    return lazy, BestWorld(
        found.truth, found.value, found.value + gap, status, np.zeros(n, np.int64), (status,), (CUTTING_PLANES,),
        np.array([gap]), {CUTTING_PLANES: 1}, 0,
    )  # fmt: skip


def _allowed(lazy: Lazy, engine: Engine | None) -> Bool:
    """A world that violates nothing hard.

    Raises:
        Contradiction: there is none.
    """
    while True:
        potentials = potentials_of(lazy.network, max_arity=np.inf)
        n = len(potentials.cardinality)
        values = feasible_world(Part(0, np.arange(n), potentials.cardinality, potentials.cells))
        if values is None or np.isneginf(potentials.constant):
            raise contradiction(lazy.network)
        truth = truth_of(lazy.network, values)
        if np.isfinite(violated_weight(lazy, truth, engine)):
            return truth
        lazy = with_violated(lazy, truth, engine)


def _solved(lazy: Lazy, options: Options) -> BestWorld:
    """A best world of what was generated so far."""
    left = None if np.isinf(options.deadline.left) else max(1.0, options.deadline.left / 2)
    return map_of(lazy.network, method=options.method, time_limit=left, seed=options.seed, gap=options.gap)


def _is_close(lazy: Lazy, found: list[tuple[float, BestWorld]], bound: float, gap: float) -> bool:
    """Whether the best world so far is proved, or close enough to the bound."""
    value, best = max(found, key=lambda f: f[0])
    if not np.isfinite(value):
        return False
    return bound - value <= max(_CLOSE, gap * cost(lazy.network, counts(lazy.network, best.truth)))


def _with_nothing(
    lazy: Lazy, found: list[tuple[float, BestWorld]], engine: Engine | None
) -> tuple[Lazy, list[tuple[float, BestWorld]]]:
    """If no world is good for the whole model, the one in which nothing more is true than has to be."""
    if any(np.isfinite(value) for value, _ in found):
        return lazy, found
    nothing = replace(found[-1][1], truth=np.zeros(lazy.network.n_atoms, np.bool_))
    lazy = with_violated(lazy, nothing.truth, engine)
    return lazy, [*found, (log_weight(lazy.network, nothing.truth), nothing)]
