"""The report of a survey: `Survey` in, Markdown and figures out."""

from __future__ import annotations

from pathlib import Path

from mlnlite.domains.handover.show.figures import save
from mlnlite.domains.handover.study import analysis, figures
from mlnlite.domains.handover.study.keywords import keyword_shares
from mlnlite.domains.handover.study.preferences import association, bayes_ceiling, published
from mlnlite.domains.handover.study.survey import RANKED, Survey


def report(survey: Survey) -> str:
    """All statistics as Markdown."""
    parts = ["# Study", f"Answers: {survey.source}; {survey.n} people.", _published(), _preferences(survey),
             _anova(survey), _ordinal(survey), _ranks(survey), _keywords(survey)]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def write_report(survey: Survey, folder: Path) -> None:
    """Writes `study.md` with its figures."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures = {
        "preferences": figures.draw_preferences(survey),
        "ratings": figures.draw_ratings(survey),
        "ranks": figures.draw_ranks(analysis.consensus(survey), survey.source),
        "keywords": figures.draw_keywords(keyword_shares(survey.levels, survey.comments), survey.source),
    }
    for name, figure in pictures.items():
        save(figure, folder / f"study-{name}.png")
    shown = "\n\n".join(f"![{name}](study-{name}.png)" for name in pictures)
    (folder / "study.md").write_text(f"{report(survey)}\n## Figures\n\n{shown}\n", encoding="utf-8")


def _published() -> str:
    table = published()
    found = association(table.counts)
    columns = zip(table.levels, table.counts.tolist(), table.participants.tolist(), strict=True)
    rows = [f"| {level} | {' | '.join(map(str, counts))} | {sum(counts)} | {n} |" for level, counts, n in columns]
    return "\n".join([
        "## Preferences as published", "",
        "| level | A | B | ours | answers | participants |", "|---|---|---|---|---|---|", *rows, "",
        f"chi2({found.dof}) = {found.chi2:.1f}, p = {found.p:.1g}, Cramer's V = {found.cramers_v:.2f}. "
        f"Who knows the level guesses the method right in at most {100 * bayes_ceiling(table.counts):.1f} % (Bayes "
        "ceiling).",
    ])  # fmt: skip


def _preferences(survey: Survey) -> str:
    counts = analysis.preference_counts(survey)
    kept = counts[counts.sum(axis=1) > 0][:, counts.sum(axis=0) > 0]
    lines = ["## Preferences of this survey", "", "| level | A | B | ours |", "|---|---|---|---|"]
    lines += [f"| {level} | {' | '.join(map(str, row))} |"
              for level, row in zip(published().levels, counts.tolist(), strict=True)]  # fmt: skip
    if min(kept.shape) > 1:
        found = association(kept)
        lines += ["", f"chi2({found.dof}) = {found.chi2:.1f}, p = {found.p:.1g}, Cramer's V = {found.cramers_v:.2f}."]
    return "\n".join(lines)


def _anova(survey: Survey) -> str:
    lines = ["## Ratings: mixed analysis of variance", "",
             "Level between people, method within; p of the method is Greenhouse-Geisser corrected.", "",
             "| aspect | effect | degrees of freedom | F | p | partial eta squared |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    found = analysis.mixed_anova(survey)
    for e in found:
        lines.append(
            f"| {e.aspect} | {e.source} | {e.dof[0]:.0f}, {e.dof[1]:.0f} | {e.f:.2f} | {e.p:.2g} | {e.eta2:.3f} |"
        )
    return "\n".join(lines if found else [*lines[:2], _TOO_FEW])


def _ordinal(survey: Survey) -> str:
    lines = ["## Ratings: rank tests", "",
             "Friedman: methods within a level (effect: Kendall's W); Kruskal: levels within a method (effect: epsilon "
             "squared). Holm-corrected.", "", "| aspect | test | group | statistic | p | effect |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    found = analysis.ordinal_check(survey)
    for o in found:
        lines.append(f"| {o.aspect} | {o.test} | {o.group} | {o.statistic:.2f} | {o.p:.2g} | {o.effect:.3f} |")
    return "\n".join(lines if found else [*lines[:2], _TOO_FEW])


_TOO_FEW = "Not tested: that takes two levels of two people each, and ratings that differ."


def _ranks(survey: Survey) -> str:
    lines = ["## Ranks of aspects", "", "Medians with 95 % bootstrap intervals; 1 is most important.", "",
             f"| level | n | {' | '.join(RANKED)} | Kendall's W |", "|---" * (len(RANKED) + 3) + "|"]  # fmt: skip
    for c in analysis.consensus(survey):
        cells = [f"{m:g} [{a:g}, {b:g}]" for m, a, b in zip(c.medians, c.low, c.high, strict=True)]
        w = f"{c.w:.2f} [{c.w_interval[0]:.2f}, {c.w_interval[1]:.2f}]"
        lines.append(f"| {c.level} | {c.n} | {' | '.join(cells)} | {w} |")
    return "\n".join(lines)


def _keywords(survey: Survey) -> str:
    lines = ["## Open answers", "", "Share of people who name a keyword plainly, and only under a negation.", "",
             "| level | keyword | plainly | negated |", "|---|---|---|---|"]  # fmt: skip
    for s in keyword_shares(survey.levels, survey.comments):
        lines.append(f"| {s.level} | {s.keyword} | {100 * s.plain:.1f} % | {100 * s.negated:.1f} % |")
    return "\n".join(lines)
