"""Best worlds by integer programming (HiGHS): comes in a component as cells, goes out a world and an upper bound.

A variable becomes a column (two values) or a column for each value that sum to 1; a cell becomes one row (if it costs)
or one for each literal (if it pays). Literals of which every two cost the same, such as "at most one advisor", become
one count with a convex cost instead of a row for each pair.
Riedel (UAI 2008) and Noessner, Niepert and Stuckenschmidt (AAAI 2013) solve the same programs for Markov logic.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import highspy
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.deadline import FOREVER, Deadline
from mlnlite.infer.map.count_rows import Pieces, pieces_of
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.costs import with_costs
from mlnlite.infer.reduce.counting import Chains
from mlnlite.infer.reduce.dominance import merged
from mlnlite.infer.reduce.parts import Part, PartAnswer, all_gains

ILP = "ilp"
_ABSOLUTE, _RELATIVE = 1e-6, 1e-9
_FEWEST = 4


@dataclass(slots=True)
class Program:
    """A program under construction: minimise the costs of columns so that rows stay within their limits.

    The columns of variables come first and are integer; of the others those in `binary` are.
    """

    cost: list[Float]
    upper: list[Float]
    n_columns: int
    offset: float = 0.0
    n_rows: int = 0
    row: list[Int64] = field(default_factory=list)
    column: list[Int64] = field(default_factory=list)
    value: list[Float] = field(default_factory=list)
    limit: list[Float] = field(default_factory=list)
    binary: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Columns:
    """The literal `variable = value` is `sign * column + add`: its column is `first[variable] + value` for blocks.

    Attributes:
        first: shape (n,), first column of each variable.
        binary: shape (n,), whether one column says it all.
        n: how many columns.
    """

    first: Int64
    binary: Bool
    n: int


def solve_part(
    part: Part,
    deadline: Deadline = FOREVER,
    seed: int = 0,
    *,
    gap: float = 0.0,
    start: Int64 | None = None,
    nodes: int | None = None,
) -> PartAnswer:
    """Solves a component.

    Args:
        part: the component.
        deadline: when to stop with the best so far.
        seed: of the solver.
        gap: stop when no world can be better than this share of the cost of the best one.
        start: shape (n,), a world to start from.
        nodes: after how many nodes to stop, None for no limit.
    """
    part, constant = with_costs(part)
    program, columns = program_of(part)
    answer, _ = solve_program(program, columns, part, deadline, seed, gap=gap, start=start, nodes=nodes)
    return replace(answer, bound=answer.bound + constant)


def solve_program(
    program: Program,
    columns: Columns,
    part: Part,
    deadline: Deadline,
    seed: int = 0,
    *,
    gap: float = 0.0,
    start: Int64 | None = None,
    nodes: int | None = None,
) -> tuple[PartAnswer, Float]:
    """Solves the program of a component, to which rows may have been added; returns the values of all columns too."""
    solver = highspy.Highs()  # type: ignore[no-untyped-call]
    options = {"output_flag": False, "random_seed": seed, "threads": 1, "mip_rel_gap": gap, "mip_abs_gap": _ABSOLUTE}
    for name, setting in options.items():
        solver.setOptionValue(name, setting)
    if nodes is not None:
        solver.setOptionValue("mip_max_nodes", nodes)
    if np.isfinite(deadline.left):
        solver.setOptionValue("time_limit", max(0.1, deadline.left))
    solver.passModel(model_of(program, columns.n))
    if start is not None:
        _start(solver, columns, start)
    stop_with(solver, deadline)
    solver.run()
    return _answer(solver, columns, part), np.array(solver.getSolution().col_value)


def stop_with(solver: highspy.Highs, deadline: Deadline) -> None:
    """Lets the user interrupt the solver."""

    def interrupt(event: highspy.highs.HighsCallbackEvent) -> None:
        if deadline.stop.is_set():
            event.interrupt()

    solver.cbMipInterrupt += interrupt
    solver.cbSimplexInterrupt += interrupt


def program_of(part: Part) -> tuple[Program, Columns]:
    """The program of a component; what it minimises is the log-weight of all gains less that of the world."""
    binary = part.cardinality == 2
    width = np.where(binary, 1, part.cardinality).astype(np.int64)
    columns = Columns(np.cumsum(width) - width, binary, int(width.sum()))
    program = Program([np.zeros(columns.n)], [np.ones(columns.n)], columns.n, offset=all_gains(part))
    _add_blocks(program, columns, part)
    for cells in map(merged, part.cells):
        for rest in _without_cliques(program, columns, cells):
            _add_cells(program, columns, rest)
    for chains in part.chains:
        _add_counts(program, columns, chains)
    return program, columns


def _start(solver: highspy.Highs, columns: Columns, world: Int64) -> None:
    """Hands over a world as values of the integer columns; the solver finds those of the others."""
    values = np.zeros(columns.n)
    values[np.where(columns.binary, columns.first, columns.first + world)] = np.where(columns.binary, world, 1.0)
    solver.setSolution(columns.n, np.arange(columns.n, dtype=np.int32), values)


def _answer(solver: highspy.Highs, columns: Columns, part: Part) -> PartAnswer:
    """Reads the solution."""
    info, status, highest = solver.getInfo(), solver.getModelStatus(), all_gains(part)
    bound = highest - info.mip_dual_bound + _ABSOLUTE + _RELATIVE * abs(info.mip_dual_bound)
    if info.primal_solution_status != highspy.SolutionStatus.kSolutionStatusFeasible:
        impossible = status == highspy.HighsModelStatus.kInfeasible
        return PartAnswer(None, -np.inf if impossible else min(bound, highest), False, ILP)
    x = np.array(solver.getSolution().col_value)[: columns.n]
    proved = status == highspy.HighsModelStatus.kOptimal and info.mip_gap <= _RELATIVE
    return PartAnswer(world_of(part, columns, x), min(bound, highest), proved, ILP)


def world_of(part: Part, columns: Columns, x: Float) -> Int64:
    """The world of a solution."""
    world = np.where(columns.binary, x[columns.first] > 0.5, 0).astype(np.int64)
    for v in np.flatnonzero(~columns.binary).tolist():
        begin = columns.first[v]
        world[v] = int(x[begin : begin + part.cardinality[v]].argmax())
    return world


def literals(columns: Columns, scope: Int64, value: Int64) -> tuple[Int64, Float, Float]:
    """Column, sign and constant of literals `variable = value`."""
    binary = columns.binary[scope]
    column = columns.first[scope] + np.where(binary, 0, value)
    sign = np.where(binary & (value == 0), -1.0, 1.0)
    return column, sign, np.where(sign < 0, 1.0, 0.0)


def add_rows(program: Program, column: Int64, value: Float, limit: Float) -> None:
    """Adds rows `sum value * column <= limit`; shapes (n, k), (n, k), (n,)."""
    n, k = column.shape
    program.row.append(np.repeat(np.arange(program.n_rows, program.n_rows + n), k))
    program.column.append(column.ravel())
    program.value.append(value.ravel())
    program.limit.append(limit)
    program.n_rows += n


def _add_columns(program: Program, cost: Float, upper: float | Float) -> Int64:
    """Adds columns between 0 and `upper`; returns their numbers."""
    program.cost.append(cost)
    program.upper.append(np.broadcast_to(upper, len(cost)).astype(float))
    program.n_columns += len(cost)
    return np.arange(program.n_columns - len(cost), program.n_columns)


def _add_blocks(program: Program, columns: Columns, part: Part) -> None:
    """One value for each block."""
    for v in np.flatnonzero(~columns.binary).tolist():
        own = columns.first[v] + np.arange(part.cardinality[v])[None]
        for sign in (1.0, -1.0):
            add_rows(program, own, np.full(own.shape, sign), np.array([sign]))


def _add_cells(program: Program, columns: Columns, cells: Cells) -> None:
    """Cells of one arity."""
    column, sign, add = literals(columns, cells.scope.astype(np.int64), cells.value.astype(np.int64))
    room = column.shape[1] - 1 - add.sum(axis=1)
    hard, pays = np.isneginf(cells.amount), cells.amount > 0
    add_rows(program, column[hard], sign[hard], room[hard])
    if column.shape[1] == 1:
        soft = ~hard
        np.add.at(program.cost[0], column[soft, 0], -cells.amount[soft] * sign[soft, 0])
        program.offset -= float(cells.amount[soft] @ add[soft, 0])
        return
    costs = ~hard & ~pays
    extra = _add_columns(program, -cells.amount[costs], 1.0)[:, None]
    ones = np.ones(extra.shape)
    add_rows(program, np.hstack([column[costs], extra]), np.hstack([sign[costs], -ones]), room[costs])
    extra = _add_columns(program, -cells.amount[pays], 1.0)
    for c in range(column.shape[1]):
        pair = np.stack([extra, column[pays, c]], axis=1)
        add_rows(program, pair, np.stack([np.ones(len(extra)), -sign[pays, c]], axis=1), add[pays, c])


def _add_counts(program: Program, columns: Columns, chains: Chains) -> None:
    """The costs of counting factors: each count is the first possible one and what is filled of the pieces after it."""
    column, sign, add = literals(columns, chains.variable.astype(np.int64), chains.value.astype(np.int64))
    sign = np.where(chains.equal, sign, -sign) * chains.steps
    add = (np.where(chains.equal, add, 1 - add) * chains.steps).sum(axis=1)
    for rows, worth in chains.scaled():
        pieces = pieces_of(worth, chains.steps)
        for row in rows.tolist():
            if pieces is None:
                add_rows(program, column[row, None, :1], np.zeros((1, 1)), np.array([-1.0]))
                continue
            filled = _add_pieces(program, pieces)
            whole = np.append(column[row], filled)[None]
            value = np.append(sign[row], np.full(len(filled), -1.0))[None]
            limit = np.array([pieces.first - add[row]])
            add_rows(program, whole, value, limit)
            add_rows(program, whole, -value, -limit)


def _add_pieces(program: Program, pieces: Pieces) -> Int64:
    """Columns for the pieces of a cost, those of one run full before the next one begins."""
    program.offset += pieces.cost
    filled = _add_columns(program, pieces.slope, pieces.length)
    for run in range(1, int(pieces.run.max(initial=0)) + 1):
        full = _add_binary(program)
        for which, sign in ((run - 1, -1.0), (run, 1.0)):
            mine = np.flatnonzero(pieces.run == which)
            value = np.append(np.full(len(mine), sign), -sign * pieces.length[mine].sum())
            add_rows(program, np.append(filled[mine], full)[None], value[None], np.zeros(1))
    for i in np.flatnonzero(pieces.jump).tolist():
        pair, value = np.array([[filled[i], _add_binary(program)]]), np.array([[1.0, -pieces.length[i]]])
        add_rows(program, pair, value, np.zeros(1))
        add_rows(program, pair, -value, np.zeros(1))
    return filled


def _add_binary(program: Program) -> int:
    """Adds a column that is 0 or 1."""
    (column,) = _add_columns(program, np.zeros(1), 1.0).tolist()
    program.binary.append(column)
    return int(column)


def _without_cliques(program: Program, columns: Columns, cells: Cells) -> Iterator[Cells]:
    """Turns cells that cost the same for every two of some literals into counts; passes on the other cells."""
    if cells.scope.shape[1] != 2:
        yield cells
        return
    wide = int(cells.value.max(initial=0)) + 1
    ends = cells.scope.astype(np.int64) * wide + cells.value
    left = np.ones(len(ends), np.bool_)
    for amount in np.unique(cells.amount[cells.amount < 0]).tolist():
        rows = np.flatnonzero(cells.amount == amount)
        for members, nodes in _cliques(ends[rows]):
            left[rows[members]] = False
            _add_count(program, literals(columns, nodes // wide, nodes % wide), amount)
    yield Cells(cells.scope[left], cells.value[left], cells.amount[left])


def _cliques(ends: Int64) -> Iterator[tuple[Int64, Int64]]:
    """Components of a graph that are complete: the rows of `ends`, shape (n, 2), and the nodes of each."""
    nodes, index = np.unique(ends, return_inverse=True)
    start, end = index.reshape(ends.shape).T
    graph = coo_matrix((np.ones(len(start)), (start, end)), shape=(len(nodes), len(nodes)))
    _, label = connected_components(graph, directed=False)
    sizes, n_edges = np.bincount(label), np.bincount(label[start], minlength=int(label.max(initial=-1)) + 1)
    for c in np.flatnonzero((n_edges == sizes * (sizes - 1) // 2) & (sizes >= _FEWEST)).tolist():
        yield np.flatnonzero(label[start] == c), nodes[label == c]


def _add_count(program: Program, literals: tuple[Int64, Float, Float], amount: float) -> None:
    """Cost of each pair of literals that hold, `c k (k - 1) / 2` for k of them: number j + 1 of them costs `c j`."""
    column, sign, add = literals
    n = len(column)
    if not np.isfinite(amount):
        add_rows(program, column[None], sign[None], np.array([1.0 - add.sum()]))
        return
    extra = _add_columns(program, -amount * np.arange(1.0, n), 1.0)
    row = np.concatenate([column, extra])[None]
    add_rows(program, row, np.concatenate([sign, -np.ones(n - 1)])[None], np.array([1.0 - add.sum()]))


def model_of(program: Program, n_integer: int) -> highspy.HighsLp:
    """The program as HiGHS takes it."""
    model = highspy.HighsLp()
    shape = program.n_rows, program.n_columns
    values, rows, columns = (_joined(part) for part in (program.value, program.row, program.column))
    matrix = coo_matrix((values, (rows.astype(np.int64), columns.astype(np.int64))), shape=shape).tocsr()
    model.num_row_, model.num_col_ = shape
    model.col_cost_, model.offset_ = np.concatenate(program.cost), program.offset
    model.col_lower_, model.col_upper_ = np.zeros(shape[1]), np.concatenate(program.upper)
    model.row_lower_, model.row_upper_ = np.full(shape[0], -np.inf), _joined(program.limit)
    model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    model.a_matrix_.start_, model.a_matrix_.index_ = matrix.indptr, matrix.indices
    model.a_matrix_.value_ = matrix.data
    kinds = [highspy.HighsVarType.kInteger] * n_integer + [highspy.HighsVarType.kContinuous] * (shape[1] - n_integer)
    for column in program.binary if n_integer else ():
        kinds[column] = highspy.HighsVarType.kInteger
    model.integrality_ = kinds
    return model


def _joined(arrays: Sequence[Float | Int64]) -> Float:
    """All of them in one array."""
    return np.concatenate([np.zeros(0), *arrays])
