from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("pinocchio")

from click.testing import CliRunner

from mlnlite import MissingPart, Plugin
from mlnlite.cli import mlnlite as command
from mlnlite.domains import handover as package


def _run(*words):
    return CliRunner().invoke(command, ["handover", *words], prog_name="mlnlite")


def test_optimise_answers_in_words_and_in_json():
    words = ("optimise", "--object", "mug", "--task", "to_pour", "--level", "L")
    text, data = _run(*words), _run(*words, "--format", "json")
    assert text.exit_code == 0, text.output
    assert "method ours: optimal" in text.output
    assert text.output.count("pass ") == 5
    answer = json.loads(data.output)
    assert answer["status"] == "optimal"
    assert answer["region"] == "handle"
    assert len(answer["joints_rad"]) == 7
    assert all(check["passed"] for check in answer["checks"].values())


@pytest.mark.parametrize("method", ["A", "B"])
def test_other_methods_and_robots(method):
    found = _run("optimise", "--object", "book", "--method", method, "--robot", "panda", "--posture", "seated")
    assert found.exit_code == 0, found.output
    assert f"method {method}" in found.output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--object", "mugg"), "did you mean mug"),
        (("--task", "to_cut"), "unknown task"),
        (("--level", "X"), "unknown mobility level"),
        (("--method", "D"), "unknown method"),
        (("--catalogue", "absent.toml"), "cannot read"),
        (("--hand", "3", "0", "1"), "cannot be at"),
        (("--voxels", "3", "--step", "0.001"), "safety"),
    ],
)
def test_mistakes_are_told_and_end_with_two(words, said):
    found = _run("optimise", *words)
    assert found.exit_code == 2
    assert said in found.output
    assert "hint" in found.output


def test_levels_of_your_own_from_a_file(tmp_path):
    (tmp_path / "levels.toml").write_text('[frail]\ntitle = "frail"\nrange = 0.3\nstrength = 0.2\ntrunk = 0.1\n')
    found = _run("optimise", "--level", "frail", "--levels", str(tmp_path / "levels.toml"))
    assert "mobility frail" in found.output
    (tmp_path / "levels.toml").write_text("frail = 3\n")
    assert "expected a table" in _run("optimise", "--level", "frail", "--levels", str(tmp_path / "levels.toml")).output


def test_a_robot_by_path_with_its_place(tmp_path):
    text = (package.load("tables").DATA / "panda.urdf").read_text()
    (tmp_path / "mine.urdf").write_text(text)
    words = (
        "--robot",
        str(tmp_path / "mine.urdf"),
        "--tool",
        "panda_grasp",
        "--base",
        "1.02",
        "-0.2",
        "0.72",
        "3.1416",
    )
    found = _run("optimise", "--object", "marker", *words)
    assert "by mine, method ours: optimal" in found.output
    far = _run("optimise", "--object", "marker", *words[:4], "--base", "5", "0", "0", "3.1416")
    assert "move the base of the robot" in far.output


def test_mistakes_are_data_for_programs():
    found = _run("optimise", "--object", "mugg", "--format", "json")
    assert json.loads(found.output)["diagnostics"][0]["hint"] == "did you mean mug?"


def test_effort_and_compare_write_their_pages(tmp_path):
    effort = _run("effort", "--objects", "mug,book", "--out", str(tmp_path))
    assert effort.exit_code == 0, effort.output
    page = (tmp_path / "effort.md").read_text()
    assert page.count("\n| ") == 13
    assert (tmp_path / "effort.png").stat().st_size > 5000
    compare = _run("compare", "--objects", "marker", "--robot", "pr2", "--out", str(tmp_path))
    assert compare.exit_code == 0, compare.output
    assert "1 of 1" in (tmp_path / "compare.md").read_text()


def test_a_figure_is_written(tmp_path):
    found = _run(
        "optimise", "--object", "shoe", "--figure", str(tmp_path / "shoe.png"), "--field", str(tmp_path / "3d.png")
    )
    assert found.exit_code == 0, found.output
    assert (tmp_path / "shoe.png").stat().st_size > 10_000
    assert (tmp_path / "3d.png").stat().st_size > 10_000


