"""Loopy belief propagation: comes in a component, go out approximate distributions and whether messages settled.

Messages go between variables and the tables of their cells, all at once and damped, until beliefs stop changing
(Pearl 1988; Murphy, Weiss and Jordan, Loopy belief propagation for approximate inference, UAI 1999). Exact on trees;
on anything else nobody knows how far off it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlnlite.errors import LimitReached
from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.reduce.conjunctions import starts_of
from mlnlite.infer.reduce.fill import Placed, fill
from mlnlite.infer.reduce.narrow import narrowed
from mlnlite.infer.reduce.parts import Part, Summed

LOOPY = "loopy belief propagation"
_DAMPING, _CLOSE, _MOST = 0.5, 1e-7, 2000
_LARGEST = 1 << 24
_NEVER = -1e4


@dataclass(frozen=True, slots=True)
class _Group:
    """Tables of equal shape.

    Attributes:
        place: for each axis an array of shape (n, size), where the values of the variable there stand among all.
        table: shape (n, *sizes), log-potentials.
        message: for each axis shape (n, size), from the table to the variable, changed from round to round.
    """

    place: list[Int64]
    table: Float
    message: list[Float]


def propagate_beliefs(part: Part, wanted: Bool) -> Summed:
    """Approximate distributions of a component.

    Args:
        part: the component.
        wanted: shape (n,), whose distribution to return.

    Returns:
        Distributions; no log Z. The method says so if the messages have not settled.

    Raises:
        LimitReached: a table is too large.
    """
    part = narrowed(part)
    start = starts_of(part.cardinality)
    own, groups = _groups(part, start)
    owner = np.repeat(np.arange(len(start)), part.cardinality)
    before, change = _normalised(own, start, owner), np.inf
    belief = before
    for _ in range(_MOST):
        for group in groups:
            _send(group, belief)
        belief = own.copy()
        for group in groups:
            for place, message in zip(group.place, group.message, strict=True):
                np.add.at(belief, place, message)
        now = _normalised(belief, start, owner)
        before, change = now, float(np.abs(np.exp(now) - np.exp(before)).max())
        if change < _CLOSE:
            break
    distribution = np.exp(before)
    found = {v: distribution[start[v] : start[v] + part.cardinality[v]] for v in np.flatnonzero(wanted).tolist()}
    return Summed(np.nan, found, LOOPY if change < _CLOSE else f"{LOOPY}, not settled", exact=False)


def _normalised(belief: Float, start: Int64, owner: Int64) -> Float:
    """Beliefs as log-probabilities."""
    shifted = belief - np.maximum.reduceat(belief, start)[owner]
    return np.asarray(shifted - np.log(np.add.reduceat(np.exp(shifted), start))[owner])


def _send(group: _Group, belief: Float) -> None:
    """New messages from all tables of a group."""
    n, k = len(group.table), group.table.ndim - 1
    come = [belief[place] - message for place, message in zip(group.place, group.message, strict=True)]
    total = group.table
    for axis, incoming in enumerate(come):
        total = total + incoming.reshape(n, *(-1 if a == axis else 1 for a in range(k)))
    for axis in range(k):
        flat = np.moveaxis(total, axis + 1, 1).reshape(n, total.shape[axis + 1], -1)
        peak = flat.max(axis=2)
        out = peak + np.log(np.exp(flat - peak[:, :, None]).sum(axis=2)) - come[axis]
        out = np.maximum(out - out.max(axis=1, keepdims=True), _NEVER)
        group.message[axis] = _DAMPING * group.message[axis] + (1 - _DAMPING) * out


def _groups(part: Part, start: Int64) -> tuple[Float, list[_Group]]:
    """What each value gains by itself, and the tables of all sets of variables that share cells."""
    own, groups = np.zeros(int(part.cardinality.sum())), []
    for c in part.cells:
        if c.scope.shape[1] == 1:
            np.add.at(own, start[c.scope[:, 0]] + c.value[:, 0], np.maximum(c.amount, _NEVER))
            continue
        scopes, which = np.unique(c.scope, axis=0, return_inverse=True)
        sizes, kind = np.unique(part.cardinality[scopes], axis=0, return_inverse=True)
        for i, shape in enumerate(sizes.tolist()):
            members = np.flatnonzero(kind.ravel() == i)
            if len(members) * float(np.prod(shape)) > _LARGEST:
                raise LimitReached(f"a formula over {len(shape)} atoms is too wide for belief propagation")
            rows = np.flatnonzero(np.isin(which.ravel(), members))
            table = np.searchsorted(members, which.ravel()[rows])
            axis = np.broadcast_to(np.arange(len(shape)), (len(rows), len(shape)))
            cells = Placed(table, axis, c.value[rows].astype(np.int64), c.amount[rows])
            potentials = np.maximum(fill(len(members), shape, [cells]), _NEVER)
            place = [start[scopes[members, a], None] + np.arange(k) for a, k in enumerate(shape)]
            groups.append(_Group(place, potentials, [np.zeros(p.shape) for p in place]))
    return own, groups
