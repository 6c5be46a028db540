"""Robot-to-human handovers that mind affordances and arm mobility: where to hand an object over, how to hold it, why.

After Ardon et al. (2021), "Affordance-Aware Handovers with Human Arm Mobility Constraints", on real kinematics. The
names below are loaded when first used, so that importing this package costs nothing; they need the extra
`mlnlite[handover]`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mlnlite import MissingPart, Plugin

if TYPE_CHECKING:
    import click

    from mlnlite.domains.handover.instances.generate import facts_of as facts_of
    from mlnlite.domains.handover.instances.generate import generate as generate
    from mlnlite.domains.handover.kinematics.ik import damped_least_squares as damped_least_squares
    from mlnlite.domains.handover.kinematics.pose import Pose as Pose
    from mlnlite.domains.handover.knowledge.advise import Advice as Advice
    from mlnlite.domains.handover.knowledge.advise import advice_text as advice_text
    from mlnlite.domains.handover.knowledge.advise import advise as advise
    from mlnlite.domains.handover.knowledge.ask import Answer as Answer
    from mlnlite.domains.handover.knowledge.ask import Knowledge as Knowledge
    from mlnlite.domains.handover.knowledge.ask import ask as ask
    from mlnlite.domains.handover.knowledge.ask import certify as certify
    from mlnlite.domains.handover.knowledge.ask import explain as explain
    from mlnlite.domains.handover.knowledge.ask import open_knowledge as open_knowledge
    from mlnlite.domains.handover.knowledge.ask import read_learnt as read_learnt
    from mlnlite.domains.handover.knowledge.train import train as train
    from mlnlite.domains.handover.knowledge.train import write_knowledge as write_knowledge
    from mlnlite.domains.handover.knowledge.words import read_knowledge as read_knowledge
    from mlnlite.domains.handover.scene.effort import Effort as Effort
    from mlnlite.domains.handover.scene.effort import effort_at as effort_at
    from mlnlite.domains.handover.scene.effort import effort_of as effort_of
    from mlnlite.domains.handover.scene.effort import reachable_set as reachable_set
    from mlnlite.domains.handover.scene.grasps import sample_grasps as sample_grasps
    from mlnlite.domains.handover.scene.mobility import MobilityLevel as MobilityLevel
    from mlnlite.domains.handover.scene.mobility import read_levels as read_levels
    from mlnlite.domains.handover.scene.objects import HandoverObject as HandoverObject
    from mlnlite.domains.handover.scene.objects import object_names as object_names
    from mlnlite.domains.handover.scene.objects import read_object as read_object
    from mlnlite.domains.handover.scene.receiver import Body as Body
    from mlnlite.domains.handover.scene.receiver import Receiver as Receiver
    from mlnlite.domains.handover.scene.receiver import read_receiver as read_receiver
    from mlnlite.domains.handover.scene.robots import Gripper as Gripper
    from mlnlite.domains.handover.scene.robots import Robot as Robot
    from mlnlite.domains.handover.scene.robots import read_robot as read_robot
    from mlnlite.domains.handover.scene.scene import Layout as Layout
    from mlnlite.domains.handover.scene.scene import Scene as Scene
    from mlnlite.domains.handover.scene.scene import make_scene as make_scene
    from mlnlite.domains.handover.search.checks import Check as Check
    from mlnlite.domains.handover.search.checks import five_checks as five_checks
    from mlnlite.domains.handover.search.checks import violations as violations
    from mlnlite.domains.handover.search.costs import Limits as Limits
    from mlnlite.domains.handover.search.costs import appropriateness as appropriateness
    from mlnlite.domains.handover.search.costs import reachability as reachability
    from mlnlite.domains.handover.search.costs import safety as safety
    from mlnlite.domains.handover.search.fields import Options as Options
    from mlnlite.domains.handover.search.fields import cost_field as cost_field
    from mlnlite.domains.handover.search.hierarchical import Configuration as Configuration
    from mlnlite.domains.handover.search.hierarchical import Handover as Handover
    from mlnlite.domains.handover.search.hierarchical import optimise as optimise
    from mlnlite.domains.handover.search.hierarchical import require as require
    from mlnlite.domains.handover.search.methods import hand_over as hand_over

_HOMES = {
    "search.checks": "Check five_checks violations",
    "search.costs": "Limits appropriateness reachability safety",
    "scene.effort": "Effort effort_at effort_of reachable_set",
    "search.fields": "Options cost_field",
    "scene.grasps": "sample_grasps",
    "kinematics.ik": "damped_least_squares",
    "instances.generate": "facts_of generate",
    "knowledge.advise": "Advice advice_text advise",
    "knowledge.ask": "Answer Knowledge ask certify explain open_knowledge read_learnt",
    "knowledge.train": "train write_knowledge",
    "knowledge.words": "read_knowledge",
    "search.methods": "hand_over",
    "scene.mobility": "MobilityLevel read_levels",
    "scene.objects": "HandoverObject object_names read_object",
    "search.hierarchical": "Configuration Handover optimise require",
    "kinematics.pose": "Pose",
    "scene.receiver": "Body Receiver read_receiver",
    "scene.robots": "Gripper Robot read_robot",
    "scene.scene": "Layout Scene make_scene",
}
_PUBLIC = {name: home for home, names in _HOMES.items() for name in names.split()}
_PARTS = (
    "pinocchio", "coal", "trimesh", "scipy", "numpy", "numba", "pink", "matplotlib", "viser", "pandas", "pingouin",
)  # fmt: skip


def load(module: str) -> Any:  # noqa: ANN401 - a module is what its user knows it to be
    """A module of this package by its short name.

    Raises:
        MissingPart: a package of the extra is not installed.
    """
    try:
        return import_module(f"{__name__}.{module}")
    except ModuleNotFoundError as reason:
        if reason.name is None or reason.name.split(".")[0] not in _PARTS:
            raise
        hint = 'pip install "mlnlite[handover]"'
        raise MissingPart(f"the handover domain needs the package {reason.name!r}", hint=hint) from None


def __getattr__(name: str) -> object:
    """Public names, on first use."""
    if name in _PUBLIC:
        return getattr(load(_PUBLIC[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Public names, for completion."""
    return sorted((*_PUBLIC, "load", "plugin"))


def _commands() -> click.Group:
    from mlnlite.domains.handover.cli.commands import handover

    return handover


plugin = Plugin(name="handover", summary="Where and how to hand an object over.", commands=_commands)
