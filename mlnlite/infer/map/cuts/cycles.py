"""Best worlds of frustrated pairs by odd cycles: comes in a component of atoms in pairs, goes out a world and a bound.

A column says for each pair whether its atoms differ. Around a cycle an even number of pairs differ, so that for an odd
set F of its pairs `sum in F - sum of the others <= |F| - 1`. Which of these inequalities a fractional solution
violates, shortest paths tell in a graph with two copies of each atom. Coordinate ascent over many of them comes close
to what they prove together, a linear program does the rest, an integer program follows. (Barahona and Mahjoub, On the
cut polytope, Mathematical Programming 1986; an atom's own weight is a pair with one more atom that is always false.)
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mlnlite.ground.network import Float, Int64
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.map import ilp, relaxation
from mlnlite.infer.map.cuts.ascent import ascend
from mlnlite.infer.map.cuts.rows import Rows, append_rows, drop_slack, least_used, with_rows
from mlnlite.infer.map.ilp import Columns, Program
from mlnlite.infer.map.mincut import quadratic
from mlnlite.infer.reduce.parts import Part, PartAnswer, all_gains, grain_of, value_of

CYCLES = "odd cycles"
_VIOLATED, _ABSOLUTE = 1e-3, 1e-6
_ROUNDS, _LEAST_GAIN, _STALLED, _NEARLY = 60, 0.02, 4, 1e-2
_PER_COLUMN, _COARSE, _SWEEPS, _SHARE = 6, (0.05, 2), 20, 8
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
    best, bound = _ascend(pairs, rows, best, (grain, gap), deadline, seed)
    if not deadline.is_over and not _is_enough(part, best, bound, (grain, gap)):
        best, bound = _relax(pairs, rows, best, bound, (grain, gap), deadline)
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
    pairs: Pairs, rows: Rows, best: Int64, bound: float, enough: tuple[float, float], deadline: Deadline
) -> tuple[Int64, float]:
    """Linear programs, until no cycle is violated or little is gained; the best world met, and the bound."""
    part, exact, n_same = pairs.part, False, 0
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
        n_added = _separate(pairs, rows, x, np.arange(pairs.n), _VIOLATED, _PER_COLUMN)
        n_same = n_same + 1 if before - bound < _LEAST_GAIN * (bound - value_of(part, best)) else 0
        if n_same == _STALLED or (exact and not n_added):
            break
        exact = not n_added or bound - value_of(part, best) < _NEARLY * (all_gains(part) - bound)
    return best, bound


def _ascend(
    pairs: Pairs, rows: Rows, best: Int64, enough: tuple[float, float], deadline: Deadline, seed: int
) -> tuple[Int64, float]:
    """A bound by coordinate ascent over many cycles; the better of a world and the one that it ends at."""
    part, program = pairs.part, pairs.program
    cost = np.concatenate(program.cost)
    free = Program([cost], program.upper, program.n_columns, program.offset)
    bound, x = all_gains(part) - program.offset + float(np.maximum(-cost, 0.0).sum()), np.zeros(len(cost))

    rng = np.random.default_rng(seed)

    def separate(point: Float, _: float) -> int:
        x[:] = point
        some = rng.choice(pairs.n, -(-pairs.n // _SHARE), replace=False)
        return _separate(pairs, rows, point, some, *_COARSE)

    def is_enough(lower: float) -> bool:
        return deadline.is_over or _is_enough(part, best, bound - lower, enough)

    multipliers = ascend(rows, -cost, separate, is_enough, seed=seed, sweeps=_SWEEPS)
    rounded = (x[: pairs.n] > 0.5).astype(np.int64)
    best = max(best, rounded, key=lambda world: value_of(part, world))
    return best, relaxation.bound_of(part, with_rows(free, rows), -multipliers)[0]


def _separate(pairs: Pairs, rows: Rows, x: Float, atoms: Int64, least: float, most: int) -> int:
    """Adds the inequalities of short violated cycles, at most so many for each column; returns how many."""
    above, start, steps = violated_walks(pairs, np.clip(x, 0.0, 1.0), atoms, least)
    taken = least_used(np.argsort(-above, kind="stable"), start, steps // 2, len(x), most)
    inside = np.repeat(taken, np.diff(start))
    odd = steps % 2 == 1
    n_odd = np.add.reduceat(odd, start[:-1]) if len(above) else np.zeros(0)
    append_rows(rows, np.diff(start)[taken], steps[inside] // 2, np.where(odd[inside], 1.0, -1.0), n_odd[taken] - 1.0)
    return int(taken.sum())


def violated_walks(pairs: Pairs, x: Float, atoms: Int64, least: float) -> tuple[Float, Int64, Int64]:
    """Short closed walks along which an odd number of pairs would differ, each once.

    Args:
        pairs: the component.
        x: shape (n_columns,), between 0 and 1.
        atoms: of those through atoms alone, only walks through one of these, each the best of its kind.
        least: by how much they are to be violated.

    Returns:
        Shape (n_walks,), by how much the inequality of each is violated; where each starts; for each step twice its
        column, and 1 more if it is in the odd set.
    """
    from mlnlite.infer.map.cuts.walk_kernel import odd_walks

    start, end = np.concatenate([pairs.first, pairs.second]), np.concatenate([pairs.second, pairs.first])
    order = np.argsort(start, kind="stable")
    begin, column = np.searchsorted(start[order], np.arange(pairs.n + 2)), order % len(x)
    above, begin, steps = odd_walks(begin, end[order], column, x, np.append(atoms, pairs.n), pairs.n, least)
    names = [np.sort(steps[a:b]).tobytes() for a, b in pairwise(begin.tolist())]
    once = np.array(sorted({name: i for i, name in enumerate(names)}.values()), np.int64)
    keep = np.zeros(len(above), np.bool_)
    keep[once] = True
    size = np.diff(begin)
    return above[keep], np.concatenate([[0], np.cumsum(size[keep])]), steps[np.repeat(keep, size)]
