"""Best worlds of frustrated pairs by odd cycles: comes in a component of atoms in pairs, goes out a world and a bound.

A column says for each pair whether its atoms differ. Around a cycle an even number of pairs differ, so that for an odd
set F of its pairs `sum in F - sum of the others <= |F| - 1`. Which of these inequalities a fractional solution
violates, shortest paths tell in a graph with two copies of each atom. (Barahona and Mahjoub, On the cut polytope,
Mathematical Programming 1986; an atom's own weight is a pair with one more atom that is always false.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.map import ilp, relaxation
from mlnlite.infer.map.cuts.rows import Rows, append, drop_slack, least_used, with_rows
from mlnlite.infer.map.ilp import Columns, Program
from mlnlite.infer.map.mincut import quadratic
from mlnlite.infer.reduce.parts import Part, PartAnswer, all_gains, grain_of, value_of

CYCLES = "odd cycles"
_VIOLATED, _NOTHING, _ABSOLUTE = 1e-3, 1e-9, 1e-6
_ROUNDS, _LEAST_GAIN, _STALLED, _NEARLY = 60, 0.02, 4, 1e-2
_PER_COLUMN = 6
FOREVER = Deadline()


@dataclass(frozen=True, slots=True)
class Pairs:
    """A component as pairs: columns are atoms, then pairs; pair e differs by column e.

    Attributes:
        part: the component.
        n: number of atoms; atom n is one that is always false.
        first: shape (n + n_pairs,), first atom of each column's pair: those with atom n, then those of the component.
        second: shape (n + n_pairs,).
        program: what it costs that pairs differ, and for each pair that it agrees with its atoms' own columns.
        columns: of the atoms.
        error: what rounding may have changed the difference of two worlds by.
    """

    part: Part
    n: int
    first: Int64
    second: Int64
    program: Program
    columns: Columns
    error: float


def pairs_of(part: Part) -> Pairs | None:
    """A component as pairs; None if it is not of that kind."""
    function = quadratic(part)
    if function is None or any(np.isneginf(c.amount).any() for c in part.cells):
        return None
    n, m = len(part.variables), len(function.first)
    product = function.product / (2 * function.scale)
    own = function.linear / (2 * function.scale)
    np.add.at(own, function.first, product / 2)
    np.add.at(own, function.second, product / 2)
    nothing = value_of(part, np.zeros(n, np.int64))
    program = Program([np.concatenate([-own, product / 2])], [np.ones(n + m)], n + m, offset=all_gains(part) - nothing)
    three = np.stack([function.first, function.second, n + np.arange(m)], axis=1)
    for signs, limit in (((-1, -1, 1), 0), ((1, -1, -1), 0), ((-1, 1, -1), 0), ((1, 1, 1), 2)):
        ilp.add_rows(program, three, np.tile(np.array(signs, float), (m, 1)), np.full(m, float(limit)))
    first = np.concatenate([np.full(n, n), function.first])
    second = np.concatenate([np.arange(n), function.second])
    columns = Columns(np.arange(n), np.ones(n, np.bool_), n)
    return Pairs(part, n, first, second, program, columns, function.error)


def solve_part(
    part: Part, deadline: Deadline = FOREVER, seed: int = 0, *, gap: float = 0.0, start: Int64 | None = None
) -> PartAnswer | None:
    """Solves a component, or says by None that it is of another kind.

    Args:
        part: the component.
        deadline: when to stop with the best so far.
        seed: of the solver.
        gap: stop when no world can be better than this share of the cost of the best one.
        start: shape (n,), a good world.
    """
    pairs = pairs_of(part)
    if pairs is None:
        return None
    best = np.zeros(pairs.n, np.int64) if start is None else start
    rows, grain = Rows(pairs.program.n_columns), grain_of([c.amount for c in part.cells])
    best, bound = _relax(pairs, rows, best, (grain, gap), deadline)
    if not deadline.is_over and not _is_enough(part, best, bound, (grain, gap)):
        program = with_rows(pairs.program, rows)
        answer, _ = ilp.solve_program(program, pairs.columns, part, deadline, seed, gap=gap, start=best)
        bound = min(bound, answer.bound)
        best = best if answer.world is None or value_of(part, answer.world) < value_of(part, best) else answer.world
    value = value_of(part, best)
    if bound - value < max(grain, _ABSOLUTE):
        return PartAnswer(best, value + pairs.error, True, CYCLES)
    return PartAnswer(best, bound + pairs.error, False, CYCLES)


def _is_enough(part: Part, best: Int64, bound: float, enough: tuple[float, float]) -> bool:
    """Whether a world is proved, or close enough."""
    value, (grain, gap) = value_of(part, best), enough
    return bound - value < max(grain, _ABSOLUTE, gap * (all_gains(part) - value))


def _relax(
    pairs: Pairs, rows: Rows, best: Int64, enough: tuple[float, float], deadline: Deadline
) -> tuple[Int64, float]:
    """Linear programs, until no cycle is violated or little is gained; the best world met, and the bound."""
    part, bound, exact, n_same = pairs.part, np.inf, False, 0
    for _ in range(_ROUNDS):
        x, multipliers, least = relaxation.solve_program(part, with_rows(pairs.program, rows), deadline, exact=exact)
        if x is None:
            break
        before, bound = bound, min(bound, least)
        rounded = (x[: pairs.n] > 0.5).astype(np.int64)
        best = max(best, rounded, key=lambda world: value_of(part, world))
        if deadline.is_over or _is_enough(part, best, bound, enough):
            break
        drop_slack(rows, x, multipliers[pairs.program.n_rows :])
        n_rows = len(rows)
        _separate(pairs, rows, x)
        n_same = n_same + 1 if before - bound < _LEAST_GAIN * (bound - value_of(part, best)) else 0
        if n_same == _STALLED or (exact and len(rows) == n_rows):
            break
        exact = len(rows) == n_rows or bound - value_of(part, best) < _NEARLY * (all_gains(part) - bound)
    return best, bound


def _separate(pairs: Pairs, rows: Rows, x: Float) -> None:
    """Adds the inequalities of the shortest violated cycles through each atom."""
    found = violated_cycles(pairs, np.clip(x, 0.0, 1.0))
    length = np.array([len(c) for c, _ in found], np.int64)
    start = np.concatenate([[0], np.cumsum(length)])
    flat = np.concatenate([np.zeros(0, np.int64), *(c for c, _ in found)])
    taken = least_used(np.arange(len(found)), start, flat, len(x), _PER_COLUMN)
    for (columns, odd), take in zip(found, taken.tolist(), strict=True):
        if take:
            append(rows, columns[None], np.where(odd, 1.0, -1.0)[None], np.array([odd.sum() - 1.0]))


def violated_cycles(pairs: Pairs, x: Float) -> list[tuple[Int64, Bool]]:
    """For atoms on a violated cycle the worst one: its columns, and which of them are in the odd set; worst first.

    Args:
        pairs: the component.
        x: shape (n_columns,), between 0 and 1.
    """
    n = pairs.n + 1
    a, b = pairs.first, pairs.second
    start, end = np.concatenate([a, a + n, a, a + n]), np.concatenate([b, b + n, b + n, b])
    length = np.concatenate([x, x, 1 - x, 1 - x]) + _NOTHING
    graph = coo_array((length, (start, end)), shape=(2 * n, 2 * n)).tocsr()
    distance, previous = dijkstra(
        graph, directed=False, indices=np.arange(n), limit=1 - _VIOLATED, return_predecessors=True
    )
    around = distance[np.arange(n), np.arange(n) + n]
    key = np.concatenate([a * n + b, b * n + a])
    order = np.argsort(key)
    found: dict[bytes, tuple[Int64, Bool]] = {}
    for v in np.argsort(around, kind="stable")[: np.isfinite(around).sum()].tolist():
        nodes = [v + n]
        while nodes[-1] != v:
            nodes.append(int(previous[v, nodes[-1]]))
        path = np.array(nodes)
        at = order[np.searchsorted(key[order], path[1:] % n * n + path[:-1] % n)] % len(x)
        odd = (path[1:] >= n) != (path[:-1] >= n)
        found.setdefault(np.sort(2 * at + odd).tobytes(), (at, odd))
    return list(found.values())
