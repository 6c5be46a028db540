"""The commands on small files of their own and on real data."""

import csv
import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from click.testing import CliRunner

import mlnlite as ml
from mlnlite import cli
from mlnlite.cli.learning import DEFAULT_SD
from mlnlite.learn.prior import PRIOR_SD

ROOT = Path(__file__).parents[1]
DATA = ROOT / ".." / "shared" / "data"
EXAMPLES = ROOT / "docs" / "examples"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the real data are not here")

MODEL = """Smokes(person)
Cancer(person)
Age(person, years!)
1.5 Smokes(x) => Cancer(x)
0.5 Age(x, Old) ^ Smokes(x)
"""
FACTS = "Smokes(Ann)\n!Smokes(Bob)\nCancer(Ann)\n!Cancer(Bob)\nAge(Ann, Old)\nAge(Bob, Young)\n"


def run(*arguments):
    return CliRunner().invoke(cli.mlnlite, [str(a) for a in arguments], prog_name="mlnlite")


def answer(*arguments):
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    return result


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "m.mln").write_text(MODEL)
    (tmp_path / "e.db").write_text(FACTS)
    return tmp_path


# --- check


def test_mistakes_of_syntax_and_of_meaning_are_told_together(folder):
    text = "Smokes(person)\nCancer(person, \n2 Smokess(x)\n1 Cancer(x)\n!Smokes(Ann, Bob).\n"
    (folder / "m.mln").write_text(text)
    found = json.loads(run("check", folder / "m.mln", "--format", "json").output)
    assert [(d["code"], d["line"]) for d in found["diagnostics"]] == [("E103", 2), ("E202", 3), ("E203", 5)]


@pytest.mark.parametrize("command", [["check"], ["query", "-q", "Cancer"], ["ground"], ["evaluate"]])
def test_facts_in_the_place_of_a_model_are_refused(folder, command):
    result = run(*command, folder / "m.mln", folder / "e.db")
    assert result.exit_code == 2
    assert "e.db`" in result.output.replace("\n", "")
    assert "write `-e " in result.output


def test_check_counts(folder):
    text = answer("check", folder / "m.mln", "-e", folder / "e.db").stdout
    assert re.search(r"years +2 +Old, Young", text)
    assert re.search(r"Smokes\(person\) +2 facts", text)
    assert re.search(r"weights +2\ndatabases +1", text)


def test_check_without_evidence(folder):
    text = answer("check", folder / "m.mln").stdout
    assert "databases" not in text
    assert "facts" not in text


def test_check_as_json(folder):
    data = json.loads(answer("check", folder / "m.mln", "-e", folder / "e.db", "--format", "json").stdout)
    assert data["n_weights"] == 2
    assert data["n_databases"] == 1
    assert data["types"]["years"] == ["Old", "Young"]


def test_check_warns_of_missing_facts(folder):
    (folder / "many.db").write_text("Smokes(A)\nCancer(A)\n---\nSmokes(A)\nCancer(A)\n---\nSmokes(A)\n")
    text = answer("check", folder / "m.mln", "-e", folder / "many.db").stdout
    assert "Cancer has no fact in 1 of 3 databases" in text
    assert "many.db#3" in text
    assert "Smokes has no fact" not in text


def test_check_shortens_and_verbose_does_not(folder):
    people = "\n".join(f"Smokes(Person{i})" for i in range(50))
    (folder / "big.db").write_text(people)
    short, full = (answer("check", folder / "m.mln", "-e", folder / "big.db", *v).stdout for v in ([], ["-v"]))
    assert "Person49" not in short
    assert "more)" in short
    assert "Person49" in full


@needs_data
def test_check_of_the_handover_data():
    paths = (DATA / "handover" / "formulas.mln", "--evidence", DATA / "handover" / "dataset.db")
    text = answer("check", *paths).stdout
    assert re.search(r"weights +97,500\ndatabases +429", text)
    assert "withAffordance is declared and stands in no formula" in text
    assert "armMobility has no fact in 74 of 429 databases" in text


