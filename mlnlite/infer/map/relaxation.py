"""Bounds by linear programming (HiGHS): comes in a component, goes out a bound, and a world if the answer is integral.

The bound is worked out from the multipliers of the rows in plain NumPy (weak duality), so it holds even if the solver
stopped early or was wrong.
"""

from __future__ import annotations

import highspy
import numpy as np
from scipy.sparse import csr_array

from mlnlite.ground.network import Float
from mlnlite.infer.deadline import FOREVER, Deadline
from mlnlite.infer.map.ilp import Program, model_of, program_of, stop_with, world_of
from mlnlite.infer.reduce.parts import Part, PartAnswer, all_gains, value_of

RELAXATION = "lp"
_CLOSE, _LOOSE = 1e-7, 1e-4
_FEWEST, _WORK = 200, 2_000_000_000


def solve_part(part: Part, deadline: Deadline = FOREVER, solver_name: str = "pdlp") -> PartAnswer:
    """Solves the linear relaxation of a component.

    Args:
        part: the component.
        deadline: when to stop.
        solver_name: "simplex", "ipm" or "pdlp".
    """
    program, columns = program_of(part)
    solver = highspy.Highs()  # type: ignore[no-untyped-call]
    for name, setting in (
        ("output_flag", False),
        ("threads", 1),
        ("solver", solver_name),
        ("pdlp_iteration_limit", _iterations(part)),
    ):
        solver.setOptionValue(name, setting)
    if np.isfinite(deadline.left):
        solver.setOptionValue("time_limit", max(0.1, deadline.left))
    model = model_of(program, 0)
    solver.passModel(model)
    stop_with(solver, deadline)
    solver.run()
    found = solver.getSolution()
    multipliers = np.array(found.row_dual) if found.dual_valid else np.zeros(program.n_rows)
    bound, _ = bound_of(part, program, multipliers)
    world = world_of(part, columns, np.array(found.col_value)[: columns.n]) if found.value_valid else None
    value = -np.inf if world is None else value_of(part, world)
    if not np.isfinite(value):
        return PartAnswer(None, bound, False, RELAXATION)
    return PartAnswer(world, bound, bound - value <= _CLOSE * max(1.0, abs(value)), RELAXATION)


def _iterations(part: Part) -> int:
    """How far the first-order solver goes: less on large components, whatever the clock says."""
    return max(_FEWEST, _WORK // max(1, sum(len(c.amount) for c in part.cells)))


def solve_program(
    part: Part, program: Program, deadline: Deadline, *, exact: bool
) -> tuple[Float | None, Float, float]:
    """Solves the linear relaxation of a program that grows, from the inside.

    Args:
        part: the component.
        program: its program, to which rows may have been added.
        deadline: when to stop.
        exact: to full precision; else only as well as separation needs it.

    Returns:
        A point in the middle of the best face, None if the solver did not get there; multipliers of the rows; the
        bound that these prove.
    """
    solver = highspy.Highs()  # type: ignore[no-untyped-call]
    for name, setting in (("output_flag", False), ("threads", 1), ("solver", "ipm"), ("run_crossover", "off")):
        solver.setOptionValue(name, setting)
    if not exact:
        solver.setOptionValue("ipm_optimality_tolerance", _LOOSE)
    if np.isfinite(deadline.left):
        solver.setOptionValue("time_limit", max(0.1, deadline.left))
    solver.passModel(model_of(program, 0))
    stop_with(solver, deadline)
    solver.run()
    found = solver.getSolution()
    multipliers = np.array(found.row_dual) if found.dual_valid else np.zeros(program.n_rows)
    bound, _ = bound_of(part, program, multipliers)
    return np.array(found.col_value) if found.value_valid else None, multipliers, bound


def bound_of(part: Part, program: Program, multipliers: Float) -> tuple[float, Float]:
    """What no world of a component can pass, by any multipliers of the rows `A x <= b` (those above 0 count as 0).

    `min c x >= y b + min (c - A' y) x` for `y <= 0`, and the last part is taken column by column within its limits.

    Returns:
        The bound, and the reduced cost of each column, `c - A' y`: worlds in which the column is 1 pass the bound less
        this if it is positive.
    """
    model = model_of(program, 0)
    shape = program.n_rows, program.n_columns
    entries = (np.array(model.a_matrix_.value_), np.array(model.a_matrix_.index_), np.array(model.a_matrix_.start_))
    matrix = csr_array(entries, shape=shape)
    y = np.minimum(multipliers, 0.0)
    reduced = np.array(model.col_cost_) - matrix.T @ y
    columns = np.minimum(0.0, reduced) * np.array(model.col_upper_)
    least = float(y @ np.array(model.row_upper_) + columns.sum() + model.offset_)
    return all_gains(part) - least, reduced
