"""Functions of a count as rows of an integer program: pieces of equal slope that are filled one after the other.

Where slopes rise (a convex cost) the cheapest pieces are filled first by themselves, so columns between 0 and their
length will do. Where they fall, a binary column says whether the pieces before are full (the incremental model:
Markowitz and Manne, On the solution of discrete programming problems, 1957); counts that are forbidden are jumped over.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32, Int64

_SAME = 1e-12


@dataclass(frozen=True, slots=True)
class Pieces:
    """A cost of a count.

    Attributes:
        first: the smallest count that is possible.
        cost: of that.
        length: shape (n,), of the pieces that follow.
        slope: shape (n,), cost of one more.
        jump: shape (n,), whether a piece is full or empty, because counts in it are forbidden.
        run: shape (n,), pieces of equal number are filled in any order, rising numbers in that order.
    """

    first: int
    cost: float
    length: Float
    slope: Float
    jump: Bool
    run: Int64


def pieces_of(worth: Float, steps: Int32) -> Pieces | None:
    """The cost, less the worth, of a count; None if no count is possible.

    Args:
        worth: shape (sum of steps + 1,), minus infinity forbids a count.
        steps: shape (m,), what the literals add to the count.
    """
    possible = np.zeros(len(worth), np.bool_)
    possible[0] = True
    for step in steps.tolist():
        possible[step:] |= possible[:-step].copy()
    points = np.flatnonzero(possible & np.isfinite(worth))
    if not len(points):
        return None
    n_forbidden = np.cumsum(possible & ~np.isfinite(worth))
    length, jump = np.diff(points), np.diff(n_forbidden[points]) > 0
    slope = -np.diff(worth[points]) / length
    new = np.ones(len(slope), np.bool_)
    new[1:] = (np.abs(np.diff(slope)) > _SAME) | jump[1:] | jump[:-1]
    starts = np.flatnonzero(new)
    length = np.add.reduceat(length, starts).astype(float) if len(starts) else length.astype(float)
    slope, jump = slope[starts], jump[starts]
    falls = np.zeros(len(slope), np.int64)
    falls[1:] = (np.diff(slope) < 0) | jump[1:] | jump[:-1]
    return Pieces(int(points[0]), -float(worth[points[0]]), length, slope, jump, np.cumsum(falls))
