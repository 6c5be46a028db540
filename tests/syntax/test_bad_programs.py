"""Each file in tests/programs/bad is refused with exactly the text beside it, `NAME.expected`.

Files of the syntax and files of the check stand side by side: what a file is wrong in shows in its codes.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from mlnlite.errors import MlnError
from mlnlite.model.check import check
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.files import read_source
from mlnlite.syntax.parse import parse_model

FOLDER = Path(__file__).parent.parent / "programs" / "bad"
PROGRAMS = sorted(path.name for path in FOLDER.iterdir() if path.suffix in (".mln", ".db"))


def message(name: str) -> str:
    """What the user reads who runs the file `name` in the current folder."""
    try:
        source = read_source(name)
        if name.endswith(".db"):
            parse_evidence(source)
        else:
            check(parse_model([source]))
    except MlnError as error:
        return str(error)
    return "accepted"


@pytest.mark.parametrize("name", PROGRAMS)
def test_message(name, monkeypatch):
    monkeypatch.chdir(FOLDER)
    expected = (FOLDER / name).with_suffix(".expected").read_text(encoding="utf-8")
    assert message(name) + "\n" == expected


def test_every_program_has_its_text():
    assert {Path(name).stem for name in PROGRAMS} == {path.stem for path in FOLDER.glob("*.expected")}
