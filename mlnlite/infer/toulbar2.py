"""Best worlds by toulbar2 (weighted constraint satisfaction), in a process of its own.

Comes in components as cells, goes out for each a world, its value, an upper bound and whether it is proved best.
Costs are integers, `-amount * scale` rounded, so values are known up to half a unit for each cell; bounds allow for it.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from threading import Timer
from typing import IO

import numpy as np

from mlnlite.errors import MissingPart
from mlnlite.ground.network import Float
from mlnlite.infer.conjunctions import Cells
from mlnlite.infer.parts import Part, PartAnswer

WCSP = "wcsp"
_LARGEST_COST = 2.0**50
_FINEST = 9
_GRACE = 10.0


def is_available() -> bool:
    """Whether toulbar2 is installed."""
    return find_spec("pytoulbar2") is not None


def solve_parts(parts: Sequence[Part], time_limit: float | None = None, seed: int = 0) -> list[PartAnswer]:
    """Solves components one after the other.

    Args:
        parts: the components.
        time_limit: [s] for all of them together; each gets an equal share of what is left.
        seed: of the solver.

    Raises:
        MissingPart: toulbar2 is not installed (there is none for Windows).
    """
    if not is_available():
        raise MissingPart("toulbar2 is not installed", hint="pip install pytoulbar2 (not made for Windows)")
    end = None if time_limit is None else time.monotonic() + time_limit
    answers = []
    with _worker(time_limit) as (to_worker, from_worker):
        for i, part in enumerate(parts):
            problem, scale, rounding = _problem(part)
            left = 0 if end is None else max(1, int((end - time.monotonic()) / (len(parts) - i)))
            problem |= {"seconds": left, "seed": seed + 1}
            try:
                to_worker.write(json.dumps(problem) + "\n")
                to_worker.flush()
                line = from_worker.readline()
            except BrokenPipeError:
                line = ""
            answers.append(_answer(line, scale, rounding))
    return answers


@contextmanager
def _worker(time_limit: float | None) -> Iterator[tuple[IO[str], IO[str]]]:
    """A running worker: its input and its output. It is ended well after the time limit if it does not stop itself."""
    command = [sys.executable, "-P", str(Path(__file__).with_name("_toulbar2_worker.py"))]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        timer = None if time_limit is None else Timer(2 * time_limit + _GRACE, process.kill)
        if timer:
            timer.start()
        try:
            yield process.stdin, process.stdout
        finally:
            if timer:
                timer.cancel()
            process.kill()


def _answer(line: str, scale: float, rounding: float) -> PartAnswer:
    """The worker's line, scaled back; an empty one if the worker had to be ended."""
    reply = json.loads(line) if line else {"state": None, "bound": None, "optimal": False}
    world = None if reply["state"] is None else np.array(reply["state"], np.int64)
    bound = np.inf if reply["bound"] is None else -reply["bound"] / scale + rounding
    return PartAnswer(world, bound, bool(reply["optimal"]), WCSP)


def _problem(part: Part) -> tuple[dict[str, object], float, float]:
    """A component as the worker reads it, the scale of its costs, and the largest error that rounding makes."""
    merged = [_merged(c) for c in part.cells]
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
    return problem, scale, 0.5 * len(amounts) / scale


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
