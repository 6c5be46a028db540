"""Commands about what the domain knows: `dataset`, `train`, `query`. Printed here and nowhere below."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from mlnlite.domains.handover import load
from mlnlite.domains.handover.cli.options import COUNT, SOLVERS, OutFile

_LABELS = click.option("--labels", default="sampled", show_default=True,
                       help="sampled from the study's preferences, or what is preferred.")  # fmt: skip
_SEED = click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of every draw.")
_CATALOGUE = click.option("--catalogue", type=click.Path(dir_okay=False), help="A TOML file of your own objects.")


@click.command()
@_LABELS
@_SEED
@click.option("--out", "-o", default="out", show_default=True, type=click.Path(file_okay=False), help="Folder.")
@click.option("--poses/--no-poses", default=True, show_default=True, help="Run the cost model on every cell.")
@click.option("--robot", default="pr2", show_default=True, help="The giver.")
@click.option("--workers", default=2, type=COUNT, show_default=True, help="Processes for the cost model.")
def dataset(labels: str, seed: int, out: str, poses: bool, robot: str, workers: int) -> None:
    """Write 1,657 training instances: 259 study rows and 1,398 synthetic ones over 32 objects."""
    generate, placing, write = load("instances.generate"), load("instances.poses"), load("instances.write")
    instances = generate.generate(labels, seed=seed)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    objects = load("scene.objects")
    things = [objects.read_object(name) for name in objects.object_names()]
    placed = {}
    if poses:
        levels = [level.name for level in load("scene.mobility").read_levels()]
        placed = placing.place_all(placing.all_cells(things, levels), robot=robot, workers=workers)
        write.write_templates(placing.templates(placed, {t.name: t.shape for t in things}), folder / "poses.csv")
    write.write_db(instances, folder / f"instances-{labels}.db")
    write.write_rows(instances, placed, folder / f"instances-{labels}.csv")
    n_study = sum(instance.source == "study" for instance in instances)
    click.echo(f"{len(instances):,} instances over {len({i.thing for i in instances})} objects, labels {labels}: "
               f"{n_study} study rows, {len(instances) - n_study:,} synthetic")  # fmt: skip
    click.echo(f"written: {folder}/instances-{labels}.db, .csv" + (f", {folder}/poses.csv" if poses else ""))


@click.command()
@click.option(
    "--model", "variant", default="handover", show_default=True, help="handover, backoff, pairs, paper, affordance."
)
@_LABELS
@_SEED
@click.option("--data", type=click.Path(dir_okay=False), help="A table of `dataset`; by default it is generated anew.")
@click.option("--without", default="", help="Objects to leave out, separated by commas.")
@click.option("--out", "-o", default="handover-learnt.mln", show_default=True, type=OutFile(), help="The learnt model.")
def train(variant: str, labels: str, seed: int, data: str | None, without: str, out: str) -> None:
    """Learn the weights of a model of the domain."""
    generate = load("instances.generate")
    rows = load("instances.write").read_rows(data) if data else generate.generate(labels, seed=seed)
    names = load("scene.objects").object_names()
    absent = {load("tables").choose(name, names, "object") for name in without.split(",") if name}
    rows = [row for row in rows if row.thing not in absent]
    knowledge, training = load("knowledge.words"), load("knowledge.train")
    learned = training.train(knowledge.read_knowledge(variant), generate.facts_of(rows))
    training.write_knowledge(learned, out)
    click.echo(f"{variant}: {len(rows):,} instances of {len({r.thing for r in rows})} objects, labels {labels}")
    click.echo(str(learned))
    click.echo(f"written: {out}")


@click.command()
@click.argument("model", type=click.Path(dir_okay=False))
@click.option("--object", "thing", default="mug", show_default=True, help="Object of the catalogue, known or unseen.")
@click.option("--task", default="to_hand_over", show_default=True, help="What the receiver will do with it.")
@click.option("--level", default="H", show_default=True,
              help="Arm mobility: H, H-M, L-M, L; `unknown`; or shares as L=0.7,L-M=0.3.")  # fmt: skip
@click.option("--robot", default="pr2", show_default=True, help="pr2, panda, or the path of a URDF.")
@click.option("--solver", default="auto", show_default=True, type=SOLVERS, help="Of the most probable world.")
@click.option("--place/--no-place", default=True, show_default=True, help="Also optimise poses of object and grasp.")
@_CATALOGUE
@click.option("--format", "form", type=click.Choice(["text", "json"]), default="text", show_default=True)
@click.pass_context
def query(context: click.Context, /, **given: Any) -> None:  # noqa: ANN401 - click passes every option by name
    """Ask a learnt model where to hand an object over, how to hold it, and why."""
    context.meta["mlnlite.format"] = given["form"]
    level = parse_level(given["level"])
    asking, advising = load("knowledge.ask"), load("knowledge.advise")
    thing = load("scene.objects").read_object(given["thing"], catalogue=given["catalogue"])
    knowledge = asking.read_learnt(given["model"])
    if given["place"]:
        scene = load("scene.scene").make_scene(thing, given["task"], asking.likeliest(level), given["robot"])
        advice = advising.advise(knowledge, scene, level)
    else:
        advice = advising.advise_without_poses(knowledge, thing, given["task"], level)
    proof = asking.certify(knowledge, thing, given["task"], level, method=given["solver"])
    echo = json.dumps(advising.advice_data(advice, proof), indent=2) if given["form"] == "json" else None
    click.echo(echo or advising.advice_text(advice, proof))


def parse_level(text: str) -> str | dict[str, float]:
    """A level as the command line has it: a name, `unknown`, or shares as `L=0.7,L-M=0.3`."""
    if "=" not in text:
        return text
    pairs = [part.partition("=") for part in text.split(",")]
    try:
        return {name.strip(): float(share) for name, _, share in pairs}
    except ValueError:
        raise click.BadParameter(f"{text!r} are no shares; write them as L=0.7,L-M=0.3", param_hint="--level") from None
