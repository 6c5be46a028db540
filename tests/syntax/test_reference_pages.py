"""The pages of the reference: each code with an example that is refused and one that is mended; each example runs."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
from pathlib import Path

import pytest
from click.testing import CliRunner

import mlnlite as ml
from mlnlite.cli import mlnlite

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "diagnostics.md").read_text(encoding="utf-8")
LANGUAGE = (ROOT / "docs" / "reference" / "language.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"```(mln|db|sh|py)\n(.*?)```", re.DOTALL)
HEAD, *SECTIONS = re.split(r"^## ", PAGE, flags=re.MULTILINE)
DECLARATIONS, FACTS_MODEL = (text for _, text in BLOCK.findall(HEAD))
EXAMPLES = {section[:4]: BLOCK.findall(section) for section in SECTIONS}


def codes(kind, text, folder):
    """The codes of all diagnostics that an example gives."""
    if kind == "sh":
        return re.findall(r"\[([EW]\d{3})\]", output(text, folder))
    try:
        model = ml.model_from_text(DECLARATIONS + text if kind == "mln" else FACTS_MODEL)
        if kind == "db":
            ml.evidence_from_text(text, model=model)
        elif kind == "py":
            exec(text, {"ml": ml, "model": model})
        else:
            (folder / "a.mln").write_text(DECLARATIONS + text)
            return [d["code"] for d in json.loads(output("mlnlite lint a.mln --format json", folder))]
    except ml.MlnError as error:
        return [d.code for d in error.diagnostics]
    return [d.code for d in model.warnings]


def output(commands, folder):
    """What commands print: those of mlnlite run in this process, in a folder with the model of the page."""
    printed = ""
    for line in commands.splitlines():
        if line.startswith("mlnlite "):
            found = CliRunner().invoke(mlnlite, shlex.split(line)[1:])
            assert found.exception is None or isinstance(found.exception, SystemExit), found.exception
            printed += found.output
        else:
            subprocess.run(["sh", "-c", line], check=True, cwd=folder)
    return printed


@pytest.mark.parametrize("code", EXAMPLES)
def test_code(code, tmp_path, monkeypatch):
    (kind, bad), (other, mended) = EXAMPLES[code]
    assert kind == other
    monkeypatch.chdir(tmp_path)
    (tmp_path / "smoking.mln").write_text(FACTS_MODEL)
    found = set(codes(kind, bad, tmp_path))
    assert code in found
    assert {c for c in found if c[0] == "E"} <= {code} or code == "E199"
    assert set(codes(kind, mended, tmp_path)) <= {"W202"} - {code}


def test_every_code_is_documented():
    documented = {section[:4] for section in SECTIONS}
    sources = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "mlnlite").rglob("*.py"))
    assert set(re.findall(r'"([EW]\d{3})"', sources)) == documented


@pytest.mark.parametrize(
    ("dialect", "text"),
    re.findall(r"```mln(?: (\w+))?\n(.*?)```", LANGUAGE, flags=re.DOTALL),
    ids=lambda value: (value or "ours").split("\n")[0][:40],
)
def test_language_example(dialect, text):
    model = ml.model_from_text(text)
    assert model.origin.dialect == (dialect or "standard")
    again = ml.model_from_text(ml.model_text(model), dialect=model.dialect)
    assert len(again.templates) <= len(model.templates)
