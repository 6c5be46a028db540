"""The commands that learn and measure: what they print and refuse."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from mlnlite.cli import mlnlite as command

MODEL = "S(p)\nC(p)\nK(p, kind!)\nkind = {One, Two}\nS(x) => C(x)\nC(x)\n"


@pytest.fixture
def files(tmp_path):
    (tmp_path / "m.mln").write_text(MODEL)
    facts = [
        "\n".join([f"S(P{i})"] * (i % 3 > 0) + [f"C(P{i})"] * (i % 4 > 0) + [f"K(P{i}, {'One' if i % 2 else 'Two'})"])
        for i in range(24)
    ]
    (tmp_path / "d.db").write_text("\n---\n".join(facts))
    return tmp_path


def run(*words, code=0):
    result = CliRunner().invoke(command, [str(w) for w in words])
    assert result.exit_code == code, result.output
    return result


def test_report(files):
    result = run(
        "learn", files / "m.mln", files / "d.db", "--predict", "C", "--report", "sandwich", "-o", files / "o.mln"
    )
    assert "95 % interval" in result.stdout
    assert "standard errors: sandwich, 24 independent clusters" in result.stdout
    header = next(line for line in (files / "o.mln").read_text().splitlines() if line.startswith("// json: "))
    data = json.loads(header.removeprefix("// json: "))
    assert data["prior"] == {"family": "gaussian", "sd": 5.0, "mean": 0.0}
    assert list(data["databases"]) == ["d.db"]
    assert data["status"] == "converged"


def test_report_as_json(files):
    words = ("learn", files / "m.mln", files / "d.db", "--predict", "C", "--report", "information", "--format", "json")
    data = json.loads(run(*words).stdout)
    assert len(data["report"]["weights"]) == 2
    assert data["report"]["weights"][0]["low"] < data["report"]["weights"][0]["weight"]


@pytest.mark.parametrize("prior", ["laplace", "cauchy", "hierarchical"])
def test_priors(files, prior):
    result = run("learn", files / "m.mln", files / "d.db", "--prior", prior, "-o", files / "o.mln")
    assert prior in result.stdout.lower()


def test_objectives(files):
    result = run(
        "learn", files / "m.mln", files / "d.db", "--objective", "likelihood", "--predict", "C", "-o", files / "o"
    )
    assert result.stdout.startswith("conditional log-likelihood")
    opened = run("learn", files / "m.mln", files / "d.db", "--open", "C", "-o", files / "o")
    assert opened.stdout.startswith("log-likelihood")
    words = ("learn", files / "m.mln", files / "d.db", "--open", "C", "--objective", "pseudo-likelihood")
    assert "--objective likelihood" in run(*words, code=2).output
    wide = run(
        "learn", files / "m.mln", files / "d.db", "--objective", "max-margin", "--predict", "C", "-o", files / "o"
    )
    assert "converged" in wide.stdout


def test_structure(files):
    words = ("learn", files / "m.mln", files / "d.db", "--predict", "C", "--structure", "-o", files / "o.mln")
    assert "candidates" in run(*words).stderr
    refused = run("learn", files / "m.mln", files / "d.db", "--structure", code=2)
    assert "--predict" in refused.output
    assert "of 1 candidates" in run(*words, "--given", "S(+)").stderr
    assert "argument `x`" in run(*words, "--given", "S(x)", code=2).output
    assert "--structure" in run("learn", files / "m.mln", files / "d.db", "--given", "S", code=2).output


def test_crossvalidate(files):
    words = ("crossvalidate", files / "m.mln", files / "d.db", "-q", "K", "--folds", "3")
    result = run(*words)
    assert "pairwise logistic" in result.stdout
    assert "24 databases" in result.stdout
    data = json.loads(run(*words, "--format", "json", "--hold-out", "S,C").stdout)
    assert data["split"]["by"] == "key"
    assert {row["method"] for row in data["scores"]} >= {"this model", "majority"}


def test_crossvalidate_refuses(files):
    assert "no predicate Q" in run("crossvalidate", files / "m.mln", files / "d.db", "-q", "Q", code=2).output
    words = ("crossvalidate", files / "m.mln", files / "d.db", "-q", "K", "--hold-out", "Nothing")
    assert "Nothing" in run(*words, code=2).output


def test_calibration(files):
    run("learn", files / "m.mln", files / "d.db", "-o", files / "o.mln")
    assert "was so" in run("evaluate", files / "o.mln", "-e", files / "d.db", "-q", "C", "--calibration").stdout


def test_tables_and_what_is_strange_in_them(tmp_path):
    """An empty cell of a truth column is an unknown label; rows without a constant are told of."""
    (tmp_path / "m.mln").write_text("S(p)\nS(x)\n")
    (tmp_path / "s.csv").write_text("p,truth\nA,true\nB,true\nD,false\nE,\n,true\n")
    (tmp_path / "s.toml").write_text('[S]\nfile = "s.csv"\n')
    hashes = []
    for data in (f"S={tmp_path / 's.csv'}", tmp_path / "s.toml"):
        result = run("learn", tmp_path / "m.mln", data, "--prior", "none", "-o", tmp_path / "o.mln")
        assert "say nothing" in result.stderr
        assert result.stdout.startswith("log-likelihood")
        header = next(x for x in (tmp_path / "o.mln").read_text().splitlines() if x.startswith("// json: "))
        hashes.append(json.loads(header[9:])["databases"])
        assert "0.693" in (tmp_path / "o.mln").read_text()
    (tmp_path / "s.csv").write_text("p,truth\nA,false\n")
    run("learn", tmp_path / "m.mln", tmp_path / "s.toml", "-o", tmp_path / "o.mln")
    header = next(x for x in (tmp_path / "o.mln").read_text().splitlines() if x.startswith("// json: "))
    assert json.loads(header[9:])["databases"] != hashes[1]
