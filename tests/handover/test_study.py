"""The study: counts, statistics, survey files."""

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import friedmanchisquare

import mlnlite as ml
from mlnlite.cli import mlnlite as command
from mlnlite.domains.handover.study.analysis import (
    consensus,
    holm,
    kendall_w,
    mixed_anova,
    ordinal_check,
    preference_counts,
)
from mlnlite.domains.handover.study.keywords import keyword_shares, mentions
from mlnlite.domains.handover.study.preferences import association, bayes_ceiling, published
from mlnlite.domains.handover.study.report import report
from mlnlite.domains.handover.study.simulate import simulate
from mlnlite.domains.handover.study.survey import Survey, read_survey, write_survey

pytestmark = pytest.mark.filterwarnings("ignore")


def test_published_table():
    table = published()
    assert table.counts.tolist() == [[42, 132, 5], [6, 17, 3], [1, 4, 9], [1, 5, 25]]
    assert table.participants.sum() == 259
    found = association(table.counts)
    assert (round(found.chi2, 1), found.dof, round(found.cramers_v, 2)) == (138.7, 6, 0.53)
    assert found.p == pytest.approx(2e-27, rel=0.2)
    assert round(100 * bayes_ceiling(table.counts), 1) == 73.2


def test_simulation_says_so_and_keeps_the_counts():
    survey = simulate(seed=1)
    assert survey.source.startswith("SIMULATED")
    assert survey.n == 259
    counts = preference_counts(survey)
    assert (counts >= published().counts).all()
    assert counts.sum(axis=1).tolist() == published().participants.tolist()
    assert np.array_equal(simulate(seed=1).ratings, survey.ratings)


def test_mixed_design_has_the_degrees_of_freedom_of_the_paper():
    dofs = {effect.source: effect.dof for effect in mixed_anova(simulate())}
    assert dofs == {"level": (3, 255), "method": (2, 510), "Interaction": (6, 510)}


def test_no_effect_is_seldom_found():
    p = [min(e.p for e in mixed_anova(simulate(seed=s, effect=0.0)) if e.source == "Interaction") for s in range(6)]
    assert sum(x < 0.05 / 3 for x in p) <= 1
    assert min(e.p for e in mixed_anova(simulate(seed=0)) if e.source == "Interaction") < 1e-4


def test_ordinal_check_against_scipy():
    survey = simulate()
    first = next(o for o in ordinal_check(survey) if (o.aspect, o.test, o.group) == ("safety", "Friedman", "L"))
    chosen = survey.ratings[np.array(survey.levels) == "L", :, 0]
    assert first.statistic == pytest.approx(friedmanchisquare(*chosen.T).statistic)


@pytest.mark.parametrize("chosen", [range(1), range(5), [0, 200], range(200, 259)])
def test_small_surveys_are_reported_without_what_they_cannot_tell(chosen):
    whole, chosen = simulate(), list(chosen)
    pick = lambda column: tuple(column[i] for i in chosen)  # noqa: E731
    small = Survey("few", pick(whole.levels), pick(whole.preferred), whole.ratings[chosen], whole.ranks[chosen],
                   pick(whole.comments))  # fmt: skip
    text = report(small)
    assert f"{len(chosen)} people" in text
    assert ("Not tested" in text) == (len(set(small.levels)) < 2 or len(chosen) < 4)
    assert "nan" not in text
    flat = replace(small, ratings=np.full_like(small.ratings, 3))
    assert mixed_anova(flat) == ordinal_check(flat) == ()


def test_concordance():
    assert kendall_w(np.tile(np.arange(1, 6), (7, 1))) == pytest.approx(1.0)
    assert kendall_w(np.array([[1, 2, 3, 4, 5], [5, 4, 3, 2, 1]])) == pytest.approx(0.0)
    for one in consensus(simulate(), n=50):
        assert (one.low <= one.medians).all()
        assert (one.medians <= one.high).all()


def test_holm():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert np.isnan(holm([0.01, float("nan")])[1])


def test_negated_keywords_count_apart():
    assert mentions("It is not safe, but easy.") == {"safety": False, "comfort": True}
    assert mentions("I wouldn't grasp it") == {"grasp": False}
    shares = {s.keyword: s for s in keyword_shares(["L", "L"], ["It is not safe", "very safe"])}
    assert (shares["safety"].plain, shares["safety"].negated) == (0.5, 0.5)


def test_survey_file_there_and_back(tmp_path):
    survey = simulate()
    write_survey(survey, tmp_path / "s.csv")
    again = read_survey(tmp_path / "s.csv")
    assert np.array_equal(again.ratings, survey.ratings)
    assert np.array_equal(again.ranks, survey.ranks)
    assert (again.levels, again.preferred, again.comments) == (survey.levels, survey.preferred, survey.comments)


@pytest.mark.parametrize(("old", "new", "message"), [
    ("participant,level", "participant,grade", "columns are missing: level"),
    ("\n1,H,", "\n1,X,", "unknown level in .*s.csv:2"),
    ("\n1,H,A,", "\n1,H,A,9", "safety_A is '9"),
])  # fmt: skip
def test_mistakes_in_a_survey_have_their_place(tmp_path, old, new, message):
    write_survey(simulate(), tmp_path / "s.csv")
    text = (tmp_path / "s.csv").read_text()
    (tmp_path / "s.csv").write_text(text.replace(old, new, 1))
    with pytest.raises(ml.MlnError, match=message):
        read_survey(tmp_path / "s.csv")


def test_command_writes_the_report(tmp_path):
    found = CliRunner().invoke(command, ["handover", "study", "-o", str(tmp_path)])
    assert found.exit_code == 0, found.output
    assert "chi2(6) = 138.7" in found.output
    names = {path.name for path in tmp_path.iterdir()}
    assert {"study.md", "study-ratings.png", "survey-simulated.csv"} <= names