@needs_data
def test_check_of_a_model_in_several_files():
    folder = DATA / "grasp_affordance"
    text = answer("check", folder / "predicate.txt", folder / "formula.txt", "-e", folder / "data.txt").stdout
    assert re.search(r"databases +703", text)


# --- learn


def test_learn_writes_a_model_that_reads_back(folder):
    out = folder / "out.mln"
    result = answer("learn", folder / "m.mln", folder / "e.db", "-o", out)
    assert "pseudo-log-likelihood" in result.stdout
    assert str(out) in result.stdout
    text = out.read_text()
    assert re.search(r"// prior: Gaussian, mean 0, standard deviation 5\n", text)
    assert re.search(r"// data: e.db sha256:[0-9a-f]{64}\n", text)
    expected = ml.learn(
        ml.read_model(folder / "m.mln"), ml.read_evidence(folder / "e.db", model=ml.read_model(folder / "m.mln"))
    )
    read = ml.read_model(out)
    assert [w for t in read.templates for w in t.weights.tolist()] == expected.weights.tolist()
    assert [p.name for p in folder.iterdir() if p.name.startswith(".mlnlite")] == []


def test_learn_without_output_writes_the_model_to_standard_output(folder):
    result = answer("learn", folder / "m.mln", folder / "e.db")
    assert "Smokes(x) => Cancer(x)" in result.stdout
    assert "pseudo-log-likelihood" in result.stderr
    assert ml.model_from_text(result.stdout).templates


def test_learn_as_json(folder):
    data = json.loads(answer("learn", folder / "m.mln", folder / "e.db", "--format", "json").stdout)
    assert data["status"] == "converged"
    assert ml.model_from_text(data["model"]).templates


def test_learn_default_prior_is_the_one_in_python():
    assert DEFAULT_SD == PRIOR_SD


def test_learn_priors(folder):
    texts = [
        answer("learn", folder / "m.mln", folder / "e.db", *p).stdout
        for p in (["--prior-sd", "0.1"], ["--prior", "none"])
    ]
    small, free = ([w for t in ml.model_from_text(x).templates for w in t.weights] for x in texts)
    assert max(map(abs, small)) < 0.1
    assert max(map(abs, free)) == 30.0
    assert run("learn", folder / "m.mln", folder / "e.db", "--prior", "none", "--prior-sd", "1").exit_code == 2


def test_learn_tells_models_from_databases(folder):
    (folder / "m.txt").write_text(MODEL)
    (folder / "e.mln").write_text(FACTS)
    answer("learn", "-m", folder / "m.txt", "-d", folder / "e.mln")
    answer("learn", "-m", folder / "m.txt", folder / "e.db")
    assert "no file is a model" in run("learn", folder / "m.txt", folder / "e.db").stderr
    assert "no database to learn from" in run("learn", folder / "m.mln").stderr


@needs_data
def test_learn_gives_the_weights_of_pracmln():
    folder = DATA / "pracmln" / "smokers"
    files = (folder / "mlns" / "smoking.mln", folder / "dbs" / "smoking-train.db")
    model = ml.model_from_text(answer("learn", *files, "--prior", "none").stdout)
    assert [float(t.weights[0]) for t in model.templates] == pytest.approx([0.646696, 1.519900], abs=1e-5)


@needs_data
def test_learn_all_weights_of_the_handover_data(tmp_path):
    folder, out = DATA / "handover", tmp_path / "out.mln"
    result = answer("learn", folder / "formulas.mln", folder / "dataset.db", "-o", out)
    assert re.search(r"weights +97,500\n", result.stdout)
    model = ml.read_model(out)
    assert sum(len(t.weights) for t in model.templates) == 97_500


# --- query


