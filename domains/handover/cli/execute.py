"""The command `execute`: simulated handovers, one with its log, or many with their causes counted."""

from __future__ import annotations

from typing import Any

import click

from mlnlite.domains.handover import load
from mlnlite.domains.handover.cli.options import COUNT, OutFile


@click.command()
@click.option("--object", "thing", default="mug", show_default=True, help="Object of the catalogue.")
@click.option("--task", default="to_hand_over", show_default=True, help="What the receiver will do with it.")
@click.option("--level", default="H", show_default=True, help="Arm mobility: H, H-M, L-M, L.")
@click.option("--robot", default="pr2", show_default=True, help="pr2 or panda.")
@click.option("--model", type=click.Path(dir_okay=False), help="A learnt model that chooses the method; else ours.")
@click.option("--script", default="drift", show_default=True, help="still, drift, nervous, lunge or withdraw.")
@click.option("--track", type=click.Path(dir_okay=False), help="A recorded track of hand and face (JSON).")
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of noise, loss of sight and the script."
)
@click.option("--log", type=OutFile(), help="Write the run as JSON lines, or as .parquet.")
@click.option(
    "--replay", type=OutFile((".html", ".viser")), help="Write the run as a page to play, .html, or as .viser."
)
@click.option("-n", "--many", type=COUNT, help="Simulate so many random cases instead, and count the causes.")
@click.option("--workers", default=2, type=COUNT, show_default=True, help="Processes for many cases.")
def execute(**given: Any) -> None:  # noqa: ANN401 - click passes every option by name
    """Simulate a handover: perceive, infer, plan, grasp, approach, hold, release."""
    simulate, tables = load("execution.simulate"), load("tables")
    if given["many"]:
        cases = simulate.random_cases(given["many"], seed=given["seed"])
        click.echo(simulate.summary(simulate.run_cases(cases, workers=given["workers"])), nl=False)
        return
    tracks = load("execution.tracks")
    script = tables.choose(given["script"], tracks.SCRIPTS, "script")
    case = simulate.Case(given["thing"], given["task"], given["level"], _method(given), given["robot"], script,
                         given["seed"])  # fmt: skip
    run, track = simulate.simulate(case, tracks.read_track(given["track"]) if given["track"] else None)
    found = simulate.judge(case, run, track)
    for moment in run.moments:
        if moment.event and moment.event != "waits":
            click.echo(f"{moment.time:7.2f} s  {moment.state:<9} {moment.event}")
    click.echo(f"{run.end}{': ' + run.cause if run.cause else ''}, {run.replans} new plans, nearest motion "
               f"{100 * found.nearest:.1f} cm from hand or face, {found.violations} violations")  # fmt: skip
    if given["log"]:
        load("execution.log").write_log(run, given["log"])
    if given["replay"]:
        load("execution.replay").record(simulate.scene_at(case, None), run, given["replay"])


def _method(given: dict[str, Any]) -> str:
    """What the learnt model answers, or ours."""
    if not given["model"]:
        return "ours"
    asking, thing = load("knowledge.ask"), load("scene.objects").read_object(given["thing"])
    return str(asking.ask(asking.read_learnt(given["model"]), thing, given["task"], given["level"]).method)
