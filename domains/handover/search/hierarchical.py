"""The hierarchical optimisation of Ardon et al. (2021), equation 1: a scene in, the proven best configuration out.

    g_r* = argmax C_A(g_r)                                     the grasp first
    Psi(m) = argmax C_S(Psi, g_r*)  s.t. inverse kinematics    per voxel m, the safest pose
    m* = argmin C_R(Psi(m))                                    the voxel of least reach

Best-first: voxels in order of `min_k C_R(m, k)`, a lower bound of what the solver may leave of them, equal ones by
`max_k C_S(m, k)`; when these bounds of the next voxel are worse than the best found, no other voxel can win. Ties go to
higher C_S, then to the lower index of the voxel.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mlnlite import Diagnostic, LimitReached, MlnError
from mlnlite.domains.handover.kinematics.pose import FloatArray, Pose
from mlnlite.domains.handover.scene.grasps import GraspSet, sample_grasps
from mlnlite.domains.handover.scene.mobility import read_levels
from mlnlite.domains.handover.scene.objects import region_points
from mlnlite.domains.handover.scene.receiver import at_level
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.search.advice import BLAMES, UNSOLVED, explain, with_hints
from mlnlite.domains.handover.search.costs import appropriateness
from mlnlite.domains.handover.search.feasibility import Hold, attempt, clear_turns, human_grasp
from mlnlite.domains.handover.search.fields import CostField, Options, cost_field

Status = Literal["optimal", "infeasible", "limit"]


@dataclass(frozen=True, slots=True, eq=False)
class Configuration:
    """Where and how to hand the object over; lengths in [m], frame `world`.

    Attributes:
        method: `A`, `B` or `ours`.
        thing: pose of the object.
        human_grasp: where the receiver grasps it, shape (3,).
        grasp: index of the robot's grasp in the grasp set; `rank` is its place by C_A, from 0.
        rank: see `grasp`.
        hold: approach, pose of the tool, configuration of the robot.
        voxel: index in the map, and `orientation` that of the object, or -1 if the method has no map.
        orientation: see `voxel`.
        appropriateness: C_A.
        safety: C_S.
        reach: C_R.
    """

    method: str
    thing: Pose
    human_grasp: FloatArray
    grasp: int
    rank: int
    hold: Hold
    voxel: int
    orientation: int
    appropriateness: float
    safety: float
    reach: float


@dataclass(frozen=True, slots=True, eq=False)
class Handover:
    """Result of a method on a scene.

    Attributes:
        status: `optimal`: proven; `infeasible`: proven that there is none; `limit`: stopped at the limit of calls.
        configuration: the best found, or None.
        bound: no configuration with this grasp has a lower C_R [m].
        ik_calls: of the inverse kinematics.
        voxels: how many voxels were asked about.
        refused: how many candidates each constraint ruled out.
        advice: what stands in the way and what would help, if there is no configuration.
    """

    status: Status
    configuration: Configuration | None
    bound: float
    ik_calls: int
    voxels: int
    refused: tuple[tuple[str, int], ...] = ()
    advice: tuple[Diagnostic, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    scene: Scene
    grasps: GraspSet
    options: Options
    exhaustive: bool
    refused: Counter[str]

    @property
    def out_of_calls(self) -> bool:
        """Whether the inverse kinematics may not be asked again."""
        return self.refused["calls"] >= self.options.ik_calls


_Best = tuple[float, float, int, int, Hold]


def optimise(scene: Scene, options: Options | None = None, *, exhaustive: bool = False) -> Handover:
    """The best configuration of a scene.

    Args:
        scene: who, what and where.
        options: costs, constraints and limits.
        exhaustive: ask about every voxel instead of best-first; same answer, thousands of calls.
    """
    options = options or Options()
    result = _run(scene, options, exhaustive)
    if result.configuration is None and result.advice[0].code == UNSOLVED:
        hints = [hint for hint in _relaxations(scene, options, dict(result.refused)) if hint]
        return replace(result, advice=tuple(with_hints(entry, hints) for entry in result.advice))
    return result


def _run(scene: Scene, options: Options, exhaustive: bool) -> Handover:
    grasps = sample_grasps(scene.thing, scene.robot.gripper)
    case = _Case(scene, grasps, options, exhaustive, Counter())
    ranked, values = rank_grasps(scene, grasps)
    if "C_A" in options.without:
        ranked = np.random.default_rng(0).permutation(len(values))
    fields: list[CostField] = []
    for rank, grasp in enumerate(ranked[: options.grasps]):
        fields.append(cost_field(scene, grasps, int(grasp), options))
        best, bound, stopped = _search(case, fields[-1])
        if best is not None:
            found = _configuration(case, fields[-1], best, rank, float(values[grasp]))
            return _result(case, "limit" if stopped else "optimal", found, bound)
        if stopped:
            return _result(case, "limit", None, bound, explain(scene, fields, options, case.refused))
    return _result(case, "infeasible", None, float("inf"), explain(scene, fields, options, case.refused))


def _relaxations(scene: Scene, options: Options, refused: dict[str, int]) -> Iterator[str]:
    """What would help, tried out with the best grasp: a higher mobility, or one constraint less."""
    brief = replace(options, grasps=1, ik_calls=min(options.ik_calls, 400))
    if options.receiver and refused["receiver"]:
        names = [level.name for level in read_levels()]
        here = names.index(scene.receiver.level.name) if scene.receiver.level.name in names else 0
        for name in reversed(names[:here]):
            higher = _reach_of(replace(scene, receiver=at_level(scene.receiver, name)), brief)
            if higher is not None:
                yield f"at mobility {name} there is an answer with C_R {higher:.3f} m"
                break
    for words, used, without in (
        ("without regard to the receiver's arm", options.receiver, replace(brief, receiver=False)),
        ("without regard to collisions", options.collisions, replace(brief, collisions=False)),
    ):
        found = _reach_of(scene, without) if used else None
        yield f"{words} there is an answer with C_R {found:.3f} m" if found is not None else ""


def _reach_of(scene: Scene, options: Options) -> float | None:
    found = _run(scene, options, False).configuration
    return None if found is None else found.reach


def rank_grasps(scene: Scene, grasps: GraspSet) -> tuple[NDArray[np.int64], FloatArray]:
    """Grasps outside the human region by falling C_A, ties by index; and C_A of every grasp [m]."""
    if not len(grasps.widths):
        return np.empty(0, dtype=np.int64), np.empty(0)
    values = np.round(appropriateness(grasps.centres, region_points(scene.thing, scene.region)), 9)
    outside = np.flatnonzero((grasps.labels != scene.region).all(axis=1))
    return outside[np.argsort(-values[outside], kind="stable")], values


def _search(case: _Case, costs: CostField) -> tuple[_Best | None, float, bool]:
    """The best of a grasp, a bound on C_R [m] that nothing with this grasp can beat, and whether calls ran out."""
    bounds = np.where(costs.allowed, costs.reach, np.inf).min(axis=1)
    risks = -np.where(costs.allowed, costs.safety, 0.0).max(axis=1)
    order = np.flatnonzero(np.isfinite(bounds))
    order = order if case.exhaustive else order[np.lexsort((risks[order], bounds[order]))]
    best: _Best | None = None
    for i, voxel in enumerate(order):
        if not case.exhaustive and best is not None and (bounds[voxel], risks[voxel]) > best[:2]:
            break
        found = _safest(case, costs, int(voxel))
        if found is None and case.out_of_calls:
            return best, float(bounds[order[i:]].min()), True
        best = min((b for b in (best, found) if b is not None), key=lambda b: b[:3], default=None)
    return best, best[0] if best is not None else float("inf"), False


def _safest(case: _Case, costs: CostField, voxel: int) -> _Best | None:
    """The pose of highest C_S at a voxel that receiver and robot can serve."""
    case.refused["voxels"] += 1
    clear = clear_turns(case.scene, costs.centres[voxel], costs.rotations[voxel], case.options)
    case.refused["collision"] += int((costs.allowed[voxel] & ~clear).sum())
    candidates = np.flatnonzero(costs.allowed[voxel] & clear)
    for k in candidates[np.argsort(-costs.safety[voxel, candidates], kind="stable")]:
        if case.out_of_calls:
            return None
        pose = Pose(costs.centres[voxel], costs.rotations[voxel, k])
        outcome = attempt(case.scene, case.grasps, costs.grasp, pose, case.options)
        case.refused["calls"] += outcome.calls
        if outcome.hold is not None:
            return float(costs.reach[voxel, k]), -float(costs.safety[voxel, k]), voxel, int(k), outcome.hold
        case.refused[outcome.blame] += 1
    return None


def _configuration(case: _Case, costs: CostField, best: _Best, rank: int, value: float) -> Configuration:
    reach, minus_safety, voxel, k, held = best
    pose = Pose(costs.centres[voxel], costs.rotations[voxel, k])
    return Configuration("ours", pose, human_grasp(case.scene, pose), costs.grasp, rank, held, voxel, k,
                         value, -minus_safety, reach)  # fmt: skip


def _result(
    case: _Case, status: Status, found: Configuration | None, bound: float, advice: tuple[Diagnostic, ...] = ()
) -> Handover:
    refused = tuple((name, case.refused[name]) for name in BLAMES)
    return Handover(status, found, bound, case.refused["calls"], case.refused["voxels"], refused, advice)


def require(handover: Handover) -> Configuration:
    """The configuration of a result.

    Raises:
        MlnError: there is none; says which constraint is in the way and the nearest relaxation.
        LimitReached: none was found within the limit of calls.
    """
    if handover.configuration is None and handover.status == "limit":
        raise LimitReached(handover.advice)
    if handover.configuration is None:
        raise MlnError(handover.advice)
    return handover.configuration
