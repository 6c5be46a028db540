"""What the page of the domain says is what the commands say."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

pytest.importorskip("pinocchio")

from click.testing import CliRunner

from mlnlite.cli import mlnlite as command

PAGES = Path(__file__).parents[2] / "docs" / "handover"
INDEX = (PAGES / "index.md").read_text(encoding="utf-8")


def test_the_python_example_runs():
    for code in re.findall(r"```py\n(.*?)```", INDEX, re.DOTALL):
        exec(compile(code, "index.md", "exec"), {})


def test_the_first_answer_is_the_one_on_the_page():
    line = re.search(r"^    (mlnlite handover optimise .*)$", INDEX, re.MULTILINE)[1]
    shown = re.search(r"```text\n(.*?)```", INDEX, re.DOTALL)[1]
    result = CliRunner().invoke(command, shlex.split(line)[1:], prog_name="mlnlite")
    assert result.output == shown


@pytest.mark.parametrize("name", ["effort.md", "compare.md", "effort.png", "mug.png", "view.png"])
def test_what_the_page_links_to_is_there(name):
    assert name in INDEX or name in (PAGES / "effort.md").read_text(encoding="utf-8")
    assert (PAGES / name).stat().st_size > 500


def test_the_table_of_effort_keeps_the_order():
    rows = [
        line.split("|")[1:-1]
        for line in (PAGES / "effort.md").read_text(encoding="utf-8").splitlines()
        if "of 64" in line
    ]
    assert len(rows) == 12
    for a, b, ours in zip(rows[::3], rows[1::3], rows[2::3], strict=True):
        reached = [int(row[2].split()[0]) for row in (ours, b, a)]
        assert reached == sorted(reached, reverse=True)
        for column in (4, 8):
            assert float(ours[column]) < float(b[column]) < float(a[column])