def test_query_marginals_in_three_formats(folder):
    base = ("query", folder / "m.mln", "-e", folder / "e.db", "-q", "Smokes")
    (folder / "e.db").write_text("Cancer(Ann)\n!Cancer(Bob)\nAge(Ann, Old)\n")
    text = answer(*base).stdout
    data = json.loads(answer(*base, "--format", "json").stdout)
    rows = list(csv.DictReader(io.StringIO(answer(*base, "--format", "csv").stdout)))
    assert "Smokes(Bob)" in text
    assert data["status"] == "exact"
    found = {row["name"]: float(row["probability"]) for row in rows}
    assert found == {row["name"]: row["probability"] for row in data["marginals"]}
    assert found["Smokes(Bob)"] < 0.5 < found["Smokes(Ann)"]


def test_query_for_the_most_probable_world(folder):
    (folder / "e.db").write_text("Smokes(Ann)\n")
    base = ("query", folder / "m.mln", "-e", folder / "e.db", "--task", "map")
    data = json.loads(answer(*base, "--format", "json").stdout)
    assert data["status"] == "optimal"
    assert "Cancer(Ann)" in data["true_atoms"]
    rows = list(csv.DictReader(io.StringIO(answer(*base, "-q", "Cancer", "--format", "csv").stdout)))
    assert [(row["name"], row["truth"]) for row in rows] == [("Cancer(Ann)", "True")]


def test_query_to_a_file(folder):
    out = folder / "answer.csv"
    result = answer("query", folder / "m.mln", "-e", folder / "e.db", "-q", "Smokes", "--format", "csv", "-o", out)
    assert result.stdout == ""
    assert out.read_text().startswith("name,probability,method,exact,error\n")


def test_query_commas_inside_parentheses_do_not_split(folder):
    text = answer(
        "query", folder / "m.mln", "-e", folder / "e.db", "-q", "Age(Ann, Old),Smokes(Bob)", "-q", "Cancer"
    ).stdout
    assert len(re.findall(r"^(Age|Smokes|Cancer)\(", text, re.MULTILINE)) == 4


def test_query_needs_a_question(folder):
    result = run("query", folder / "m.mln")
    assert result.exit_code == 2
    assert "nothing is asked" in result.stderr


def test_query_closed_and_open_worlds(folder):
    (folder / "e.db").write_text("Smokes(Ann)\n---\nCancer(Bob)\n")
    base = (
        "query",
        folder / "m.mln",
        "-e",
        folder / "e.db",
        "--format",
        "json",
        "-q",
        "Cancer(Bob)",
        "--database",
        "1",
    )
    (folder / "e.db").write_text("Smokes(Ann)\nAge(Bob, Old)\n---\nCancer(Bob)\n")

    def p(*more):
        return json.loads(answer(*base, *more).stdout)["marginals"][0]["probability"]

    assert p("--closed-world", "Smokes") == p("--closed-world", "all") == pytest.approx(0.5)
    assert p() == p("--closed-world", "all", "--open-world", "Smokes") > 0.5
    result = run(*base, "--closed-world", "Smoke")
    assert result.exit_code == 2
    assert "did you mean Smokes?" in result.stderr


def test_query_asks_for_one_of_several_databases(folder):
    (folder / "e.db").write_text("Smokes(Ann)\n---\n!Smokes(Ann)\n")
    base = ("query", folder / "m.mln", "-e", folder / "e.db", "-q", "Smokes")
    assert "2 databases" in run(*base).stderr
    assert "no database 3" in run(*base, "--database", "3").stderr
    assert re.search(r"Smokes\(Ann\) +0\.0000", answer(*base, "--database", "2").stdout)


def test_query_several_files_are_one_world(folder):
    (folder / "more.db").write_text("Smokes(Cid)\n")
    text = answer("query", folder / "m.mln", "-e", folder / "e.db", "-e", folder / "more.db", "-q", "Smokes").stdout
    assert re.search(r"Smokes\(Cid\) +1\.0000", text)
    assert re.search(r"Smokes\(Ann\) +1\.0000", text)


