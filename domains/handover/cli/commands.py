"""The commands `mlnlite handover ...`: the only place of the domain that prints. Heavy imports wait inside commands."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mlnlite.domains.handover import load
from mlnlite.domains.handover.cli.demo import demo
from mlnlite.domains.handover.cli.evaluate import evaluate
from mlnlite.domains.handover.cli.execute import execute
from mlnlite.domains.handover.cli.knowledge import dataset, query, train
from mlnlite.domains.handover.cli.options import COUNT, PICTURES, OutFile
from mlnlite.domains.handover.cli.study import study

if TYPE_CHECKING:
    from mlnlite.domains.handover.scene.scene import Scene
    from mlnlite.domains.handover.search.fields import Options
    from mlnlite.domains.handover.search.hierarchical import Configuration, Handover
    from mlnlite.domains.handover.show.report import Row


@dataclass(frozen=True, slots=True)
class _Words:
    """What the user said about a scene."""

    thing: str
    task: str
    level: str
    robot: str
    tool: str
    base: tuple[float, float, float, float] | None
    posture: str
    side: str
    height: float
    mass: float
    hand: tuple[float, float, float] | None
    catalogue: str | None
    levels: str | None
    voxels: int
    step: float


_SCENE = [
    click.option("--object", "thing", default="mug", show_default=True, help="Object of the catalogue."),
    click.option("--task", default="to_hand_over", show_default=True, help="What the receiver will do with it."),
    click.option("--level", default="H", show_default=True, help="Arm mobility: H, H-M, L-M, L."),
    click.option("--robot", default="pr2", show_default=True, help="pr2, panda, or the path of a URDF."),
    click.option("--tool", default="", help="Frame of the grasp centre in a URDF of your own; by default its last."),
    click.option("--base", type=(float, float, float, float), help="The robot's base: x y z [m], heading [rad]."),
    click.option("--posture", default="standing", show_default=True, help="standing or seated."),
    click.option("--side", default="right", show_default=True, help="The hand that takes: right or left."),
    click.option("--height", default=1.74, show_default=True, help="Stature of the receiver [m]."),
    click.option("--mass", default=73.0, show_default=True, help="Body mass of the receiver [kg]."),
    click.option("--hand", type=(float, float, float), help="Position of the palm, x y z [m]."),
    click.option("--catalogue", type=click.Path(dir_okay=False), help="A TOML file of your own objects."),
    click.option("--levels", type=click.Path(dir_okay=False), help="A TOML file of your own mobility levels."),
    click.option("--voxels", default=15, type=COUNT, show_default=True, help="Voxels along each axis."),
    click.option("--step", default=0.03, show_default=True, help="Edge of a voxel [m]."),
]


def _scene_options(command: Callable[..., None]) -> Callable[..., None]:
    for option in reversed(_SCENE):
        command = option(command)
    return command


def _scene(words: _Words) -> Scene:
    from dataclasses import replace

    scenes, receivers, objects = load("scene.scene"), load("scene.receiver"), load("scene.objects")
    body = replace(receivers.Body(), height=words.height, mass=words.mass, side=words.side, posture=words.posture)
    base = load("kinematics.pose").pose_at(*words.base) if words.base else None
    layout = scenes.Layout(words.hand, base, (words.voxels,) * 3, words.step)
    thing = objects.read_object(words.thing, catalogue=words.catalogue)
    receiver = receivers.read_receiver(load("scene.mobility").read_level(words.level, words.levels), body)
    robot = load("scene.robots").read_robot(words.robot, tool=words.tool)
    found: Scene = scenes.make_scene(thing, words.task, receiver, robot, layout=layout)
    return found


@click.group()
def handover() -> None:
    """Where and how to hand an object over."""


@handover.command()
@_scene_options
@click.option("--method", default="ours", show_default=True, help="A, B or ours.")
@click.option("--surface", is_flag=True, help="Distances of surfaces instead of points.")
@click.option("--exhaustive", is_flag=True, help="Ask about every voxel; same answer, slower.")
@click.option("--format", "form", type=click.Choice(["text", "json"]), default="text", show_default=True)
@click.option("--figure", type=OutFile(PICTURES), help="Write cost slices and a side view to an image.")
@click.option("--field", type=OutFile(PICTURES), help="Write the reach cost in 3-D to an image.")
@click.option("--view", is_flag=True, help="Show the scene in the browser until interrupted.")
@click.option("--port", default=8080, show_default=True, help="Of the browser view.")
@click.pass_context
def optimise(context: click.Context, /, **given: Any) -> None:  # noqa: ANN401 - click passes every option by name
    """Find where to hold the object and how."""
    keys = {name: given.pop(name) for name in _Words.__slots__}
    context.meta["mlnlite.format"] = given["form"]
    scene = _scene(_Words(**keys))
    options = load("search.fields").Options(distance="surface" if given["surface"] else "point")
    if given["method"] == "ours":
        result = load("search.hierarchical").optimise(scene, options, exhaustive=given["exhaustive"])
    else:
        result = load("search.methods").hand_over(scene, given["method"], options)
    found = load("search.hierarchical").require(result)
    (_print_json if given["form"] == "json" else _print_text)(scene, result, found)
    _save_pictures(scene, found, options, given["figure"], given["field"])
    if given["view"]:
        load("show.viewer").serve(scene, port=given["port"])


def _save_pictures(scene: Scene, found: Configuration, options: Options, figure: str | None, field: str | None) -> None:
    if figure:
        figures = load("show.figures")
        figures.save(figures.draw_configuration(scene, found, options), figure)
    if field:
        figures, grasps = load("show.figures"), load("scene.grasps").sample_grasps(scene.thing, scene.robot.gripper)
        figures.save(figures.draw_field(load("search.fields").cost_field(scene, grasps, found.grasp, options)), field)


def _print_text(scene: Scene, result: Handover, found: Configuration) -> None:
    place, checks = found.thing.position, load("search.checks").five_checks(scene, found)
    region = scene.thing.regions[scene.region]
    lines = [
        f"{scene.thing.name} {scene.task} to a receiver of mobility {scene.receiver.level.name} "
        f"({scene.receiver.level.title}) by {scene.robot.name}, method {found.method}: {result.status}",
        f"  object at          {place[0]:.3f} {place[1]:.3f} {place[2]:.3f} m, quaternion wxyz "
        + " ".join(f"{v:.3f}" for v in found.thing.quaternion),
        f"  receiver takes     {region} at {' '.join(f'{v:.3f}' for v in found.human_grasp)} m",
        f"  robot holds        C_A {100 * found.appropriateness:.1f} cm from it, joints "
        + " ".join(f"{v:.3f}" for v in found.hold.q) + " rad",
        f"  safety C_S {found.safety:.3f} m, reach C_R {found.reach:.3f} m, bound {result.bound:.3f} m, "
        f"{result.ik_calls} calls of the inverse kinematics over {result.voxels} voxels",
    ]  # fmt: skip
    click.echo("\n".join(lines + [f"  {'pass' if c.passed else 'FAIL'} {c.name:<11} {c.finding}" for c in checks]))


def _print_json(scene: Scene, result: Handover, found: Configuration) -> None:
    checks = load("search.checks").five_checks(scene, found)
    click.echo(json.dumps({
        "object": scene.thing.name, "task": scene.task, "level": scene.receiver.level.name, "robot": scene.robot.name,
        "method": found.method, "status": result.status, "object_pose": found.thing.to_dict(),
        "tool_pose": found.hold.tool.to_dict(), "joints_rad": found.hold.q.tolist(),
        "human_grasp_m": found.human_grasp.tolist(), "region": scene.thing.regions[scene.region],
        "costs_m": {"appropriateness": found.appropriateness, "safety": found.safety, "reach": found.reach},
        "bound_m": result.bound, "ik_calls": result.ik_calls, "voxels": result.voxels,
        "checks": {c.name: {"passed": c.passed, "finding": c.finding} for c in checks},
    }, indent=2))  # fmt: skip


@handover.command()
@click.option("--objects", default="", help="Names separated by commas; by default all.")
@click.option("--robot", default="pr2", show_default=True, help="Robots separated by commas.")
@click.option("--posture", default="standing", show_default=True, help="standing or seated.")
@click.option("--out", type=click.Path(file_okay=False), help="Folder for effort.md and effort.png.")
def effort(objects: str, robot: str, posture: str, out: str | None) -> None:
    """Compare the receiver's effort under methods A, B and ours at each level."""
    rows = _rows(objects, robot, posture, checks=False)
    text = load("show.report").effort_markdown(rows)
    click.echo(text)
    if out:
        figures = load("show.figures")
        Path(out).mkdir(parents=True, exist_ok=True)
        (Path(out) / "effort.md").write_text(_EFFORT.format(robot=robot, posture=posture, table=text))
        figures.save(figures.draw_effort(rows), Path(out) / "effort.png")