def test_the_package_is_light_and_names_what_it_offers():
    script = "import sys, mlnlite.domains.handover as h; h.plugin.commands(); print('pinocchio' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
    assert isinstance(package.plugin, Plugin)
    for name in dir(package):
        assert getattr(package, name) is not None
    with pytest.raises(AttributeError):
        package.nothing  # noqa: B018


def test_a_missing_package_says_what_to_install(monkeypatch):
    def absent(name):
        raise ModuleNotFoundError(name="pinocchio")

    monkeypatch.setattr(package, "import_module", absent)
    with pytest.raises(MissingPart, match="pip install"):
        package.load("scene.robots")


def test_public_names_survive_the_import_of_their_modules():
    for home, names in package._HOMES.items():
        package.load(home)
        assert home not in names.split(), "a module would hide the name"


def test_the_domain_uses_the_front_door_only():
    import ast
    from pathlib import Path

    for file in Path(package.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "mlnlite":
                assert node.module == "mlnlite" or node.module.startswith("mlnlite.domains.handover"), (
                    file,
                    node.module,
                )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("execute", "--log", "nowhere/x.jsonl"), "no folder 'nowhere'"),
        (("execute", "--replay", "x.gif"), "known endings: .html, .viser"),
        (("execute", "-n", "-3"), "-3 is not in the range"),
        (("optimise", "--figure", "x.xyz"), "known endings: .png"),
        (("evaluate", "--data", "nowhere"), "cannot read nowhere/handover/dataset.db"),
        (("train", "-o", "nowhere/k.mln"), "no folder 'nowhere'"),
        (("query", "none.mln", "--no-place"), "none.mln"),
        (("query", "none.mln", "--level", "L=x"), "are no shares"),
        (("query", "none.mln", "--solver", "guess"), "'guess' is not one of"),
        (("study", "--data", "none.csv"), "cannot read the survey none.csv"),
    ],
)
def test_mistakes_are_told_before_any_work(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = _run(*words)
    assert found.exit_code == 2
    assert said in found.output


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("study,unicorn,to_pour,H,A,1", "object in rows.csv:2 'unicorn'"),
        ("study,mug,to_fly,H,A,1", "task of mug in rows.csv:2 'to_fly'"),
        ("study,mug,to_pour,Q,A,1", "mobility level in rows.csv:2 'Q'"),
        ("study,mug,to_pour,H,C,1", "method in rows.csv:2 'C'"),
        ("study,mug,to_pour,H,A,9", "region of mug in rows.csv:2 '9'; known: 1, 2, 3"),
        ("", "no instances"),
    ],
)
def test_mistakes_in_instances_have_their_line(row, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rows.csv").write_text(f"source,thing,task,level,method,region\n{row}\n")
    found = _run("train", "--data", "rows.csv")
    assert found.exit_code == 2
    assert said in found.output


def test_every_command_option_and_public_name_is_in_the_reference():
    page = (Path(__file__).parents[2] / "docs" / "reference" / "handover.md").read_text(encoding="utf-8")
    for name, entry in command.get_command(None, "handover").commands.items():
        assert f"## mlnlite handover {name}" in page
        section = page.split(f"## mlnlite handover {name}\n")[1].split("\n## ")[0]
        options = [o for p in entry.params for o in p.opts if o.startswith("-")]
        assert [o for o in options if f"`{o}" not in section and f"{o}`" not in section] == []
    assert [name for name in package._PUBLIC if f"`{name}`" not in page] == []


def test_demo_hands_an_unseen_object_over(tmp_path, monkeypatch):
    from mlnlite.domains.handover.instances import generate

    monkeypatch.setattr(generate, "generate", partial(generate.generate, n_synthetic=150))
    found = _run("demo", "-o", str(tmp_path))
    assert found.exit_code == 0, found.output
    assert "of 31 objects, mug left out" in found.output
    assert "leave free    handle" in found.output
    assert "method ours" in found.output
    assert "simulated: done" in found.output
    names = {path.name for path in tmp_path.iterdir()}
    assert {"handover.html", "handover.png", "reach.png", "preferences.png", "execution.jsonl"} <= names