def test_query_options_that_do_not_fit_the_task(folder):
    base = ("query", folder / "m.mln", "-q", "Smokes")
    assert run(*base, "--method", "wcsp").exit_code == 2
    assert run(*base, "--task", "map", "--method", "gibbs").exit_code == 2
    assert run(*base, "--task", "map", "--width-limit", "8").exit_code == 2


def test_query_past_the_limit_has_exit_code_1(folder):
    (folder / "m.mln").write_text("P(t)\nQ(t, t)\n1 P(x) ^ Q(x, y) ^ P(y)\n")
    (folder / "e.db").write_text("\n".join(f"P(A{i})" if i < 1 else f"Q(A{i}, A{i})" for i in range(9)))
    result = run(
        "query",
        folder / "m.mln",
        "-e",
        folder / "e.db",
        "-q",
        "P",
        "--width-limit",
        "4",
        "--method",
        "exact",
        "--format",
        "json",
    )
    assert result.exit_code == 1
    assert json.loads(result.stderr)["error"] == "LimitReached"


@needs_data
def test_query_of_the_tutorial():
    folder = DATA / "pracmln" / "smokers"
    (model,) = (folder / "mlns").glob("wts.pybpll*")
    base = ("query", model, "-e", folder / "dbs" / "smoking-test-smaller.db", "--format", "json")
    query = "Smokes(Ann),Smokes(Bob),Smokes(Ann) ^ Smokes(Bob),Smokes(Ann) v Smokes(Bob)"
    found = [row["probability"] for row in json.loads(answer(*base, "-q", query).stdout)["marginals"]]
    assert found == pytest.approx([0.436830, 0.244758, 0.152667, 0.528921], abs=1e-6)


@needs_data
@pytest.mark.parametrize("worlds", [[], ["--closed-world", "all"], ["--closed-world", "isA,hasAffordance,hasShape"]])
def test_query_of_the_authors_model(tmp_path, worlds):
    evidence = tmp_path / "e.db"
    evidence.write_text(
        "hasShape(x,cylinder)\nisA(x,crockery)\nhasAffordance(x,to_pour)\nhandover(midway)\narmMobility(level_1)\n"
    )
    base = ("query", DATA / "handover" / "learnt.mln", "-e", evidence, "-q", "graspRegion", "--format", "json", *worlds)
    assert json.loads(answer(*base).stdout)["status"] == "exact"
    assert json.loads(answer(*base, "--task", "map").stdout)["status"] == "optimal"


@needs_data
def test_faulty_rules_are_named():
    folder = DATA / "mln" / "rc1000"
    result = run("query", folder / "prog.mln", "-e", folder / "evidence.db", "-q", "category(x, y)", "--task", "map")
    assert result.exit_code == 2
    assert "sameCat(a2,a3) v !category(a1,a3) v !category(a1,a2)." in result.stderr


# --- evaluate


def test_evaluate_compares_with_what_is_hidden(folder):
    data = json.loads(
        answer("evaluate", folder / "m.mln", "-e", folder / "e.db", "-q", "Cancer,Age", "--format", "json").stdout
    )
    cancer, age = data["scores"]
    model = ml.read_model(folder / "m.mln")
    hidden = ml.evidence_from_text("Smokes(Ann)\n!Smokes(Bob)\nperson = {Ann, Bob}\nyears = {Old, Young}", model=model)
    p = ml.marginal(model, hidden, ["Cancer", "Age"])
    assert (cancer["unit"], age["unit"]) == ("atoms", "blocks")
    assert (cancer["n"], age["n"]) == (2, 2)
    assert cancer["brier"] == pytest.approx(((1 - p["Cancer(Ann)"]) ** 2 + p["Cancer(Bob)"] ** 2) / 2)
    assert cancer["majority"] == 0.5
    assert age["accuracy"] in (0.5, 1.0)


def test_evaluate_without_labels(folder):
    (folder / "e.db").write_text("Smokes(Ann)\n")
    result = run("evaluate", folder / "m.mln", "-e", folder / "e.db", "-q", "Cancer")
    assert result.exit_code == 2
    assert "no fact about Cancer" in result.stderr


