"""The command `study`: a survey file, or a simulation that says so, in; statistics and figures out."""

from __future__ import annotations

from pathlib import Path

import click

from mlnlite.domains.handover import load


@click.command()
@click.option("--data", type=click.Path(dir_okay=False), help="A survey file (CSV); by default one is simulated.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the simulation.")
@click.option("--out", "-o", type=click.Path(file_okay=False), help="Folder for study.md, its figures and survey.csv.")
def study(data: str | None, seed: int, out: str | None) -> None:
    """Analyse a user study: preferences, ratings, ranks, open answers."""
    surveys = load("study.survey")
    survey = surveys.read_survey(data) if data else load("study.simulate").simulate(seed=seed)
    reporting = load("study.report")
    click.echo(reporting.report(survey), nl=False)
    if out:
        reporting.write_report(survey, Path(out))
        if not data:
            surveys.write_survey(survey, Path(out) / "survey-simulated.csv")
