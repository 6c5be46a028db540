"""The pages of the reference: each code with an example that is refused and one that is mended; each example runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import mlnlite as ml

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "diagnostics.md").read_text(encoding="utf-8")
LANGUAGE = (ROOT / "docs" / "reference" / "language.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"```(mln|db)\n(.*?)```", re.DOTALL)
HEAD, *SECTIONS = re.split(r"^## ", PAGE, flags=re.MULTILINE)
DECLARATIONS, FACTS_MODEL = (text for _, text in BLOCK.findall(HEAD))
EXAMPLES = {s[:4]: BLOCK.findall(s) for s in SECTIONS if BLOCK.search(s)}


def codes(kind, text):
    try:
        model = ml.model_from_text(DECLARATIONS + text if kind == "mln" else FACTS_MODEL)
        if kind == "db":
            ml.evidence_from_text(text, model=model)
    except ml.MlnError as error:
        return [d.code for d in error.diagnostics]
    return [d.code for d in model.warnings]


@pytest.mark.parametrize("code", EXAMPLES)
def test_code(code):
    (kind, bad), (_, mended) = EXAMPLES[code]
    assert code in codes(kind, bad)
    assert set(codes(kind, mended)) <= {"W202"}


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
