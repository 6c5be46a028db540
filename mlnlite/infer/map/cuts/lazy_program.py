"""Best worlds by a program that grows: comes in a network without its lazy groundings, goes out a world and a bound.

Coordinate ascent finds most of the rows, and a bound. Then the linear relaxation is solved (interior point, from the
middle of the best face, where separation finds most), rows that its solution violates are added and slack ones dropped,
until nothing is violated. If the solution is not a world by then, the rows that are left make an integer program, to
which violated groundings are added as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlnlite.engines.plan import Engine
from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.map import ilp, relaxation
from mlnlite.infer.map.cuts.ascent import ascend, star_finder
from mlnlite.infer.map.cuts.rows import Rows, add_clauses, add_stars, drop_slack, least_used, paid_so_far, with_rows
from mlnlite.infer.map.cuts.separation import Reading, excuses, graph_of, lack, near_violations, stars
from mlnlite.infer.map.cuts.waiting import Lazy, violated_weight
from mlnlite.infer.map.rungs import Options
from mlnlite.infer.reduce.costs import with_costs
from mlnlite.infer.reduce.equivalence import Ties, contracted, put_back_ties
from mlnlite.infer.reduce.parts import Part, all_gains, grain_of
from mlnlite.infer.reduce.potentials import Potentials, potentials_of
from mlnlite.infer.score import log_weight, truth_of

_PER_COLUMN = 4
_VIOLATED, _CLOSE = 1e-3, 1e-4
_NEARLY, _LEAST_GAIN, _STALLED, _SWEEPS = 1e-3, 0.01, 4, 5


@dataclass(frozen=True, slots=True)
class Base:
    """The program of what was ground.

    Attributes:
        part: the variables that are not tied to others, as one component.
        constant: what every world gains besides.
        program: of the part.
        columns: of its variables.
        variables: shape (n,), which variables of the network these are.
        ties: of the others.
        reading: of the atoms.
    """

    part: Part
    constant: float
    program: ilp.Program
    columns: ilp.Columns
    variables: Int64
    ties: Ties
    reading: Reading


@dataclass(slots=True)
class Found:
    """What is known so far: a world with its log-weight, if any, and what no world can pass."""

    truth: Bool | None = None
    value: float = -np.inf
    bound: float = np.inf
    n_groundings: int = 0

    @property
    def gap(self) -> float:
        """By how much another world could be better."""
        return self.bound - self.value


def base_of(lazy: Lazy) -> Base:
    """The program of a network."""
    network = lazy.network
    potentials, ties = contracted(potentials_of(network, max_arity=np.inf))
    variables = np.flatnonzero(ties.leader == np.arange(len(ties.leader)))
    part, constant = with_costs(_part_of(potentials, variables))
    program, columns = ilp.program_of(part)
    place = np.full(len(ties.leader), -1, np.int64)
    place[variables] = np.arange(len(variables))
    leader = place[ties.leader[network.variable]]
    value = np.where(ties.opposite[network.variable], 1 - network.value, network.value)
    column, sign, _ = ilp.literals(columns, leader, value)
    return Base(part, potentials.constant + constant, program, columns, variables, ties, Reading(column, sign))


def _part_of(potentials: Potentials, variables: Int64) -> Part:
    """Some variables and all cells, as one component."""
    place = np.full(len(potentials.cardinality), -1, np.int32)
    place[variables] = np.arange(len(variables), dtype=np.int32)
    cells = tuple(type(c)(place[c.scope], c.value, c.amount) for c in potentials.cells)
    return Part(0, variables, potentials.cardinality[variables], cells)


def grow(lazy: Lazy, start: Bool | None, options: Options, engine: Engine | None = None) -> Found:
    """A world of the whole model and a bound on all others.

    Args:
        lazy: a network of which no lazy grounding was generated yet.
        start: shape (n_atoms,), a world to start from.
        options: when to stop.
        engine: what runs the queries.
    """
    base = base_of(lazy)
    rows, found = Rows(base.program.n_columns), Found()
    waiting = lazy.network.weights[np.isin(lazy.network.template, lazy.templates)]
    search = _Search(
        lazy, base, rows, found, options, engine, grain_of([*(c.amount for c in base.part.cells), waiting])
    )
    if start is not None:
        _consider(search, start)
    _ascend(search)
    if not _is_done(search):
        _relax(search)
    if not _is_done(search):
        _round_off(search)
    found.n_groundings = rows.n_groundings
    return found


@dataclass(frozen=True, slots=True)
class _Search:
    lazy: Lazy
    base: Base
    rows: Rows
    found: Found
    options: Options
    engine: Engine | None
    grain: float


def _is_done(search: _Search) -> bool:
    """Whether to stop: proved, close enough, or out of time."""
    found = search.found
    if found.gap < search.grain - _CLOSE:
        found.bound = found.value
    return _is_enough(search, found.bound)


def _is_enough(search: _Search, bound: float) -> bool:
    """Whether such a bound would do, or time is over."""
    options, gap = search.options, bound - search.found.value
    return options.deadline.is_over or gap <= max(_CLOSE, search.grain - _CLOSE, options.gap * _cost(search))


def _cost(search: _Search) -> float:
    """What the best world so far falls short of all gains by; 0 if there is none."""
    if search.found.truth is None:
        return 0.0
    return all_gains(search.base.part) + search.base.constant - search.found.value


def _consider(search: _Search, truth: Bool) -> None:
    """Keeps a world if it is the best so far."""
    value = log_weight(search.lazy.network, truth)
    if value > search.found.value:
        value -= violated_weight(search.lazy, truth, search.engine)
    if value > search.found.value:
        search.found.truth, search.found.value = truth, value


def _world(search: _Search, x: Float) -> Bool:
    """The world next to a solution."""
    base = search.base
    values = np.zeros(len(base.ties.leader), np.int64)
    values[base.variables] = ilp.world_of(base.part, base.columns, x[: base.columns.n])
    put_back_ties(base.ties, values)
    return truth_of(search.lazy.network, values)


def _ascend(search: _Search) -> None:
    """A bound from many stars, found by coordinate ascent from the first linear program."""
    base, rows, options = search.base, search.rows, search.options
    x, multipliers, _ = relaxation.solve_program(base.part, base.program, options.deadline, exact=False)
    if x is None:
        return
    reduced = _prove(search, multipliers)
    if _is_done(search):
        return
    bound, n = search.found.bound, base.columns.n
    may = np.where((reduced < 0) | (x > _VIOLATED), 0.5, 0.0)
    clauses = near_violations(search.lazy, base.reading, may[:n], search.engine)
    find = star_finder(rows, clauses, search.lazy.network.weights, may)
    more = ascend(
        rows, -reduced, find, lambda lower: _is_enough(search, bound - lower), seed=options.seed, sweeps=_SWEEPS
    )
    _prove(search, np.append(multipliers, -more))


def _prove(search: _Search, multipliers: Float) -> Float:
    """Takes the bound that multipliers prove of the program with its rows; returns the reduced costs."""
    base = search.base
    bound, reduced = relaxation.bound_of(base.part, with_rows(base.program, search.rows), multipliers)
    search.found.bound = min(search.found.bound, base.constant + bound)
    _fix(search, base.constant + bound - np.maximum(0.0, reduced))
    return reduced


def _relax(search: _Search) -> None:
    """Linear programs, until no row is violated, or a world is proved."""
    exact, n_same, rng = False, 0, np.random.default_rng(search.options.seed)
    while not search.options.deadline.is_over and n_same < _STALLED:
        before, part = search.found.bound, search.base.part
        program = with_rows(search.base.program, search.rows)
        x, multipliers, _ = relaxation.solve_program(part, program, search.options.deadline, exact=exact)
        if x is None:
            return
        _prove(search, multipliers)
        drop_slack(search.rows, x, multipliers[search.base.program.n_rows :])
        n_added = _separate(search, x, rng)
        if not n_added or (np.minimum(x, 1 - x) > _VIOLATED).mean() < _NEARLY:
            _consider(search, _world(search, x))
        if _is_done(search) or (exact and not n_added):
            return
        exact = not n_added or search.found.gap < _NEARLY * _cost(search)
        n_same = n_same + 1 if before - search.found.bound < _LEAST_GAIN * search.found.gap else 0


def _fix(search: _Search, bounds: Float) -> None:
    """Gives up columns that no world can have that is better than the best so far: their reduced costs are too high.

    Args:
        search: the program.
        bounds: shape (n_columns,), what no world can pass in which the column is 1.
    """
    upper = search.base.program.upper[0]
    upper[bounds[: len(upper)] < search.found.value] = 0.0


def _separate(search: _Search, x: Float, rng: np.random.Generator) -> int:
    """Adds the rows that a solution violates most, few for each column; returns how many."""
    rows, weights, before = search.rows, search.lazy.network.weights, len(search.rows)
    near = near_violations(search.lazy, search.base.reading, x[: search.base.columns.n], search.engine)
    paid = paid_so_far(rows, near, weights, x)
    graph = graph_of(near, x, paid)
    found = stars(graph, excuses(near, graph, x) + paid, x)
    size = (found.sign != 0).sum(axis=1)
    starts = np.concatenate([[0], np.cumsum(size)])
    best = np.argsort(-found.above / np.sqrt(np.maximum(size, 1)), kind="stable")
    taken = least_used(best, starts, found.column[found.sign != 0], len(x), _PER_COLUMN)
    add_stars(rows, found.pick(np.flatnonzero(taken)), near, weights)
    violated = lack(near, x) - paid
    near = near.pick(np.flatnonzero(violated > _VIOLATED))
    order = np.argsort(-violated[violated > _VIOLATED] + _VIOLATED * rng.random(len(near)), kind="stable")
    there = near.sign != 0
    starts = np.concatenate([[0], np.cumsum(there.sum(axis=1))])
    taken = least_used(order, starts, near.column[there], len(x), _PER_COLUMN)
    add_clauses(rows, near.pick(np.flatnonzero(taken)), weights)
    return len(rows) - before


def _round_off(search: _Search) -> None:
    """Integer programs, until a world violates no grounding that the program lacks."""
    base, options = search.base, search.options
    weights = search.lazy.network.weights
    while not _is_done(search):
        start = None if search.found.truth is None else _values(search, search.found.truth)
        program = with_rows(base.program, search.rows)
        answer, x = ilp.solve_program(
            program, base.columns, base.part, options.deadline, options.seed, gap=options.gap, start=start
        )
        search.found.bound = min(search.found.bound, base.constant + answer.bound)
        if answer.world is None:
            return
        _consider(search, _world(search, x))
        near = near_violations(search.lazy, base.reading, x[: base.columns.n], search.engine)
        fresh = np.flatnonzero(lack(near, x) - paid_so_far(search.rows, near, weights, x) > _VIOLATED)
        if not len(fresh):
            return
        add_clauses(search.rows, near.pick(fresh), weights)


def _values(search: _Search, truth: Bool) -> Int64:
    """The value of each variable of the program in a world."""
    network = search.lazy.network
    values = np.zeros(network.n_variables, np.int64)
    values[network.variable[truth]] = network.value[truth]
    return values[search.base.variables]
