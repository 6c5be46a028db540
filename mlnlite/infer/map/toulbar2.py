"""Best worlds by toulbar2 (weighted constraint satisfaction), in a process of its own.

Comes in a component as cells, goes out a world, an upper bound and whether the world is proved best.
Costs are integers, `-amount * scale` rounded, so values are known up to half a unit for each cell; bounds allow for it.
"""

from __future__ import annotations

from importlib.util import find_spec
from itertools import pairwise

import numpy as np

from mlnlite.errors import MissingPart
from mlnlite.ground.network import Float
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.narrow import read_back, written
from mlnlite.infer.reduce.parts import Part, PartAnswer
from mlnlite.infer.workers.ask import Ask

WCSP = "wcsp"
_LARGEST_COST = 2.0**50
_FINEST = 9
_LONGEST = 10**6


def is_available() -> bool:
    """Whether toulbar2 is installed."""
    return find_spec("pytoulbar2") is not None


def solve_part(part: Part, ask: Ask, deadline: Deadline, seed: int = 0, *, backtracks: int | None = None) -> PartAnswer:
    """Solves a component.

    Args:
        part: the component.
        ask: what runs the solver.
        deadline: when to stop with the best so far.
        seed: of the solver.
        backtracks: after how many to stop, None for no limit.

    Raises:
        MissingPart: toulbar2 is not installed (there is none for Windows).
    """
    if not is_available():
        raise MissingPart("toulbar2 is not installed", hint="pip install pytoulbar2 (not made for Windows)")
    plain, constant = written(part)
    problem, scale, rounding = _problem(plain)
    left = deadline.left
    problem |= {"seconds": max(1, int(min(left, _LONGEST))), "seed": seed + 1, "backtracks": backtracks}
    reply = ask("_toulbar2_worker", problem, deadline) or {"state": None, "bound": None, "optimal": False}
    world = None if reply["state"] is None else np.array(reply["state"], np.int64)
    bound = np.inf if reply["bound"] is None else -reply["bound"] / scale + rounding
    return read_back(PartAnswer(world, bound, bool(reply["optimal"]), WCSP), part, constant)


def _problem(part: Part) -> tuple[dict[str, object], float, float]:
    """A component as the worker reads it, the scale of its costs, and the largest error that rounding makes."""
    merged = [_merged(c) for c in part.cells if len(c.amount)]
    amounts = np.concatenate([m.amount[np.isfinite(m.amount)] for m in merged] or [np.zeros(0)])
    digits = min(_FINEST, int(np.floor(np.log10(_LARGEST_COST / max(1.0, float(np.abs(amounts).sum()))))))
    scale = 10.0**digits
    functions: list[object] = []
    for m in merged:
        costs = _costs(m.amount, scale)
        edges = np.flatnonzero(np.any(np.diff(m.scope, axis=0) != 0, axis=1)) + 1
        starts = [0, *edges.tolist(), len(m.scope)]
        scopes, values = m.scope.tolist(), m.value.tolist()
        for begin, end in pairwise(starts):
            functions.append([scopes[begin], 0, values[begin:end], costs[begin:end]])
    problem: dict[str, object] = {"cardinality": part.cardinality.tolist(), "functions": functions}
    return problem, scale, float(np.abs(np.rint(amounts * scale) / scale - amounts).sum())


def _costs(amount: Float, scale: float) -> list[int | None]:
    """Integer costs; None for what is forbidden."""
    finite = np.isfinite(amount)
    rounded = np.rint(np.where(finite, -amount * scale, 0)).astype(np.int64).tolist()
    return [cost if ok else None for cost, ok in zip(rounded, finite.tolist(), strict=True)]


def _merged(cells: Cells) -> Cells:
    """Equal cells added up, cells of equal scope next to each other."""
    k = cells.scope.shape[1]
    both, inverse = np.unique(np.hstack([cells.scope, cells.value]), axis=0, return_inverse=True)
    amount = np.zeros(len(both))
    np.add.at(amount, inverse.ravel(), cells.amount)
    return Cells(both[:, :k], both[:, k:], amount)
