"""Tied weights, databases that count more than once, shared constants, going on, and the path of Laplace priors."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import mlnlite as ml
from mlnlite.cli import mlnlite as command
from mlnlite.learn import weights
from mlnlite.learn.data import counts
from mlnlite.learn.optimise.problem import log_likelihood
from mlnlite.learn.trust import verify

TEXT = "S(p)\nC(p)\nG(p, k!)\nk = {K1, K2}\nS(x) => C(x)\nC(x)\nS(x)\nS(x) ^ G(x, +k)\nC(x) ^ G(x, +k)\n"
FIRST = "S(A)\nS(B)\nC(A)\nC(D)\nG(A, K1)\nG(B, K2)\nG(D, K1)"
SECOND = "S(E)\nC(E)\nC(H)\nG(E, K2)\nG(H, K2)"
OBJECTIVES = ["pseudo-likelihood", "likelihood", "composite", "max-margin"]


def read(*databases, text=TEXT):
    model = ml.model_from_text(text)
    return model, ml.evidence_from_text("\n---\n".join(databases), model=model)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_a_database_that_counts_twice(objective):
    model, data = read(FIRST, SECOND)
    twice = ml.learn(model, data, objective=objective, database_weights=[2, 1], prior=2.0)
    copied = ml.learn(*read(FIRST, FIRST, SECOND), objective=objective, prior=2.0)
    assert twice.weights == pytest.approx(copied.weights, abs=1e-3 if objective == "max-margin" else 1e-6)
    assert twice.value == pytest.approx(copied.value, abs=1e-3 if objective == "max-margin" else 1e-6)


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_tied_weights_are_equal_and_best(objective):
    """Tying S(x) and C(x) is the same as one formula whose counts are those of both."""
    model, data = read(FIRST, SECOND)
    groups = [["formula 2", "S(x)"], ["formula 4", "formula 5"]]
    tied = ml.learn(model, data, objective=objective, tied=groups, prior=2.0)
    w = tied.weights
    assert w[1] == w[2]
    assert (w[3:5] == w[5:7]).all()
    if objective == "max-margin":
        return
    free = ml.learn(model, data, objective=objective, prior=2.0)
    slope = log_likelihood(free.problem, w)[1]
    assert slope[0] == pytest.approx(w[0] / 4, abs=1e-6)
    assert slope[1] + slope[2] == pytest.approx(w[1] / 4, abs=1e-6)
    assert slope[3:5] + slope[5:7] == pytest.approx(w[3:5] / 4, abs=1e-6)
    found = ml.uncertainty(tied, data, method="information")
    assert found.sd[1] == found.sd[2] > 0
    assert found.correlation[1, 2] == pytest.approx(1.0)


def test_tied_weights_with_wide_components(monkeypatch):
    from mlnlite.learn.objectives import exact

    model, data = read(FIRST)
    options = {"objective": "likelihood", "tied": [["formula 2", "formula 3"]], "predict": ["S", "C"], "prior": 2.0}
    listed = ml.learn(model, data, **options)
    spread = ml.uncertainty(listed, data, method="information")
    monkeypatch.setattr(exact, "MOST_WORLDS", 0)
    wide = ml.learn(model, data, **options)
    assert wide.weights == pytest.approx(listed.weights, abs=1e-5)
    found = ml.uncertainty(wide, data, method="information")
    assert found.sd == pytest.approx(spread.sd, rel=1e-3, nan_ok=True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tied": [["formula 1", "formula 9"]]}, "no formula 'formula 9' to tie"),
        ({"tied": [["formula 1", "formula 4"]]}, "different numbers of weights"),
        ({"database_weights": [1.0]}, "2 databases, and as many positive weights"),
    ],
)
def test_mistakes(options, message):
    with pytest.raises(ml.QueryMistake, match=message):
        ml.learn(*read(FIRST, SECOND), **options)


def test_shared_constants():
    """Apart, two of three people smoke; if each database has all five, two of ten do."""
    model, data = read("S(A)\nC(B)", "S(D)", text="S(p)\nC(p)\nS(x)\n")
    assert ml.learn(model, data, prior=None).weights == pytest.approx([np.log(2)], abs=1e-6)
    shared = ml.with_shared_constants(data)
    assert ml.learn(model, shared, prior=None).weights == pytest.approx([np.log(2 / 4)], abs=1e-6)


def test_going_on_from_what_was_learnt():
    model, data = read(FIRST, SECOND)
    best = ml.learn(model, data, prior=2.0)
    again = ml.learn(best.model, data, prior=2.0, resume=True)
    assert best.iterations > 1
    assert again.iterations == 0
    assert again.weights == pytest.approx(best.weights, abs=1e-9)


def test_the_path_of_laplace_priors():
    model, data = read(FIRST, SECOND)
    learned = ml.learn(model, data)
    path = ml.laplace_path(learned, points=20)
    assert path.n_nonzero[0] == 0
    assert path.n_nonzero[-1] > 4
    assert (np.diff(path.values) > -1e-9).all()
    for scale, found in zip(path.scales[[5, 12]], path.weights[[5, 12]], strict=True):
        assert found == pytest.approx(ml.learn(model, data, prior=ml.Laplace(scale)).weights, abs=1e-4)


def test_all_from_the_command(tmp_path):
    (tmp_path / "m.mln").write_text(TEXT)
    (tmp_path / "a.db").write_text(FIRST)
    (tmp_path / "b.db").write_text(SECOND)
    out, path = tmp_path / "o.mln", tmp_path / "path.csv"
    words = ["learn", tmp_path / "m.mln", tmp_path / "a.db", tmp_path / "b.db", "--tie", "formula 2; formula 3"]
    words += ["--times", "a.db=2", "--prior-of", "formula 1: gaussian 0.5 1", "--shared-constants", "-o", out]
    words += ["--held-out", tmp_path / "b.db", "--laplace-path", path, "--format", "json", "--report", "information"]
    result = CliRunner().invoke(command, list(map(str, words)))
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert data["held_out"] < 0
    assert data["report"]["effects"]
    header = json.loads(next(x for x in out.read_text().splitlines() if x.startswith("// json: "))[9:])
    assert header["tied"] == [["formula 2", "formula 3"]]
    assert header["database_weights"] == [2.0, 1.0]
    assert header["prior"]["formula 1"] == {"family": "gaussian", "sd": 0.5, "mean": 1.0}
    rows = list(csv.DictReader(path.read_text().splitlines()))
    assert {"scale", "weight", "formula"} == set(rows[0])
    again = CliRunner().invoke(command, ["learn", str(out), str(tmp_path / "a.db"), "--resume", "--format", "json"])
    assert json.loads(again.stdout)["status"] == "converged"


@pytest.mark.parametrize(
    "wrong", [("--times", "c.db=2"), ("--prior-of", "formula 1: laplace 1 2"), ("--prior-of", "1")]
)
def test_wrong_options(tmp_path, wrong):
    (tmp_path / "m.mln").write_text(TEXT)
    (tmp_path / "a.db").write_text(FIRST)
    result = CliRunner().invoke(command, ["learn", str(tmp_path / "m.mln"), str(tmp_path / "a.db"), *wrong])
    assert result.exit_code == 2
    assert "takes" in result.output


ALONE = "S(p)\np = {A, B, C}\nS(x) ^ S(y)\n"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--report", "sandwich"), "two independent clusters"),
        (("--report", "information", "--objective", "max-margin"), "no likelihood"),
        (("--laplace-path", "path.csv", "--objective", "max-margin"), "no likelihood"),
        (("--laplace-path", "nowhere/path.csv"), "no folder"),
        (("--held-out", "other.db"), "T is not declared"),
        (("--held-out", "none.db"), "no file"),
        (("--objective", "max-margin", "--prior", "hierarchical"), "Gaussian prior"),
        (("--prior-of", "formula 9: laplace"), "formula 9"),
        (("--prior-of", "formula 1: laplace 0"), "positive"),
        (("--prior-sd", "inf"), "--prior none"),
        (("--tie", "formula 1; formula 9"), "formula 9"),
        (("--seed", "-1"), "--seed"),
    ],
)
def test_what_cannot_be_had_is_refused_before_learning(tmp_path, monkeypatch, options, message):
    """Nothing is learnt, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(weights, "solved", lambda *_: pytest.fail("it was learnt all the same"))
    Path("m.mln").write_text(ALONE)
    Path("a.db").write_text("S(A)")
    Path("other.db").write_text("T(A)")
    result = CliRunner().invoke(command, ["learn", "m.mln", "a.db", "-o", "out.mln", *options])
    assert result.exit_code == 2, result.output
    assert message in result.output
    assert {path.name for path in tmp_path.iterdir()} == {"m.mln", "a.db", "other.db"}


