"""Best worlds by minimum cuts: comes in a component of pairs that attract, goes out a world with a flow that proves it.

A component whose cells have at most two literals, over atoms only, is a quadratic function of 0/1 variables. If some
of them can be flipped so that every product then has a positive sign, the best world is a minimum cut (Hammer 1965;
Greig, Porteous and Seheult 1989; Kolmogorov and Zabih, What energy functions can be minimized via graph cuts?, 2004).
Amounts become integers, `amount * scale` rounded; sums are exact, and the bound says what the rounding may have lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.deadline import FOREVER, Deadline
from mlnlite.infer.reduce.conjunctions import distinct, summed
from mlnlite.infer.reduce.parts import Part, PartAnswer, value_of

MINCUT = "mincut"
_DIGITS = 12
_LARGEST = 2.0**60
_CLOSE = 1e-9
_PATHS = 50_000


@dataclass(frozen=True, slots=True)
class Quadratic:
    """`(linear . x + sum product x[first] x[second]) / (2 scale)`, up to a constant, over variables 0 and 1.

    Attributes:
        linear: shape (n,).
        first: shape (m,), smaller than `second`, each pair once.
        second: shape (m,).
        product: shape (m,), even.
        scale: integers stand for that many times the amounts.
        error: what rounding may have changed the difference of two worlds by.
        close: whether that is next to nothing.
    """

    linear: Int64
    first: Int64
    second: Int64
    product: Int64
    scale: float
    error: float
    close: bool


@dataclass(frozen=True, slots=True)
class Cut:
    """A proof: no cut is smaller than a flow, and this one is as large.

    Attributes:
        source_side: shape (n,), which nodes the source still reaches.
        capacity: of the arcs that lead from those nodes to the others.
        flow: value of the flow.
    """

    source_side: Bool
    capacity: int
    flow: int


def quadratic(part: Part) -> Quadratic | None:
    """A component as a quadratic function; None if it has cells of three literals, counting factors or blocks.

    What is forbidden costs more than everything else together.
    """
    if part.chains or any(c.scope.shape[1] > 2 for c in part.cells) or (part.cardinality > 2).any():
        return None
    n, amounts = len(part.variables), np.concatenate([np.zeros(0), *(c.amount for c in part.cells)])
    soft = np.isfinite(amounts)
    worth = float(np.abs(amounts[soft]).sum())
    never = -2 * np.ceil(worth) - 1
    scale = _scale(np.where(soft, amounts, never))
    linear = np.zeros(n, np.int64)
    first = second = product = np.zeros(0, np.int64)
    for c in part.cells:
        whole = 2 * np.rint(np.maximum(c.amount, never) * scale).astype(np.int64)
        if c.scope.shape[1] == 1:
            np.add.at(linear, c.scope[:, 0], np.where(c.value[:, 0] == 1, whole, -whole))
            continue
        for own, other in ((0, 1), (1, 0)):
            alone = np.where(c.value[:, other] == 0, whole, 0)
            np.add.at(linear, c.scope[:, own], np.where(c.value[:, own] == 1, alone, -alone))
        signed = np.where(c.value[:, 0] == c.value[:, 1], whole, -whole)
        key, product = summed(c.scope[:, 0].astype(np.int64) * n + c.scope[:, 1], signed)
        first, second = np.divmod(key[product != 0], n)
        product = product[product != 0]
    error = float(np.abs(np.rint(amounts[soft] * scale) / scale - amounts[soft]).sum())
    return Quadratic(linear, first, second, product, scale, error, error <= _CLOSE * worth)


def _scale(amounts: Float) -> float:
    """The smallest power of ten that makes all amounts integers, or the largest one that is safe."""
    room = int(np.floor(np.log10(_LARGEST / max(1.0, 4 * float(np.abs(amounts).sum())))))
    kinds = distinct(amounts)
    for digits in range(min(room, _DIGITS)):
        shifted = kinds * 10.0**digits
        if (np.abs(shifted - np.rint(shifted)) <= _CLOSE).all():
            return 10.0**digits
    return float(10.0 ** min(room, _DIGITS))


def flips(function: Quadratic) -> Bool | None:
    """Which variables to flip so that every product is positive; None if there is no such choice.

    A pair with a negative product has to be flipped on one side, any other one on both or none: a 2-colouring.
    """
    n = len(function.linear)
    repels = function.product < 0
    if not repels.any():
        return np.zeros(n, np.bool_)
    a, b = function.first, function.second
    start, end = np.concatenate([a, a + n]), np.concatenate([np.where(repels, b + n, b), np.where(repels, b, b + n)])
    graph = coo_matrix((np.ones(len(start), np.int8), (start, end)), shape=(2 * n, 2 * n))
    _, label = connected_components(graph, directed=False)
    if (label[:n] == label[n:]).any():
        return None
    return np.asarray(label[:n] > label[n:])


def flipped(function: Quadratic, flip: Bool) -> Quadratic:
    """The function of the variables of which some are flipped (up to a constant)."""
    a, b, sign = function.first, function.second, np.where(flip, -1, 1)
    linear = function.linear * sign
    # x = 1 - y: q x_a x_b = q x_a - q x_a y_b, so a flipped end gives its partner the product as a linear term
    np.add.at(linear, a, np.where(flip[b], function.product, 0) * sign[a])
    np.add.at(linear, b, np.where(flip[a], function.product, 0) * sign[b])
    return replace(function, linear=linear, product=function.product * sign[a] * sign[b])


def solve_part(part: Part, deadline: Deadline = FOREVER) -> PartAnswer | None:
    """Solves a component, or says by None that it is of another kind.

    Args:
        part: the component.
        deadline: when to stop; what flows by then is the bound.
    """
    function = quadratic(part)
    flip = None if function is None else flips(function)
    if function is None or flip is None:
        return None
    cut = minimum_cut(flipped(function, flip), deadline)
    world = (cut.source_side != flip).astype(np.int64)
    value, proved = value_of(part, world), cut.flow == cut.capacity and function.close
    if np.isneginf(value):
        return PartAnswer(None, np.inf, False, MINCUT)
    missing = (cut.capacity - cut.flow) / (2 * function.scale)
    return PartAnswer(world, value + missing + function.error, proved, MINCUT)


def minimum_cut(function: Quadratic, deadline: Deadline = FOREVER) -> Cut:
    """The world that makes a function with positive products largest: those on the source's side are 1.

    `q x_a x_b = q (x_a + x_b) / 2 - q (x_a (1 - x_b) + x_b (1 - x_a)) / 2`: an arc of capacity q / 2 each way.
    """
    from mlnlite.infer.map.flow_kernel import arcs, greedy, push, seeds

    half = function.product // 2
    terminal = function.linear.copy()
    np.add.at(terminal, function.first, half)
    np.add.at(terminal, function.second, half)
    left = terminal.copy()
    graph = arcs(len(left), function.first, function.second, half)
    node, *queue, at = seeds(left, greedy(*graph, left))
    while at[1] and not deadline.is_over:
        push(*graph, left, node, *queue, at, _PATHS)
    side = node[:, 0] == 1
    leaves = side[function.first] != side[function.second]
    capacity = int(half[leaves].sum()) + int(terminal[(terminal > 0) & ~side].sum())
    capacity += int(-terminal[(terminal < 0) & side].sum())
    return Cut(side, capacity, int(at[3]))
