"""Coordinate steps on the multipliers of rows, with the limits of columns smoothed; compiled."""

from __future__ import annotations

import numpy as np

from mlnlite.compiled import compiled


@compiled
def sweep(order, start, column, value, limit, softness, multiplier, gain):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """A damped Newton step on the multiplier of each row `sum value x[column] <= limit`, one after the other.

    What falls is `sum limit multiplier + sum softness log(1 + exp(gain / softness))` over rows and columns: softly,
    what the multipliers prove. A column of some gain stands for `x = 1 / (1 + exp(-gain / softness))`.

    Args:
        order: shape (n,), of the rows.
        start: shape (n + 1,), where each row starts.
        column: shape (m,).
        value: shape (m,).
        limit: shape (n,).
        softness: how large a gain counts as none.
        multiplier: shape (n,), 0 or more; changed in place.
        gain: shape (n_columns,), of each column less what the multipliers take; kept up to date.
    """
    for row in order:
        slope, curve = limit[row], 1e-9
        for i in range(start[row], start[row + 1]):
            x = 1 / (1 + np.exp(-gain[column[i]] / softness))
            slope -= value[i] * x
            curve += value[i] * value[i] * x * (1 - x) / softness
        step = max(min(-slope / curve, softness), -softness, -multiplier[row])
        if step != 0:
            multiplier[row] += step
            for i in range(start[row], start[row + 1]):
                gain[column[i]] -= step * value[i]