@needs_data
def test_evaluate_votes(tmp_path):
    folder, out = DATA / "mln" / "voting", tmp_path / "votes.mln"
    answer("learn", folder / "voting.mln", folder / "voting-train.db", "-o", out)
    (score,) = json.loads(
        answer("evaluate", out, "-e", folder / "voting-train.db", "-q", "Democrat", "--format", "json").stdout
    )["scores"]
    assert score["n"] == 190
    assert score["accuracy"] > 0.93
    assert score["majority"] == pytest.approx(101 / 190)
    answer("query", out, "-e", folder / "voting-test.db", "-q", "Democrat")


# --- mistakes, files, interruption


def test_mistakes_name_their_place(folder):
    (folder / "m.mln").write_text("Smokes(person)\n1.0 Smoke(x)\n")
    result = run("check", folder / "m.mln")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "m.mln:2:5: error" in result.stderr
    assert "did you mean Smokes?" in result.stderr


def test_mistakes_as_json(folder):
    (folder / "m.mln").write_text("Smokes(person)\n1.0 Smoke(x)\n")
    found = json.loads(run("check", folder / "m.mln", "--format", "json").stderr)
    assert found["error"] == "ModelMistake"
    assert (found["diagnostics"][0]["line"], found["diagnostics"][0]["column"]) == (2, 5)


@pytest.mark.parametrize("place", ["", "missing/out.mln"])
def test_output_is_checked_before_the_work(folder, place):
    result = run("learn", "no-such.mln", "no-such.db", "-o", folder / place)
    assert result.exit_code == 2
    assert "cannot be written" in result.stderr


def test_output_keeps_permissions_and_links(folder):
    real, link = folder / "real.mln", folder / "link.mln"
    real.write_text("old")
    real.chmod(0o600)
    link.symlink_to(real)
    answer("learn", folder / "m.mln", folder / "e.db", "-o", link)
    assert link.is_symlink()
    assert "learnt by mlnlite" in real.read_text()
    assert real.stat().st_mode & 0o777 == 0o600


def test_output_to_a_device(folder):
    answer("learn", folder / "m.mln", folder / "e.db", "-o", os.devnull)
    assert not Path(os.devnull).is_file()


def test_a_failed_write_leaves_the_old_file(folder, monkeypatch):
    out = folder / "out.mln"
    out.write_text("old")

    def refuse(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", refuse)
    result = run("learn", folder / "m.mln", folder / "e.db", "-o", out)
    assert result.exit_code == 2
    assert "No space left" in result.stderr
    assert out.read_text() == "old"
    assert sorted(p.name for p in folder.iterdir()) == ["e.db", "m.mln", "out.mln"]


def test_interruption_is_one_line(folder, tmp_path):
    begun = tmp_path / "begun"
    wait = f"(open({str(begun)!r}, 'w').close(), time.sleep(60))"
    slow = f"import time, mlnlite.cli.check as c; c._summary = lambda *a: {wait}"
    run_it = "import mlnlite.cli; mlnlite.cli.main()"
    command = [sys.executable, "-c", f"{slow}\n{run_it}", "check", str(folder / "m.mln")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not begun.exists() and process.poll() is None:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=30)
    assert (process.returncode, stdout, stderr) == (130, "", "interrupted\n")


def test_python_m(folder):
    command = [sys.executable, "-m", "mlnlite", "check", str(folder / "m.mln")]
    assert "weights" in subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_a_broken_plugin_is_named(monkeypatch):
    entry = EntryPoint("sailing", "no.such.module:plugin", "mlnlite.plugins")
    monkeypatch.setattr("mlnlite.plugins.installed", lambda: {"sailing": entry})
    assert re.search(r"sailing +broken: the plugin sailing", answer("--help").stdout)
    result = run("sailing", "anything")
    assert result.exit_code == 2
    assert "the plugin sailing (no.such.module:plugin) cannot be imported" in result.stderr
