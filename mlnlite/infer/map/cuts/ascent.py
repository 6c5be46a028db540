"""Bounds from very many rows without a solver: comes in a program with a solution, go out rows and their multipliers.

What multipliers prove is improved one multiplier at a time. Left as it is, that gets stuck far from the best bound; so
the kink in each column is smoothed, and sharpened slowly. Violated stars are added all the while, by the solution that
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
_SWEEPS, _DROP_EVERY = 5, 5
_VIOLATED, _FEW = 0.1, 0.01


@dataclass(slots=True)
class Ascent:
    """Where an ascent stands.

    Attributes:
        gain: shape (n_columns,), by which each column would raise the log-weight, less what multipliers take from it.
        softness: how large a gain counts as none.
        multiplier: of the rows, 0 or more.
    """

    gain: Float
    softness: float
    multiplier: Float = field(default_factory=lambda: np.zeros(0))

    @property
    def x(self) -> Float:
        """The solution that the smooth problem implies."""
        return np.asarray(expit(self.gain / self.softness))


def ascend(
    rows: Rows, clauses: GroundClauses, weights: Float, gain: Float, seed: int, is_enough: Callable[[float], bool]
) -> Float:
    """Adds stars as rows, to lower a bound.

    Args:
        rows: none so far; filled in here.
        clauses: those that may be violated.
        weights: of the network.
        gain: shape (n_columns,), by which each column would raise the log-weight.
        seed: of the order of steps.
        is_enough: asked each round, with the amount by which the bound is lower by now.

    Returns:
        Multipliers of the rows, 0 or more.
    """
    top, rng = float(np.maximum(gain, 0.0).sum()), np.random.default_rng(seed)
    price, paid = weights[clauses.weight] * clauses.count, np.full(len(clauses), -1, np.int64)
    graph = graph_of(clauses, (gain > 0) / 2, -price)
    typical = top / max(1, (gain > 0).sum())
    now, n_rounds = Ascent(gain, _SOFTEST * typical), 0
    while len(graph.clause) and now.softness > _SHARPEST * typical:
        x = now.x
        unpaid = expit(-price / now.softness)
        found = stars(graph, excuses(clauses, graph, x) + np.where(paid >= 0, x[paid], unpaid), x, _VIOLATED)
        paid = np.maximum(paid, add_stars(rows, found, clauses, weights))
        _sweep(rows, now, rng)
        if is_enough(top - float(np.maximum(now.gain, 0.0).sum() + rows.limit @ now.multiplier)):
            break
        now.softness *= _SLOWLY if len(found.above) > _FEW * len(rows) else _QUICKLY
        n_rounds += 1
        if n_rounds % _DROP_EVERY == 0:
            _drop(rows, now)
    _drop(rows, now)
    return now.multiplier


def _sweep(rows: Rows, now: Ascent, rng: np.random.Generator) -> None:
    """Some steps for each row, new ones included."""
    from mlnlite.infer.map.cuts.ascent_kernel import sweep

    now.multiplier = np.append(now.multiplier, np.zeros(len(rows) - len(now.multiplier)))
    now.gain = np.append(now.gain, -np.array(rows.cost[len(now.gain) - rows.first :]))
    for _ in range(_SWEEPS):
        order = rng.permutation(len(rows))
        sweep(order, rows.start, rows.column, rows.value, rows.limit, now.softness, now.multiplier, now.gain)


def _drop(rows: Rows, now: Ascent) -> None:
    """Drops the rows that count for nothing."""
    keep = now.multiplier > 0
    retain(rows, keep)
    now.multiplier = now.multiplier[keep]
