"""Best worlds by core-guided MaxSAT (RC2, python-sat): comes in a component, goes out a world and an upper bound.

Ignatiev, Morgado and Marques-Silva, RC2: an efficient MaxSAT solver (JSAT 2019). Weights become integers,
`amount * scale` rounded; the bound allows for that.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from mlnlite.infer.deadline import Deadline
from mlnlite.infer.reduce.conjunctions import starts_of
from mlnlite.infer.reduce.narrow import read_back, written
from mlnlite.infer.reduce.parts import Part, PartAnswer, all_gains
from mlnlite.infer.workers.ask import Ask

MAXSAT = "maxsat"
_LARGEST = 2.0**50
_FINEST = 6


def solve_part(part: Part, ask: Ask, deadline: Deadline) -> PartAnswer:
    """Solves a component.

    Args:
        part: the component.
        ask: what runs the solver.
        deadline: when to give up; RC2 has no world before it is done.
    """
    plain, constant = written(part)
    problem, scale, error = _problem(plain)
    reply = ask("_rc2_worker", problem, deadline)
    if reply is None or reply["state"] is None:
        return PartAnswer(None, all_gains(part), False, MAXSAT)
    first = starts_of(plain.cardinality)
    true = np.zeros(int(plain.cardinality.sum()) + 1, np.bool_)
    state = np.array(reply["state"], np.int64)
    true[[x for x in state[state > 0].tolist() if x < len(true)]] = True
    world = np.array([int(true[b + 1 : b + 1 + k].argmax()) for b, k in zip(first, plain.cardinality, strict=True)])
    answer = PartAnswer(world, all_gains(plain) - reply["cost"] / scale + error, True, MAXSAT)
    return read_back(answer, part, constant)


def _problem(part: Part) -> tuple[dict[str, Any], float, float]:
    """A component as the worker reads it, the scale of its weights, and what rounding may have changed.

    Value k of a variable is literal `first + k + 1`; a cell that costs is the clause of its negated literals, one that
    pays is a new literal that implies all of its own.
    """
    first = starts_of(part.cardinality) + 1
    amounts = np.concatenate([np.zeros(0), *(c.amount[np.isfinite(c.amount)] for c in part.cells)])
    room = np.floor(np.log10(_LARGEST / max(1.0, float(np.abs(amounts).sum()))))
    scale = 10.0 ** min(_FINEST, int(room))
    error = float(np.abs(np.rint(amounts * scale) / scale - amounts).sum())
    hard: list[list[int]] = []
    for begin, size in zip(first.tolist(), part.cardinality.tolist(), strict=True):
        values = list(range(begin, begin + size))
        hard += [values, *([-a, -b] for a, b in combinations(values, 2))]
    soft: list[list[int]] = []
    weights: list[int] = []
    auxiliary = int(part.cardinality.sum())
    for c in part.cells:
        for literals, amount in zip((first[c.scope] + c.value).tolist(), c.amount.tolist(), strict=True):
            weight = 0 if np.isneginf(amount) else round(abs(amount) * scale)
            if np.isneginf(amount):
                hard.append([-x for x in literals])
            elif weight and amount < 0:
                soft.append([-x for x in literals])
                weights.append(weight)
            elif weight:
                auxiliary += 1
                hard += [[-auxiliary, x] for x in literals]
                soft.append([auxiliary])
                weights.append(weight)
    return {"hard": hard, "soft": soft, "weights": weights}, scale, error
