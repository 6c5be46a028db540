"""Facts read by whole arrays and facts read line by line: the same tables, the same mistakes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source
from mlnlite.syntax import bulk, evidence
from mlnlite.syntax.coded import numbered, numbered_words
from mlnlite.syntax.evidence import parse_evidence

LINES = (
    "Friends(Anna, Bob)",
    "Friends(Bob,Anna)",
    "!Friends(Bob, Cid)",
    "  Friends( Bob , Cid )  ",
    "0.7 Smokes(Anna)",
    "0.70  Smokes(Cid)",
    "0.0 Smokes(Bob)",
    "1.5 Smokes(Bob)",
    "?Smokes(Dan)",
    "!?Smokes(Dan)",
    "Name(Anna, \"Anna, (the) 'first'\")",
    'Name(Bob, "")',
    'Name(Bob, "a \\"b\\"")',
    'Name(Bob, "Ünal")',
    "Name(Ünal, Ü2)",
    "Anna = motherOf(Bob)",
    '"Anna" = motherOf(Cid)',
    "Rain",
    "!Rain",
    "---",
    "  --- ",
    "----",
    "",
    "   ",
    "person = {Eva, Fritz}",
    "person = {Eva,",
    "  Fritz}",
    "At(x-1, glass.n.06, a:b, -3)",
    "At(a--b, 'c)",
    "At(a., b)",
    "At(a, -)",
    "Long(a_constant_of_more_than_eight, x)",
    "Long(x, " + "y" * 70 + ")",
    "Friends(Anna)",
    "friends-of(Anna)",
    "2x(Anna)",
    "P(A) P(B)",
    "P(A).",
    "P(A",
    "P(A\tB)",
    "P(\tA)\r",
    "=",
    "\x01P(A)",
    "Unknown(" + ", ".join("abcdefgh") + ")",
)


def read(text):
    """What a text means, or its mistakes."""
    try:
        program = parse_evidence(Source("e.db", text))
    except SyntaxMistake as error:
        return sorted(str(d) for d in error.diagnostics)
    return program, [table.offset.tolist() for table in program.facts]


def compare(text, size):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evidence, "BULK", 10**9)
        expected = read(text)
        patch.setattr(evidence, "BULK", 0)
        patch.setattr(bulk, "FEWEST", 1)
        patch.setattr(bulk, "CHUNK", size)
        found = read(text)
    assert found == expected


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.sampled_from(LINES), max_size=12), st.sampled_from(["\n", "\n\n", "\r\n"]), st.sampled_from([40, 10**6])
)
@example(["0.0 Smokes(Bob)", "0.0 Smokes(Bob)", "person = {Eva,", "  Fritz}"], "\n", 40)
@example(["---", "person = {Eva,", "  Fritz}", "Rain"], "\n", 40)
@example(list(LINES), "\n", 10**6)
def test_any_lines(lines, newline, size):
    compare(newline.join(lines), size)


@settings(deadline=None)
@given(st.text(st.sampled_from('PQab1.-"(),=!?0 \n{}#/*:é'), max_size=60), st.sampled_from([10, 10**6]))
def test_any_text(text, size):
    compare(text, size)


def test_many_facts():
    rng = np.random.default_rng(0)
    lines = [f"Friends(P{a}, P{b})" for a, b in rng.integers(0, 3000, (20_000, 2))]
    lines[7] = "person = {\n Eva,\n Fritz}"
    lines[9] = 'Name(P1, "// no, comment")'
    lines[11] = "---"
    lines[13:15] = ["// a comment", "0.25 Smokes(P1)  /* and another"]
    lines[16] = "*/ Smokes(P2)"
    compare("\n".join(lines), 1 << 12)


def test_included_databases_shift_those_after_them(tmp_path):
    (tmp_path / "a.db").write_text("P(A)\n---\nP(B)\n" * 3)
    text = 'P(C)\n#include "a.db"\n---\nP(D)\n'
    (tmp_path / "b.db").write_text(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evidence, "BULK", 0)
        patch.setattr(bulk, "FEWEST", 1)
        program = parse_evidence(Source(str(tmp_path / "b.db"), text))
    assert program.n_databases == 5
    assert program.facts[0].database.tolist() == [0, 4]
    assert program.facts[1].database.tolist() == [0, 1, 1, 2, 2, 3]


@given(st.lists(st.integers(0, 6), min_size=1, max_size=50))
def test_numbers_of_keys(keys):
    codes, rows = numbered(np.array(keys, np.uint64) * np.uint64(2**61))
    order = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    assert codes.tolist() == [order[key] for key in keys]
    assert [keys[row] for row in rows] == list(order)


def test_words_with_one_key_stay_apart():
    def mixed(key):
        return (key ^ (key >> 29)) * 0x9E3779B97F4A7C15

    second, more = (int.from_bytes(word, "little") for word in (b"second_0", b"and_more"))
    for i in range(10**5):
        first = int.from_bytes(f"{i:08}".encode(), "little")
        other = (mixed(first) + more - mixed(second)) % 2**64
        if all(0 < byte < 128 for byte in other.to_bytes(8, "little")):
            break
    codes, texts = numbered_words(np.array([[first, more], [second, other]], np.uint64))
    assert [texts[code][:8] for code in codes] == [f"{i:08}", "second_0"]
