"""Inverse kinematics by quadratic programs: a robot in, an `IkSolver` on Pink out. Slower, and another way.

Each step solves `min_dq |J dq - e|^2_W + mu |dq|^2` subject to the joint limits (Caron, Pink; solver DAQP).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pink
import pinocchio as pin

from mlnlite.domains.handover.kinematics.ik import (
    Accept,
    DampedLeastSquares,
    IkSolution,
    Tolerance,
    damped_least_squares,
)
from mlnlite.domains.handover.kinematics.pose import FloatArray, locked
from mlnlite.domains.handover.scene.robots import Robot


@dataclass(frozen=True, slots=True, eq=False)
class PinkSolver:
    """Differential inverse kinematics with hard joint limits, from the starts of the tabulated solver.

    Attributes:
        robot: whose tool is to be placed.
        table: gives the starts, seeded.
        starts: how many to try.
        steps: per start; there is no limit of time.
        tolerance: when to stop [m], [rad].
    """

    robot: Robot
    table: DampedLeastSquares
    starts: int = 6
    steps: int = 40
    tolerance: Tolerance = field(default_factory=Tolerance)

    def __call__(self, target: FloatArray, accept: Accept | None = None) -> IkSolution:
        """See `IkSolver`."""
        goal = pin.SE3(target[:3, :3], target[:3, 3])
        task = pink.FrameTask(self.robot.tool, position_cost=1.0, orientation_cost=0.3, lm_damping=1e-3)
        task.set_target(goal)
        spent, refused, q = 0, 0, self.robot.home
        for start in self.table.nearest(target, self.starts):
            q, steps, reached = self._descend(task, start)
            spent += steps
            if reached and (accept is None or accept(q)):
                return IkSolution(locked(q), True, spent, refused)
            refused += reached
        return IkSolution(locked(q), False, spent, refused)

    def _descend(self, task: pink.FrameTask, start: FloatArray) -> tuple[FloatArray, int, bool]:
        configuration = pink.Configuration(self.robot.model, self.robot.model.createData(), np.array(start))
        for step in range(self.steps):
            error = task.compute_error(configuration)
            near = np.linalg.norm(error[:3]) <= self.tolerance.position
            if near and np.linalg.norm(error[3:]) <= self.tolerance.rotation:
                return np.array(configuration.q), step, True
            velocity = pink.solve_ik(configuration, [task], 1.0, solver="daqp", damping=1e-6, safety_break=False,
                                     limits=[pink.limits.ConfigurationLimit(self.robot.model)])  # fmt: skip
            q = configuration.integrate(np.clip(velocity, -0.7, 0.7), 1.0)
            configuration.update(np.clip(q, self.robot.chain.lower, self.robot.chain.upper))
        return np.array(configuration.q), self.steps, False


def pink_solver(robot: Robot, *, seed: int = 0, starts: int = 6) -> PinkSolver:
    """Builds the solver and its table of starts."""
    return PinkSolver(robot, damped_least_squares(robot.chain, seed=seed), starts)
