"""The command `demo`: from training to a reasoned answer about an object that training never saw."""

from __future__ import annotations

from pathlib import Path

import click

from mlnlite.domains.handover import load


@click.command()
@click.option("--out", "-o", default="out", show_default=True, type=click.Path(file_okay=False), help="Folder.")
@click.option("--object", "thing", default="mug", show_default=True, help="Object that training does not see.")
@click.option("--task", default="to_pour", show_default=True, help="What the receiver will do with it.")
@click.option("--level", default="L", show_default=True, help="Their arm mobility.")
def demo(out: str, thing: str, task: str, level: str) -> None:
    """Train on generated instances, hand an unseen object over, say why, draw it and simulate it."""
    generate, training, words = load("instances.generate"), load("knowledge.train"), load("knowledge.words")
    asking, advising, simulate = load("knowledge.ask"), load("knowledge.advise"), load("execution.simulate")
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    rows = [row for row in generate.generate() if row.thing != thing]
    click.echo(
        f"training on {len(rows):,} generated instances of {len({r.thing for r in rows})} objects, {thing} left out"
    )
    learned = training.train(words.read_knowledge(), generate.facts_of(rows))
    training.write_knowledge(learned, folder / "handover-learnt.mln")
    knowledge, known = asking.open_knowledge(learned.model), load("objects").read_object(thing)
    advice = advising.advise(knowledge, known, task, level)
    click.echo(advising.advice_text(advice, asking.certify(knowledge, known, task, level)))
    figures = load("figures")
    written = ["handover-learnt.mln"]
    if advice.configuration is not None:
        figures.save(figures.draw_configuration(advice.scene, advice.configuration), folder / "handover.png")
        written.append("handover.png")
    survey = load("study.simulate").simulate()
    figures.save(load("study.figures").draw_preferences(survey), folder / "preferences.png")
    case = simulate.Case(thing, task, level, advice.answer.method, "pr2", "drift")
    run, track = simulate.simulate(case)
    found = simulate.judge(case, run, track)
    load("execution.log").write_log(run, folder / "execution.jsonl")
    load("execution.replay").record(simulate.scene_at(case, None), run, folder / "execution.viser")
    click.echo(f"simulated: {run.end} after {run.time:.1f} s, {run.replans} new plans, never nearer than "
               f"{100 * found.nearest:.1f} cm while moving")  # fmt: skip
    written += ["preferences.png", "execution.jsonl", "execution.viser"]
    click.echo(f"written to {folder}: {', '.join(written)}")
    click.echo(f"in the browser: mlnlite handover optimise --object {thing} --task {task} --level {level} --view")
