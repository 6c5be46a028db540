"""Models, facts and questions that are in the language but make no sense are refused with exactly the text beside them.

`NAME.mln` may have facts, `NAME.db`, and a question, `NAME.query` (by default everything). To see what a new case
says: `python -m tests.model.test_bad_models NAME`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import mlnlite as ml

FOLDER = Path(__file__).parent.parent / "programs" / "bad_models"
NAMES = sorted(path.stem for path in FOLDER.glob("*.mln"))


def message(name: str) -> str:
    """What the user reads who asks the model `name` in the current folder."""
    facts, query = Path(f"{name}.db"), Path(f"{name}.query")
    try:
        model = ml.read_model(f"{name}.mln")
        evidence = ml.read_evidence(facts, model=model) if facts.exists() else ml.no_evidence(model)
        ml.marginal(model, evidence, query.read_text() if query.exists() else None)
    except ml.MlnError as error:
        return str(error)
    return "accepted"


@pytest.mark.parametrize("name", NAMES)
def test_message(name, monkeypatch):
    monkeypatch.chdir(FOLDER)
    assert message(name) + "\n" == Path(f"{name}.expected").read_text(encoding="utf-8")


if __name__ == "__main__":
    import os

    os.chdir(FOLDER)
    print(message(sys.argv[1]))
