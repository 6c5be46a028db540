"""Inverse kinematics: a chain and a pose of its tool in, a configuration inside the limits out.

A solver is a pure function of its settings and the target: seeded when it is built, limited in steps and never in
time, so a busy machine gives the same answer as an idle one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

from mlnlite.domains.handover.kinematics.chain import Chain, reach_bound, tool_poses
from mlnlite.domains.handover.kinematics.ik_kernel import solve
from mlnlite.domains.handover.kinematics.pose import FloatArray, locked

Accept = Callable[[FloatArray], bool]


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How near is there.

    Attributes:
        position: [m].
        rotation: [rad].
    """

    position: float = 1e-3
    rotation: float = 1e-2


@dataclass(frozen=True, slots=True, eq=False)
class IkSolution:
    """What a solver found.

    Attributes:
        q: configuration, shape (n,) [rad] or [m]; the last attempt if nothing was found.
        found: whether it is within the tolerance, inside the limits, and accepted.
        steps: spent over all starts.
        refused: configurations that reached the pose but were not accepted (collisions).
    """

    q: FloatArray
    found: bool
    steps: int
    refused: int = 0


class IkSolver(Protocol):
    """Anything that finds a configuration for a pose of the tool in the base, shape (4, 4) [m]."""

    def __call__(self, target: FloatArray, accept: Accept | None = None) -> IkSolution:
        """The first solution in a fixed order that `accept` agrees to."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class DampedLeastSquares:
    """Levenberg-Marquardt with joint clamping, from the nearest of tabulated configurations.

    Each step solves `dq = J^T (J J^T + (mu + nu |e|^2) I)^-1 e` (Nakamura & Hanafusa 1986; error-dependent damping
    after Sugihara 2011) and clamps to the limits. Starts are the configurations, of a seeded table over the joint
    ranges, whose tool poses are nearest to the target.

    Attributes:
        chain: the arm.
        table: configurations, shape (m, n).
        tree: their poses in the feature space of `_features`.
        starts: how many to try.
        steps: per start.
        tolerance: when to stop [m], [rad].
        solutions: how many refused solutions to put up with.
        position_only: leave the orientation free.
    """

    chain: Chain
    table: FloatArray
    tree: cKDTree
    starts: int = 12
    steps: int = 40
    tolerance: Tolerance = Tolerance()
    solutions: int = 4
    position_only: bool = False

    def __call__(self, target: FloatArray, accept: Accept | None = None) -> IkSolution:
        """See `IkSolver`. A target outside the reach bound costs no step."""
        target = np.ascontiguousarray(target[:3], dtype=np.float64)
        if not self.position_only and not _within_reach(self.chain, target):
            return IkSolution(self.table[0], False, 0)
        starts, spent, refused = self.nearest(target, self.starts), 0, 0
        settings = self._settings()
        while len(starts) and refused < self.solutions:
            q, index, steps = solve(self.chain.table, target, starts, settings)
            spent += steps
            if index < 0:
                return IkSolution(locked(q), False, spent, refused)
            if accept is None or accept(q):
                return IkSolution(locked(q), True, spent, refused)
            starts, refused = starts[index + 1 :], refused + 1
        return IkSolution(locked(q), False, spent, refused)

    def nearest(self, target: FloatArray, n: int) -> FloatArray:
        """The n tabulated configurations, shape (n, joints), with the poses nearest to a target, shape (4, 4) [m]."""
        _, order = self.tree.query(_features(target[None, :3], self.position_only)[0], k=[*range(1, n + 1)])
        return self.table[order]

    def _settings(self) -> FloatArray:
        weight = 0.0 if self.position_only else 0.3
        return np.array([self.steps, self.tolerance.position, self.tolerance.rotation, weight, 0.7])


def damped_least_squares(
    chain: Chain,
    *,
    seed: int = 0,
    table: int = 20_000,
    starts: int = 12,
    tolerance: Tolerance | None = None,
    position_only: bool = False,
) -> DampedLeastSquares:
    """Builds the solver and its table of `table` random configurations, about 0.1 s.

    Raises nothing; the same seed gives the same solver on every machine.
    """  # fmt: skip
    rng = np.random.default_rng(seed)
    middle = np.clip(np.zeros(len(chain.lower)), chain.lower, chain.upper)
    random = rng.uniform(chain.lower, chain.upper, (table - 1, len(chain.lower)))
    configurations = np.vstack([middle, random])
    tree = cKDTree(_features(tool_poses(chain, configurations)[:, :3], position_only))
    return DampedLeastSquares(chain, locked(configurations), tree, starts=min(starts, table),
                              tolerance=tolerance or Tolerance(), position_only=position_only)  # fmt: skip


def _features(poses: FloatArray, position_only: bool) -> FloatArray:
    """Position [m] and two columns of the rotation, scaled so that 1 rad weighs as much as 0.3 m."""
    position = poses[:, :, 3]
    if position_only:
        return position
    return np.hstack([position, 0.3 * poses[:, :, 0], 0.3 * poses[:, :, 1]])


def _within_reach(chain: Chain, target: FloatArray) -> bool:
    wrist, centre, radius = reach_bound(chain)
    return bool(np.linalg.norm(target[:, :3] @ wrist + target[:, 3] - centre) <= radius + 1e-3)
