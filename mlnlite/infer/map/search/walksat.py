"""Good worlds by MaxWalkSAT with restarts and tabu: comes in a component, goes out the best world seen (no proof).

Kautz, Selman and Jiang, A general stochastic approach to solving problems with hard and soft constraints (1997).
"""

from __future__ import annotations

import numpy as np

from mlnlite.ground.network import Int64
from mlnlite.infer.deadline import FOREVER, Deadline
from mlnlite.infer.map.search.landscape import Landscape, holding, landscape_of, missing_of, worth
from mlnlite.infer.reduce.parts import Part, PartAnswer, all_gains, value_of

MAXWALKSAT = "maxwalksat"
_NOISE, _TABU, _CHUNK = 0.1, 5, 100_000


def solve_part(
    part: Part, deadline: Deadline = FOREVER, seed: int = 0, *, steps: int = 1_000_000, restarts: int = 3
) -> PartAnswer:
    """Searches a component.

    Args:
        part: the component.
        deadline: when to stop.
        seed: of chance.
        steps: how many variables to change in all.
        restarts: how often to start from a random world (the first time from all zero).
    """
    rng, landscape = np.random.default_rng(seed), landscape_of(part)
    best, top = np.zeros(len(part.variables), np.int64), -np.inf
    for i in range(restarts):
        random = np.floor(rng.random(len(best)) * part.cardinality).astype(np.int64)
        world = random if i else np.zeros_like(best)
        found, value = _from(landscape, world, steps // restarts, rng, deadline)
        if value > top:
            best, top = found, value
        if deadline.is_over:
            break
    possible = np.isfinite(value_of(part, best))
    return PartAnswer(best if possible else None, all_gains(part), False, MAXWALKSAT)


def _from(
    landscape: Landscape, world: Int64, steps: int, rng: np.random.Generator, deadline: Deadline
) -> tuple[Int64, float]:
    """Walks from a world; returns the best one seen and its value."""
    from mlnlite.infer.map.search.walksat_kernel import walk

    tallies, holds, missing = landscape.tallies, holding(landscape, world), missing_of(landscape, world)
    pays = np.concatenate([(missing == 0) != (landscape.amount < 0), tallies.gains(holds) >= tallies.most])
    costs = np.flatnonzero(~pays)
    unpaid, place = np.zeros(len(pays), np.int64), np.full(len(pays), -1, np.int64)
    unpaid[: len(costs)], place[costs] = costs, np.arange(len(costs))
    owner = np.repeat(np.arange(len(world)), np.diff(landscape.start))
    best, last, n_unpaid = world.copy(), np.full(len(world), -_TABU - 1, np.int64), len(costs)
    value, top, state = worth(landscape, world), worth(landscape, world), tallies.states(holds)
    first = np.concatenate([landscape.first, landscape.first[-1] + tallies.first[1:]])
    literal = np.concatenate([landscape.literal, tallies.mover])
    for now in range(0, steps, _CHUNK):
        n_unpaid, value, top = walk(
            landscape.start, landscape.begin, landscape.cell, first, literal, landscape.amount, tallies.arrays,
            owner, missing, state, world, best, unpaid, place, last, n_unpaid, min(_CHUNK, steps - now), _NOISE, _TABU,
            now, value, top, rng,
        )  # fmt: skip
        if deadline.is_over or not n_unpaid:
            break
    return best, top
