"""Good worlds by simulated annealing: comes in a component, goes out the best world seen (no proof).

A move gives one variable, a block as a whole, another value. The temperature falls geometrically, again and again.
Kirkpatrick, Gelatt and Vecchi, Optimization by simulated annealing (Science 1983).
"""

from __future__ import annotations

import numpy as np

from mlnlite.ground.network import Float, Int64
from mlnlite.infer.deadline import FOREVER, Deadline
from mlnlite.infer.map.search.landscape import Landscape, holding, landscape_of, missing_of, worth
from mlnlite.infer.reduce.parts import Part, PartAnswer, all_gains, value_of

ANNEALING = "annealing"
_COLDEST = 0.05
_CHUNK = 2_000_000
_MOVES, _PER_VARIABLE, _FEW = 2e7, 20_000, 256


def solve_part(
    part: Part,
    deadline: Deadline = FOREVER,
    seed: int = 0,
    *,
    moves: float | None = None,
    restarts: int | None = None,
    start: Int64 | None = None,
) -> PartAnswer:
    """Searches a component.

    Args:
        part: the component.
        deadline: when to stop.
        seed: of chance.
        moves: how many moves to try in all, by default 20,000 for each variable, but at most 2e7.
        restarts: how often the temperature falls, from the best world so far and from a random one in turn; by default
            4 times, and more often for few variables, where walls of hard formulas are all that keeps from the best.
        start: shape (n,), a world to start from.
    """
    rng, landscape = np.random.default_rng(seed), landscape_of(part)
    n = len(part.variables)
    restarts = restarts or max(4, _FEW // n)
    world = np.zeros(n, np.int64) if start is None else start.copy()
    best, top = world.copy(), worth(landscape, world)
    sweeps = max(10, int((moves or min(_MOVES, _PER_VARIABLE * n)) / restarts / n))
    for i in range(restarts):
        random = np.floor(rng.random(n) * part.cardinality).astype(np.int64)
        found, value = _fall(landscape, random if i % 2 else best, temperatures(landscape, sweeps), rng, deadline)
        best, top = (found, value) if value > top else (best, top)
        if deadline.is_over:
            break
    possible = np.isfinite(value_of(part, best))
    return PartAnswer(best if possible else None, all_gains(part), False, ANNEALING)


def temperatures(landscape: Landscape, n_sweeps: int) -> Float:
    """From where the typical move is free to where the smallest one is rare."""
    sizes = np.concatenate([np.abs(landscape.amount[~landscape.hard]), landscape.tallies.move])
    typical = float(sizes[sizes > 0].mean()) if (sizes > 0).any() else 1.0
    return np.asarray(np.geomspace(3 * typical, _COLDEST * typical, n_sweeps))


def _fall(
    landscape: Landscape, begin: Int64, schedule: Float, rng: np.random.Generator, deadline: Deadline
) -> tuple[Int64, float]:
    """One fall of the temperature from a world; returns the best world met and its value."""
    from mlnlite.infer.map.search.annealing_kernel import sweeps

    world, best, value = begin.copy(), begin.copy(), worth(landscape, begin)
    top = value
    missing, state = missing_of(landscape, world), landscape.tallies.states(holding(landscape, world))
    step = max(1, _CHUNK // len(world))
    for at in range(0, len(schedule), step):
        value, top = sweeps(
            landscape.start, landscape.begin, landscape.cell, landscape.amount,
            landscape.tallies.arrays, missing, state, world, best, schedule[at : at + step], value, top, rng,
        )  # fmt: skip
        if deadline.is_over:
            break
    return best, top
