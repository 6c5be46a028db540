"""Real files with mistakes in them, and random bytes: a tree or our own errors, soon, in every dialect."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.errors import MlnError
from mlnlite.source import Source
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.layout import formatted
from mlnlite.syntax.parse import parse_model

DATA = Path(__file__).parents[3] / "shared" / "data"
FILES = [
    "mln/smoke/prog.mln",
    "mln/rc1000/prog.mln",
    "mln/voting/voting.mln",
    "pracmln/alarm/mlns/alarm-noisyor.mln",
    "pracmln/taxonomies/mlns/senses_and_roles.mln",
    "handover/formulas.mln",
]
DIALECTS = ["standard", "prac", "alchemy", "tuffy", "rockit", "lomrf", None]
PIECES = [
    *'()!^v=><+*?@#$|[]{}",.:-/%\n',
    "=>",
    ":-",
    "EXIST ",
    "count(",
    "p=0.5:",
    "...",
    "t++",
    "domSize(",
    "x",
    "A",
    "1",
    " ",
]
SECONDS = 5.0


@st.composite
def mutated(draw, texts):
    text = draw(st.sampled_from(texts))
    start = draw(st.integers(0, max(0, len(text) - 400)))
    text = text[start : start + 400]
    for _ in range(draw(st.integers(1, 5))):
        at = draw(st.integers(0, len(text)))
        cut = draw(st.integers(0, 6))
        text = text[:at] + draw(st.sampled_from(PIECES)) + text[at + cut :]
    return text


def survives(text, dialect):
    began = time.perf_counter()
    for read in (
        lambda: ml.model_from_text(text, dialect=dialect),
        lambda: parse_evidence(Source("e.db", text)),
        lambda: formatted(text),
    ):
        try:
            read()
        except MlnError as error:
            str(error)
    assert time.perf_counter() - began < SECONDS


@pytest.mark.skipif(not DATA.exists(), reason="the data sets are not here")
@pytest.mark.parametrize("dialect", DIALECTS)
def test_real_files_with_mistakes(dialect):
    texts = [(DATA / name).read_text(encoding="utf-8") for name in FILES]

    @settings(max_examples=25, deadline=None)
    @given(text=mutated(texts))
    def check(text):
        survives(text, dialect)

    check()


@pytest.mark.parametrize("dialect", DIALECTS)
@settings(max_examples=25, deadline=None)
@given(text=st.lists(st.sampled_from(PIECES), max_size=40).map("".join))
@example(text="[p=0.5:")
def test_pieces(dialect, text):
    survives(text, dialect)


@settings(max_examples=40, deadline=None)
@given(data=st.binary(max_size=200))
def test_bytes(data, tmp_path_factory):
    path = tmp_path_factory.mktemp("bytes") / "m.mln"
    path.write_bytes(data)
    try:
        ml.read_model(path)
    except MlnError as error:
        str(error)


@pytest.mark.parametrize("dialect", DIALECTS[2:6])
@pytest.mark.parametrize(
    "text",
    [
        "1 " + "(" * 3000 + "P(A)" + ")" * 3000,
        "1 P(" + "f(" * 3000 + "x" + ")" * 3000 + ")",
        "1 P(x" + " + 1" * 3000 + ")",
        "1 " + "P(x) => " * 3000 + "P(x)",
    ],
)
def test_deep_nesting(dialect, text):
    with pytest.raises(MlnError):
        parse_model([Source("m.mln", text)], dialect)


@pytest.mark.parametrize(
    "text", ["x" * 50_000, "P(" * 20_000, "a, " * 20_000, "P(x) " * 20_000, "*" * 20_000, ":-" * 9_000]
)
def test_long_lines_take_no_long_time(text):
    survives(text, None)
