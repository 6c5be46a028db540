"""Bounds from very many rows without a solver: come in gains of columns, go out rows and their multipliers.

What multipliers prove is improved one multiplier at a time. Left as it is, that gets stuck far from the best bound; so
the kink in each column is smoothed, and sharpened slowly. Violated rows are added all the while, by the solution that
the smooth problem implies. (Nesterov, Smooth minimization of non-smooth functions, Mathematical Programming 2005;
coordinate steps as in Globerson and Jaakkola, Fixing max-product, NIPS 2007.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.special import expit

from mlnlite.ground.network import Float
from mlnlite.infer.map.cuts.rows import Rows, add_stars, retain
from mlnlite.infer.map.cuts.separation import GroundClauses, excuses, graph_of, stars

_SOFTEST, _SHARPEST, _SLOWLY, _QUICKLY = 0.25, 1e-3, 0.95, 0.8
_DROP_EVERY, _FEW, _VIOLATED = 5, 0.01, 0.1

Separate = Callable[[Float, float], int]
"""Adds rows that a solution violates, given it and the softness that it is for; returns how many."""


@dataclass(slots=True)
class _Ascent:
    """Where an ascent stands.

    Attributes:
        gain: shape (n_columns,), by which each column would raise the log-weight, less what multipliers take from it.
        softness: how large a gain counts as none.
        multiplier: of the rows, 0 or more.
    """

    gain: Float
    softness: float
    multiplier: Float = field(default_factory=lambda: np.zeros(0))


def ascend(
    rows: Rows, gain: Float, separate: Separate, is_enough: Callable[[float], bool], *, seed: int, sweeps: int
) -> Float:
    """Adds rows, to lower a bound.

    Args:
        rows: none so far; filled in here.
        gain: shape (n_columns,), by which each column (between 0 and 1) would raise the log-weight.
        separate: what adds rows.
        is_enough: asked each round, with the amount by which the bound is lower by now.
        seed: of the order of steps.
        sweeps: steps for each row in a round.

    Returns:
        Multipliers of the rows, 0 or more.
    """
    rng, top = np.random.default_rng(seed), float(np.maximum(gain, 0.0).sum())
    typical = top / max(1, (gain > 0).sum())
    now, n_rounds = _Ascent(gain, _SOFTEST * typical), 0
    while now.softness > _SHARPEST * typical:
        n_added = separate(expit(now.gain / now.softness), now.softness)
        _sweep(rows, now, rng, sweeps)
        if is_enough(top - float(np.maximum(now.gain, 0.0).sum() + rows.limit @ now.multiplier)):
            break
        now.softness *= _SLOWLY if n_added > _FEW * len(rows) else _QUICKLY
        n_rounds += 1
        if n_rounds % _DROP_EVERY == 0:
            _drop(rows, now)
    _drop(rows, now)
    return now.multiplier


def _sweep(rows: Rows, now: _Ascent, rng: np.random.Generator, times: int) -> None:
    """Some steps for each row, new ones included."""
    from mlnlite.infer.map.cuts.ascent_kernel import sweep

    now.multiplier = np.append(now.multiplier, np.zeros(len(rows) - len(now.multiplier)))
    now.gain = np.append(now.gain, -np.array(rows.cost[len(now.gain) - rows.first :]))
    for _ in range(times):
        order = rng.permutation(len(rows))
        sweep(order, rows.start, rows.column, rows.value, rows.limit, now.softness, now.multiplier, now.gain)


def _drop(rows: Rows, now: _Ascent) -> None:
    """Drops the rows that count for nothing."""
    keep = now.multiplier > 0
    retain(rows, keep)
    now.multiplier = now.multiplier[keep]


def star_finder(rows: Rows, clauses: GroundClauses, weights: Float, x: Float) -> Separate:
    """Separates stars of some clauses.

    Args:
        rows: where to add them.
        clauses: those that may be violated.
        weights: of the network.
        x: shape (n_columns,), a solution to begin with.
    """
    price, paid = weights[clauses.weight] * clauses.count, np.full(len(clauses), -1, np.int64)
    graph = graph_of(clauses, x, -price)

    def separate(x: Float, softness: float) -> int:
        unpaid = np.where(paid >= 0, x[paid], expit(-price / softness))
        found = stars(graph, excuses(clauses, graph, x) + unpaid, x, _VIOLATED)
        np.maximum(paid, add_stars(rows, found, clauses, weights), out=paid)
        return len(found.above)

    return separate
