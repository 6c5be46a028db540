"""fmt, lint, convert, diff and test from the command line."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from mlnlite.cli import mlnlite

MODEL = """person = {Ann, Bob}
Smokes(person)
Cancer(person)
1.5   Smokes(x)=>Cancer(x)   // why
@test given Smokes(Ann) query Cancer(Ann) = 0.8176 +- 0.0001
"""


def run(*words):
    result = CliRunner().invoke(mlnlite, [str(word) for word in words], prog_name="mlnlite")
    return result.exit_code, result.output


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "m.mln"
    path.write_text(MODEL)
    return path


def test_fmt(model):
    code, output = run("fmt", "--check", model)
    assert code == 1
    assert "would change" in output
    assert model.read_text() == MODEL
    assert run("fmt", model)[0] == 0
    assert "1.5 Smokes(x) => Cancer(x)  // why\n" in model.read_text()
    assert run("fmt", "--check", model)[0] == 0


def test_fmt_leaves_bad_files(tmp_path):
    path = tmp_path / "bad.mln"
    path.write_text("P(t)\n1 P(x")
    assert run("fmt", path)[0] == 2
    assert path.read_text() == "P(t)\n1 P(x"


def test_test(model):
    code, output = run("test", model)
    assert (code, output.splitlines()[-1]) == (0, "1 of 1 tests hold")
    model.write_text(MODEL.replace("0.8176", "0.5"))
    code, output = run("test", model)
    assert code == 1
    assert "FAILED Cancer(Ann)" in output
    model.write_text(MODEL.split("@test")[0])
    assert run("test", model)[0] == 2


def test_diff(model, tmp_path):
    other = tmp_path / "o.mln"
    other.write_text("Cancer(person)\nperson = {Ann, Bob}\nSmokes(person)\n1.5 Smokes(y) => Cancer(y)\n")
    assert run("diff", model, other) == (0, "the models are the same\n")
    other.write_text(other.read_text().replace("1.5", "2") + "1 Smokes(+x)\nAge(person, years!)\n")
    code, output = run("diff", "--format", "json", model, other)
    found = json.loads(output)
    assert code == 1
    assert found["declarations"] == ["+ Age(person, years!)"]
    assert [(f["left"], f["right"]) for f in found["formulas"]] == [(1.5, 2.0), (None, 1.0)]


def test_convert(tmp_path):
    path = tmp_path / "a.mln"
    path.write_text("person mother(person)\nP(person)\n1 P(mother(x)) => P(x)  // comment\n")
    code, output = run("convert", path)
    assert code == 0
    assert "read as alchemy" in output
    assert f"not kept: comments: {path}:3:25" in output
    assert f"functions are predicates `f(x, y!)`: {path}:1:1" in output
    assert "mother(person, person!)" in output
    code, output = run("convert", "--to", "prac", path, "-o", tmp_path / "p.mln")
    assert run("check", "--dialect", "prac", tmp_path / "p.mln")[0] == 0


def test_convert_lists_places(tmp_path):
    path = tmp_path / "a.mln"
    rows = "".join(f"$w P({c}) ^ Q\n" for c in "ABCDEFGHIJ")
    path.write_text("t = {1, ..., 3}\nP(t)\nQ\n$w = 2\n" + rows + "1 *P(x) v Q\np=0.8: Q => P(2)\n")
    output = run("convert", path)[1]
    assert f"rewritten: macros are written as their values: {path}:4:1, {path}:5:1, " in output
    assert "and 3 more" in output
    assert f"two formulas, with `P(x)` and with `!P(x)`: {path}:15:3\n" in output
    assert f"written as `logit(p)`: {path}:16:1\n" in output
    path.write_text("person = {A}\nP(person)\nQ(person)\n1 P(x) <=> Q(x)\n2 P(x) => Q(x)\n")
    assert f"weights that these systems divide: {path}:4:1\n" in run("convert", "--dialect", "alchemy", path)[1]


LINT = {
    "W205": "Smokes(person)\nsmokes(person)\n1 Smokes(x) v smokes(x)",
    "W206": "F(p, p)\nS(p)\n1 F(x, y) => S(x)",
    "W207": "F(p, p)\nS(p)\n1 F(x, anna) => S(x)",
    "W208": "S(p)\n1 S(x) v !S(x)",
    "W209": "S(p)\nC(p)\n1 S(x) => C(x)\n2 S(y) => C(y)",
    "W210": "S(p)\np = {A}\n1 S(+x)",
    "W211": "S(p)\nC(p)\nD(p)\n1 S(x) ^ C(x) v D(x)",
    "W212": "S(p)\nS(A).\n!S(x).",
    "W213": "F(p, p)\np = {1, ..., 3000}\n1 F(x, y) ^ F(y, z) => F(x, z)",
}


@pytest.mark.parametrize("code", LINT)
def test_lint(tmp_path, code):
    path = tmp_path / "m.mln"
    path.write_text(LINT[code])
    status, output = run("lint", "--format", "json", path)
    assert status == 1
    assert {d["code"] for d in json.loads(output)} == {code}
    assert all(d["hint"] for d in json.loads(output)[-1:])


def test_lint_of_a_repeated_formula(tmp_path):
    path = tmp_path / "m.mln"
    path.write_text("S(p)\nC(p)\n1 S(x) => C(x)\n2 S(x) => C(x)\n1 S(A)\n1 S(B)\n")
    status, output = run("lint", "--format", "json", path)
    (warning,) = json.loads(output)
    assert (status, warning["code"], warning["line"]) == (1, "W209", 4)


def test_lint_of_a_good_model(model):
    assert run("lint", model) == (0, "nothing to warn of\n")


def test_check_says_why(tmp_path):
    path = tmp_path / "m.mln"
    path.write_text("H(t)\nB(t)\nH(x) :- B(x)\n")
    code, output = run("check", "-v", path)
    assert code == 0
    assert "lomrf: a rule (`h :- b`) at" in output


def test_tables_as_evidence(tmp_path):
    (tmp_path / "m.mln").write_text("*F(p, p)\nS(p)\n1 F(x, y) => S(x)\n")
    (tmp_path / "f.csv").write_text("a,b\nAnn,Bob\n")
    code, output = run("query", tmp_path / "m.mln", "-e", f"F={tmp_path}/f.csv", "-q", "S(Ann)", "--format", "csv")
    assert code == 0
    assert "S(Ann),0.731" in output
