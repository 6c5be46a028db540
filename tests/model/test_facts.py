"""The order of facts, by numbers and by columns: the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.model.order import Part, ordered

rows = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 3), st.integers(0, 4), st.booleans()), max_size=30)


@given(rows)
def test_order(facts):
    database, first, second = (np.array([f[i] for f in facts], np.int32) for i in range(3))
    truth, ids = np.array([f[3] for f in facts], np.bool_), np.arange(5, dtype=np.int32)
    columns, expected = (database, first, second, truth), sorted(facts)
    given = [
        Part(d, (4 - x, y), (ids[::-1], ids), t)
        for d, x, y, t in zip(*(np.split(c, [len(c) // 3]) for c in columns), strict=True)
    ]
    repeated = [i > 0 and fact[:3] == expected[i - 1][:3] for i, fact in enumerate(expected)]
    small, again, order = ordered(given, [4, 5])
    assert list(zip(small.database, *small.arguments.T, small.truth, strict=True)) == expected
    assert [facts[i] for i in order()] == expected
    assert again.tolist() == repeated
    large, again, order = ordered(given, [2**31, 2**31])
    assert [f[:3] for f in zip(large.database, *large.arguments.T, strict=True)] == [f[:3] for f in expected]
    assert [facts[i][:3] for i in order()] == [f[:3] for f in expected]
    assert again.tolist() == repeated


def test_places_of_contradictions():
    model = ml.model_from_text("F(p, p)\nA(p, n!)\n1 F(x, y) ^ A(x, +n)")
    text = "F(B, A)\nF(A, B)\n!F(B, A)\nA(B, 2)\nF(A, C)\nA(B, 1)\nF(A, B)"
    with pytest.raises(ml.EvidenceMistake) as caught:
        ml.evidence_from_text(text, model=model)
    found = [(d.code, d.span.line, d.message[-10:]) for d in caught.value.diagnostics]
    assert found == [("E304", 3, "<text>:1:1"), ("E305", 6, "<text>:4:1")]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("Level(A, 3)\nLevel(B, 2)\nLevel(C, 3.0)", 3),
        ("n = {7, 007}\nLevel(A, 1)", None),
        ("Level(A, 3)\n0.5 Level(B, 3.0)", None),
        ("Level(A, 3)\nLevel(3.0, 4)\nLevel(B, three)", 0),
    ],
)
def test_two_names_of_a_number(text, place):
    """Constants are names; that two of a type look like one number is said, with the place if it is in a fact."""
    model = ml.model_from_text("Level(o, n)\nLevel(x, 1)")
    warnings = ml.evidence_from_text(text, model=model).warnings
    assert [w.code for w in warnings] == ["W313"] * (place != 0)
    assert [w.span and w.span.line for w in warnings] == [place] * (place != 0)
