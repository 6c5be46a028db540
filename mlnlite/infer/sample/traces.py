"""What chains left behind, in bounded memory: when the room is full, neighbours are averaged and batches get longer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlnlite.ground.network import Float, Float32

ROOM = 1 << 25
MOST = 512


@dataclass(slots=True)
class Traces:
    """Series of means, and of single draws.

    Attributes:
        means: shape (n_chains, capacity, n_columns), mean of each batch of draws.
        points: shape (n_chains, capacity, n_points), the last draw of each batch.
        squares: shape (n_columns,), sum of squared draws.
        n: batches in use.
        batch: draws in each.
        n_draws: of one chain, all together.
    """

    means: Float32
    points: Float
    squares: Float
    n: int = 0
    batch: int = 1
    n_draws: int = 0

    @property
    def kept(self) -> slice:
        """The batches that count: without the first tenth, in which chains may still remember where they started."""
        return slice(self.n // 10, self.n)

    @property
    def draw_variance(self) -> Float:
        """Shape (n_columns,), variance of single draws."""
        used = self.means[:, : self.n]
        mean = used.mean(axis=(0, 1), dtype=float)
        count = len(self.means) * self.n_draws
        return np.asarray(np.maximum(self.squares / max(count, 1) - mean**2, used.var(axis=(0, 1), dtype=float)))


def new_traces(n_chains: int, n_columns: int, n_points: int) -> Traces:
    """Room for traces."""
    room = ROOM // max(1, n_chains * n_columns)
    capacity = max(64, min(MOST, 1 << max(room, 1).bit_length() - 1))
    means = np.empty((n_chains, capacity, n_columns), np.float32)
    return Traces(means, np.empty((n_chains, capacity, n_points)), np.zeros(n_columns))


def make_room(traces: Traces) -> None:
    """Averages neighbours if all batches are in use."""
    if traces.n < traces.means.shape[1]:
        return
    half = traces.n // 2
    traces.means[:, :half] = (traces.means[:, 0::2] + traces.means[:, 1::2]) / 2
    traces.points[:, :half] = traces.points[:, 1::2]
    traces.n, traces.batch = half, 2 * traces.batch
