"""Advice: a learnt model and a question in, the reasoned answer with poses out, in words or as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import mlnlite as ml
from mlnlite.domains.handover.knowledge.ask import Answer, Knowledge, Level, ask, explain, likeliest
from mlnlite.domains.handover.knowledge.reasons import Reason, said
from mlnlite.domains.handover.knowledge.words import LEVELS, METHODS, method_name, words_table
from mlnlite.domains.handover.scene.objects import HandoverObject
from mlnlite.domains.handover.scene.scene import Scene
from mlnlite.domains.handover.search.hierarchical import Configuration, Handover
from mlnlite.domains.handover.search.methods import hand_over


@dataclass(frozen=True, slots=True, eq=False)
class Advice:
    """An answer with all that goes with it.

    Attributes:
        thing: the object.
        task: what the receiver will do with it.
        answer: what the model says.
        reasons: why, formula by formula.
        scene: who and where, the receiver's region being that of the answer; None if no poses were asked for.
        result: of the cost model for the method of the answer, or None.
    """

    thing: HandoverObject
    task: str
    answer: Answer
    reasons: tuple[Reason, ...]
    scene: Scene | None
    result: Handover | None

    @property
    def configuration(self) -> Configuration | None:
        """Poses of object and grasp, if there are any."""
        return None if self.result is None else self.result.configuration


def advise(knowledge: Knowledge, scene: Scene, level: Level = "") -> Advice:
    """Where to hand an object over, how to hold it, and why.

    Args:
        knowledge: of `open_knowledge` or `read_learnt`.
        scene: of `make_scene`, with an object that the model knows or has never seen.
        level: of mobility, if it is not the one of the scene's receiver: uncertain, or unknown.

    Raises:
        MlnError: an unknown level, probabilities that do not sum to 1.
    """
    said = advise_without_poses(knowledge, scene.thing, scene.task, level or scene.receiver.level.name)
    asked = replace(scene, region=scene.thing.regions.index(said.answer.region))
    return replace(said, scene=asked, result=hand_over(asked, said.answer.method))


def advise_without_poses(knowledge: Knowledge, thing: HandoverObject, task: str, level: Level) -> Advice:
    """The same from the knowledge base alone: which part, which method, and why.

    Raises:
        MlnError: a task that the object does not afford, an unknown level, probabilities that do not sum to 1.
    """
    answer = ask(knowledge, thing, task, level)
    return Advice(thing, task, answer, explain(knowledge, thing, task, answer), None, None)


def advice_text(advice: Advice, proof: ml.MapState | None = None) -> str:
    """The answer with its reasons, in words."""
    answer, words = advice.answer, words_table()
    who = ", ".join(f"{words['levels'][LEVELS[n]]} arm mobility" + (f" ({100 * p:.0f} %)" if p < 1 else "")
                    for n, p in answer.levels.items())  # fmt: skip
    lines = [
        f"{advice.thing.name}, {advice.task.replace('_', ' ')}, to a person with {who}",
        f"  leave free    {answer.region} ({answer.role}), {100 * answer.regions[answer.region]:.1f} % sure; "
        "the robot holds elsewhere",
        f"  hold it out   {words['methods'][METHODS[answer.method]]}"
        f" (method {answer.method}), {100 * answer.methods[answer.method]:.1f} % sure",
        f"  alternatives  {_listed(answer.regions)}; {_listed(answer.methods)}",
        *_poses(advice),
        "  why" if len(answer.levels) == 1 else f"  why, at level {likeliest(answer.levels)}",
    ]
    for predicate in ("graspRegion", "handover"):
        lines += [f"    - {reason}" for reason in said(advice.reasons, predicate, most=3)]
    return "\n".join(lines + _proof(advice, proof))


def _listed(probabilities: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {100 * p:.1f} %" for name, p in probabilities.items())


def _poses(advice: Advice) -> list[str]:
    found = advice.configuration
    if advice.result is None:
        return []
    if found is None:
        return [f"  poses         none: {note}" for note in advice.result.advice]
    place, tool = found.thing.position, found.hold.tool
    return [
        f"  object at     {_numbers(place)} m, quaternion wxyz {_numbers(found.thing.quaternion)}",
        f"  gripper at    {_numbers(tool.position)} m, quaternion wxyz {_numbers(tool.quaternion)}, "
        f"{100 * found.appropriateness:.1f} cm from the part left free",
        f"  the hand has to move {100 * found.reach:.0f} cm to {_numbers(found.human_grasp)} m",
    ]


def _numbers(values: Any) -> str:  # noqa: ANN401 - any array
    return " ".join(f"{v:.3f}" for v in values)


def _proof(advice: Advice, proof: ml.MapState | None) -> list[str]:
    error = advice.answer.error
    exact = "exact" if error == 0 else f"standard error at most {error:.3g}"
    if proof is None:
        return [f"  probabilities {exact}"]
    chosen = dict(atom.rstrip(")").split("(") for atom in proof.true_atoms)
    values = {name: arguments.split(", ")[-1] for name, arguments in chosen.items()}
    together = f"{advice.thing.regions[int(values['graspRegion']) - 1]} and method {method_name(values['handover'])}"
    return [f"  probabilities {exact}; together most probable: {together} ({proof.status}, gap {proof.gap:.2g})"]


def advice_data(advice: Advice, proof: ml.MapState | None = None) -> dict[str, Any]:
    """The same as plain data; poses in the world, lengths in [m]."""
    answer, found = advice.answer, advice.configuration
    out: dict[str, Any] = {
        "object": advice.thing.name, "task": advice.task, "levels": dict(answer.levels), "region": answer.region,
        "role": answer.role, "method": answer.method, "confidence": answer.confidence,
        "regions": dict(answer.regions), "methods": dict(answer.methods), "standard_error": answer.error,
        "reasons": [{"about": r.predicate, "winner": r.winner, "runner_up": r.runner_up, "formula": r.formula,
                     "log_odds": r.log_odds, "because": r.because} for r in advice.reasons],
    }  # fmt: skip
    if proof is not None:
        out["together"] = {"true": list(proof.true_atoms), "status": proof.status, "gap": proof.gap}
    if found is not None:
        out |= {"object_pose": found.thing.to_dict(), "tool_pose": found.hold.tool.to_dict(),
                "joints_rad": found.hold.q.tolist(), "human_grasp_m": found.human_grasp.tolist()}  # fmt: skip
    return out
