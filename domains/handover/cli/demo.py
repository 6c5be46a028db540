"""The command `demo`: from training to a reasoned answer about an object that training never saw."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from mlnlite.domains.handover import load

if TYPE_CHECKING:
    from mlnlite.domains.handover.knowledge.advise import Advice
    from mlnlite.domains.handover.knowledge.ask import Knowledge


@click.command()
@click.option("--out", "-o", default="out", show_default=True, type=click.Path(file_okay=False), help="Folder.")
@click.option("--object", "thing", default="mug", show_default=True, help="Object that training does not see.")
@click.option("--task", default="to_pour", show_default=True, help="What the receiver will do with it.")
@click.option("--level", default="L", show_default=True, help="Their arm mobility.")
def demo(out: str, thing: str, task: str, level: str) -> None:
    """Train on generated instances, hand an unseen object over, say why, draw it and simulate it."""
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    scene = load("scene.scene").make_scene(thing, task, level)
    knowledge = _trained(folder, thing)
    advice = load("knowledge.advise").advise(knowledge, scene)
    proof = load("knowledge.ask").certify(knowledge, scene.thing, task, level)
    click.echo("\n" + load("knowledge.advise").advice_text(advice, proof) + "\n")
    _draw(folder, advice)
    _simulate(folder, advice)
    click.echo(f"written to {folder}:")
    for name, what in _WRITTEN.items():
        if (folder / name).exists():
            click.echo(f"  {name:<20} {what}")
    click.echo(f"Open {folder / 'handover.html'} in a browser. To turn the sliders yourself: "
               f"mlnlite handover optimise --object {thing} --task {task} --level {level} --view")  # fmt: skip


_WRITTEN = {
    "handover-learnt.mln": "the learnt model",
    "handover.png": "costs about the receiver, and the scene from the side",
    "reach.png": "the reach cost in 3-D",
    "preferences.png": "what people of each mobility prefer, which the instances follow",
    "execution.jsonl": "the simulated execution, step by step",
    "handover.html": "the same as a scene that plays in a browser",
}


def _trained(folder: Path, thing: str) -> Knowledge:
    """A model of all generated instances but those of one object."""
    generate, training = load("instances.generate"), load("knowledge.train")
    rows = [row for row in generate.generate() if row.thing != thing]
    click.echo(f"training on {len(rows):,} generated instances of {len({r.thing for r in rows})} objects, "
               f"{thing} left out")  # fmt: skip
    learned = training.train(load("knowledge.words").read_knowledge(), generate.facts_of(rows))
    training.write_knowledge(learned, folder / "handover-learnt.mln")
    knowledge: Knowledge = load("knowledge.ask").open_knowledge(learned.model)
    return knowledge


def _draw(folder: Path, advice: Advice) -> None:
    figures, fields = load("show.figures"), load("search.fields")
    figures.save(load("study.figures").draw_preferences(load("study.simulate").simulate()), folder / "preferences.png")
    found, scene = advice.configuration, advice.scene
    if found is not None and scene is not None:
        grasps = load("scene.grasps").sample_grasps(scene.thing, scene.robot.gripper)
        figures.save(figures.draw_configuration(scene, found), folder / "handover.png")
        figures.save(figures.draw_field(fields.cost_field(scene, grasps, found.grasp, fields.Options())),
                     folder / "reach.png")  # fmt: skip


def _simulate(folder: Path, advice: Advice) -> None:
    """Does what the advice says, with a hand that drifts."""
    simulate, level = load("execution.simulate"), load("knowledge.ask").likeliest(advice.answer.levels)
    case = simulate.Case(advice.thing.name, advice.task, level, advice.answer.method, "pr2", "drift")
    run, track = simulate.simulate(case)
    found = simulate.judge(case, run, track)
    load("execution.log").write_log(run, folder / "execution.jsonl")
    load("execution.replay").record(simulate.scene_at(case, None), run, folder / "handover.html")
    click.echo(f"simulated: {run.end} after {run.time:.1f} s, {run.replans} new plans, never nearer than "
               f"{100 * found.nearest:.1f} cm to hand or face while moving\n")  # fmt: skip