def test_a_path_that_would_have_to_be_sampled_is_refused_before_learning(tmp_path, monkeypatch):
    def too_wide(*_):
        raise ml.LimitReached("too wide")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(verify, "log_likelihood", too_wide)
    Path("m.mln").write_text(ALONE)
    Path("a.db").write_text("S(A)")
    words = ["learn", "m.mln", "a.db", "-o", "out.mln", "--objective", "likelihood", "--laplace-path", "path.csv"]
    result = CliRunner().invoke(command, words)
    assert result.exit_code == 2
    assert "not sampled" in result.output
    assert not Path("out.mln").exists()


def test_counts_that_take_too_much_memory_name_their_formula(monkeypatch):
    monkeypatch.setattr(counts, "machine_memory", lambda: 1000)
    model = ml.model_from_text("Friends(p, p)\nSmokes(p)\nFriends(x, y)\nFriends(x, y) ^ Smokes(x) => Smokes(y)\n")
    data = ml.evidence_from_text("Friends(Ann, Bob)\nSmokes(Ann)\nSmokes(Cid)\n", model=model)
    with pytest.raises(ml.LimitReached, match="formula 1 touches too many atoms of Friends") as caught:
        ml.learn(model, data)
    assert "--predict" in caught.value.diagnostics[0].hint


def test_too_little_memory_is_said(monkeypatch, tmp_path):
    def learn(*_, **__):
        raise MemoryError

    monkeypatch.setattr(ml, "learn", learn)
    (tmp_path / "m.mln").write_text("Smokes(p)\nSmokes(x)\n")
    (tmp_path / "d.db").write_text("Smokes(Ann)\n")
    result = CliRunner().invoke(command, ["learn", str(tmp_path / "m.mln"), str(tmp_path / "d.db")])
    assert result.exit_code == 1
    assert "not enough memory" in result.output