@handover.command()
@click.option("--objects", default="", help="Names separated by commas; by default all.")
@click.option("--robot", default="pr2,panda", show_default=True, help="Robots separated by commas.")
@click.option("--posture", default="standing", show_default=True, help="standing or seated.")
@click.option("--out", type=click.Path(file_okay=False), help="Folder for compare.md.")
def compare(objects: str, robot: str, posture: str, out: str | None) -> None:
    """Put methods A, B and ours through the five checks on every object, level and robot."""
    text = load("show.report").checks_markdown(_rows(objects, robot, posture, checks=True))
    click.echo(text)
    if out:
        Path(out).mkdir(parents=True, exist_ok=True)
        (Path(out) / "compare.md").write_text(_COMPARE.format(robot=robot, posture=posture, table=text))


def _rows(objects: str, robot: str, posture: str, *, checks: bool) -> tuple[Row, ...]:
    names = [name for name in objects.split(",") if name] or load("scene.objects").object_names()
    body = load("scene.receiver").Body(posture=posture)
    rows: tuple[Row, ...] = load("show.report").run(names, robot.split(","), body, checks=checks)
    return rows


_EFFORT = """# Effort of the receiver

Written by `mlnlite handover effort --robot {robot} --posture {posture} --out docs/handover`; do not edit.

{table}
![effort by level and method](effort.png)
"""

_COMPARE = """# Five checks

Written by `mlnlite handover compare --robot {robot} --posture {posture} --out docs/handover`; do not edit.

{table}"""


for _command in (study, dataset, train, query, evaluate, execute, demo):
    handover.add_command(_command)
