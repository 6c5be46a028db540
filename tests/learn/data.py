"""The real data that tests read, where they are; and what the tests of the authors' data share."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import mlnlite as ml

DATA = Path(__file__).parents[3] / "shared" / "data"


def folder(*names):
    path = DATA.joinpath(*names)
    if not path.exists():
        pytest.skip("needs the shared data")
    return path


def handover_model():
    return ml.read_model(folder("handover") / "formulas.mln")


def instances():
    """The authors' databases, read without this library: lists of atoms as tuples."""
    text = (folder("handover") / "dataset.db").read_text()
    pattern = re.compile(r"(\w+)\(([^)]*)\)")
    return [
        [(name, *(a.strip() for a in arguments.split(","))) for name, arguments in pattern.findall(part)]
        for part in text.split("---")
    ]
