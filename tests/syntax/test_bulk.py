"""Facts read by compiled code and facts read line by line: the same tables, the same mistakes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mlnlite.errors import SyntaxMistake
from mlnlite.source import Source
from mlnlite.syntax import bulk, evidence, letters, rows
from mlnlite.syntax import bulk_kernel as kernel
from mlnlite.syntax.evidence import parse_evidence
from mlnlite.syntax.files import read_source
from mlnlite.syntax.letters import LargeFile

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
    "Long(x, " + "y" * 71 + ")",
    "Long(x, " + "y" * 257 + ")",
    'Long(y, "' + "y " * 128 + '")',
    "Long(" + "y" * 71 + "," + "y" * 256 + ")",
    "Long" * 80 + "(x)",
    "Wide(" + ", ".join("abc" * 21) + ")",
    "0.5 Wide(" + ", ".join("abc" * 20 + "ab") + ")",
    "Friends(Anna)",
    "friends-of(Anna)",
    "2x(Anna)",
    "P(A) P(B)",
    "P(A).",
    "P(A",
    "P(A\tB)",
    "P(\tA)\r",
    "P(A) // a comment, plain",
    "  // a comment",
    "--- // a comment",
    "P(B) // Ünal",
    "/* P(A)",
    "P(C) */",
    "P(a/b, c) //",
    "P(a//b, c)",
    "- 1 = f(A)",
    "-1 = f(A)",
    "0.7 = f(A)",
    "0.7 x = f(A)",
    "!x = f(A)",
    '"" = f("---")',
    "\t---\t",
    "P(\\u2028)",
    "\x0cP(A)",
    "\xa0P(A)",
    '?P(A, "?(")',
    '#include "x.db"',
    "=",
    "\x01P(A)",
    "Unknown(" + ", ".join("abcdefgh") + ")",
)


def read(source):
    """What a source means, or its mistakes."""
    try:
        program = parse_evidence(source)
    except SyntaxMistake as error:
        return sorted(str(d) for d in error.diagnostics)
    return program, [table.offset.tolist() for table in program.facts]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return str(tmp_path_factory.mktemp("bulk") / "e.db")


def compare(text, path):
    """By a pattern; by compiled code; as a large file, read as bytes until a line needs the grammar; by the grammar."""
    with open(path, "w", newline="") as file:
        file.write(text)
    sources = [Source(path, text)] + ([read_source(path), LargeFile(path)] if text.strip() else [])
    with pytest.MonkeyPatch.context() as patch:
        for module, name, value in (
            (bulk, "FACTS", 5),
            (bulk, "WORDS", 2),
            (letters, "CHUNK", 40),
            (rows, "LARGE", 10**9),
        ):
            patch.setattr(module, name, value)
        patch.setattr(evidence, "BULK", 10**9)
        expected = [read(source) for source in sources]
        patch.setattr(evidence, "BULK", 0)
        assert [read(source) for source in sources] == expected
        patch.setattr(evidence, "BULK", 10**9)
        patch.setattr(evidence, "read_plain", lambda text, start, end, *_: iter([(start, end)]))
        assert [read(source) for source in sources[:1]] == expected[:1]
    assert expected[1:2] == expected[2:]


@settings(max_examples=150, deadline=None)
@given(st.lists(st.sampled_from(LINES), max_size=12), st.sampled_from(["\n", "\n\n", "\r\n"]))
@example(["0.0 Smokes(Bob)", "0.0 Smokes(Bob)", "person = {Eva,", "  Fritz}"], "\n")
@example(["---", "person = {Eva,", "  Fritz}", "Rain"], "\n")
@example(["Rain", "P(A) // é", "P(A) // plain", "// a comment", "--- // and another"], "\n")
@example(list(LINES), "\n")
def test_any_lines(path, lines, newline):
    compare(newline.join(lines), path)


@settings(deadline=None)
@given(st.text(st.sampled_from('PQab1.-"(),=!?0 \n{}#/*:é'), max_size=60))
def test_any_text(path, text):
    compare(text, path)


@settings(deadline=None)
@given(st.lists(st.sampled_from(LINES), min_size=1, max_size=8), st.data())
def test_spoilt_lines(path, lines, data):
    text = "\n".join(lines)
    for _ in range(3):
        at = data.draw(st.integers(0, len(text)))
        text = text[:at] + data.draw(st.text('P1.-"(),=!?0 \n\\{}#/é', max_size=2)) + text[at + 1 :]
    compare(text, path)


def test_many_facts(path):
    rng = np.random.default_rng(0)
    lines = [f"Friends(P{a}, P{b})" for a, b in rng.integers(0, 3000, (20_000, 2))]
    lines[7] = "person = {\n Eva,\n Fritz}"
    lines[9] = 'Name(P1, "// no, comment")'
    lines[11] = "---"
    lines[13:15] = ["// a comment", "0.25 Smokes(P1)  /* and another"]
    lines[16] = "*/ Smokes(P2)"
    compare("\n".join(lines), path)


def test_included_databases_shift_those_after_them(tmp_path):
    (tmp_path / "a.db").write_text("P(A)\n---\nP(B)\n" * 3)
    text = 'P(C)\n#include "a.db"\n---\nP(D)\n'
    (tmp_path / "b.db").write_text(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evidence, "BULK", 0)
        program = parse_evidence(Source(str(tmp_path / "b.db"), text))
    assert program.n_databases == 5
    assert program.facts[0].database.tolist() == [0, 4]
    assert program.facts[1].database.tolist() == [0, 1, 1, 2, 2, 3]


def test_words_with_one_key_stay_apart(path):
    """Words of more than eight bytes have a mixture of all as their key; here are two with the same."""
    words = ("00114963and_more", "second_0Fe_BPo3j")
    text = bulk._text(letters.letters_of("".join(f"P({word})\n" for word in words)))
    found = bulk._room()
    state = np.zeros(kernel.N_STATE, np.int64)
    state[kernel.FIRST_LEFT] = -1
    assert kernel.read_lines(text, found, state) == kernel.END
    assert found.keys[1] == found.keys[3]
    compare("".join(f"P({word})\n" for word in words * 3), path)
