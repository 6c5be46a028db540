"""The table "construct x dialect" of the reference, cell by cell: read with the meaning it says, or refused by name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import mlnlite as ml

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "language.md").read_text(encoding="utf-8")
TABLE = PAGE[PAGE.index("| construct |") :].split("\n\n")[0].splitlines()
DIALECTS = ("standard", "prac", "alchemy", "tuffy", "rockit", "lomrf")
CELLS = {
    row.split(" | ")[0].strip("| "): [c.strip(" |") for c in re.split(r"(?<!\\) \| ", row)[1:]] for row in TABLE[2:]
}

DECLARED = """
P(t)
Q(t)
R(t, t)
N(t, num)
*W(t, value)
Rain
Wet
Cold
"""
FOREIGN = ("alchemy", "tuffy", "rockit", "lomrf")
OURS = ("standard", "prac")

# For each row of the table: dialects, what is written in them, and what it means in the standard dialect; or, for what
# is refused, a code and words of the message. `prac` is written with the variables of the standard dialect.
READ = [
    ("variables", ("standard", "prac", "alchemy", "tuffy", "lomrf"), "1 P(x) ^ R(x, Ann)", '1 P(x) ^ R(x, "Ann")'),
    ("variables", ("rockit",), '1 P(X) v R(X, "Ann")', '1 P(v_X) v R(v_X, "Ann")'),
    ("`^` and `v` side by side", ("standard",), "1 Rain ^ Wet v Cold", "1 Rain ^ (Wet v Cold)"),
    ("`^` and `v` side by side", ("prac", *FOREIGN), "1 Rain ^ Wet v Cold", "1 (Rain ^ Wet) v Cold"),
    ("`a => b => c`", ("alchemy",), "1 Rain => Wet => Cold", "1 (Rain => Wet) => Cold"),
    ("`EXIST x ...`", OURS, "1 EXIST x (P(x)) ^ Rain", "1 (EXIST x (P(x))) ^ Rain"),
    ("`EXIST x ...`", FOREIGN, "1 EXIST x P(x) ^ Rain", "1 EXIST x (P(x) ^ Rain)"),
    ("conjunction by comma", ("tuffy", "lomrf"), "1 P(x), Q(x) => Rain", "1 P(x) ^ Q(x) => Rain"),
    (
        "conditions in brackets",
        ("tuffy", "lomrf"),
        "1 P(x), P(y), [x <> y] => Rain",
        "1 P(x) ^ P(y) ^ !(x = y) => Rain",
    ),
    ("`*P(t)` declared", DIALECTS, "*C(t)\n1 C(x)", "*C(t)\n1 C(x)"),
    ("`*P(x)` in a formula", DIALECTS, "1 *P(x) v Rain", "1 P(x) v Rain\n1 !P(x) v Rain"),
    ("one weight for each constant (`+x`)", DIALECTS, "1 R(x, +y)", "1 R(x, +y)"),
    ("hard: a dot at the end", DIALECTS, "P(x) v Q(x).", "P(x) v Q(x)."),
    ("fixed weights", DIALECTS, "@2 P(x)", "@2 P(x)"),
    ("fixed weights", ("alchemy",), "2. P(x)", "@2 P(x)"),
    ("groups of predicates", OURS, "1 P|Q(x)", "1 P(x)\n1 Q(x)"),
    ("functions (`person f(person)`)", ("alchemy", "lomrf"), "t f(t)\n1 P(f(x))", "f(t, t!)\n1 f(x, u1) ^ P(u1)"),
    ("numbers: order, arithmetic", DIALECTS, "1 N(x, a) v N(x, a + 1)", "1 b = a + 1 ^ (N(x, a) v N(x, b))"),
    ("numbers: order, arithmetic", DIALECTS, "1 N(x, a) v a < 3", "1 N(x, a) v a < 3"),
    ("numbers: order, arithmetic", ("alchemy",), "1 N(x, a) v N(x, succ(a))", "1 b = a + 1 ^ (N(x, a) v N(x, b))"),
    ("numbers: order, arithmetic", ("lomrf",), "1 N(x, a) v N(x, a++)", "1 b = a + 1 ^ (N(x, a) v N(x, b))"),
    ("counts", OURS, "count(P(x) | x) <= 2.", "count(P(x) | x) <= 2."),
    ("counts", ("rockit",), "|x| P(x) <= 2", "count(P(x) | x) <= 2."),
    (
        "`head :- body`",
        ("tuffy",),
        "P(x) :- Q(x), R(x, y).",
        "Q(x) ^ R(x, y) => P(x).\nP(x) => EXIST y (Q(x) ^ R(x, y)).",
    ),
    (
        "`head :- body`",
        ("lomrf",),
        "P(x) :- Q(x) ^ R(x, y)",
        "Q(x) ^ R(x, y) => P(x).\nP(x) => EXIST y (Q(x) ^ R(x, y)).",
    ),
    ("`head :- body` where head depends on itself", ("lomrf",), "N(x, a++) :- N(x, a)", None),
    ("weight from an argument", DIALECTS, "c: W(x, c) v P(x)", "c: W(x, c) v P(x)"),
    ("macros, `domSize`, `p=0.8:`, `#unique`", OURS, "$w = 2\n$w Rain", "2 Rain"),
    ("macros, `domSize`, `p=0.8:`, `#unique`", OURS, "p=0.8: Rain => Wet", "logit(0.8) Rain => Wet"),
    ("`@test`, `#fixweight`, `#include`", DIALECTS, "#fixweight\n1 P(x)\n@test query Rain = 0.5 +- 0.1", "@1 P(x)"),
    ("ranges `{1, ..., 9}`", DIALECTS, "num = {1, ..., 3}\n1 N(x, a)", "num = {1, 2, 3}\n1 N(x, a)"),
]
REFUSED = [
    ("`a => b => c`", ("standard", "prac", "tuffy", "rockit", "lomrf"), "1 Rain => Wet => Cold", "E106", "chain"),
    ("conjunction by comma", ("standard", "prac", "alchemy", "rockit"), "1 P(x), Q(x)", "E101", "`,`"),
    ("conditions in brackets", OURS, "1 P(x) ^ [x < 3]", "E110", "bracket"),
    ("conditions in brackets", ("alchemy",), "1 [P(x) ^ Rain]", "E110", "indivisible formula"),
    ("conditions in brackets", ("rockit",), "1 N(x, [a + 1])", "E110", "computed term"),
    ("groups of predicates", FOREIGN, "1 P|Q(x)", "E110", "group of predicates|operation on bits"),
    ("functions (`person f(person)`)", OURS, "1 P(f(x))", "E110", "function"),
    ("functions (`person f(person)`)", ("tuffy", "rockit"), "1 P(f(x))", "E110", "function"),
    ("functions (`person f(person)`)", ("tuffy", "rockit"), "t f(t)", "E110", "function"),
    ("functions of texts", FOREIGN, "1 P(concat(x, y))", "E110", "function of texts"),
    ("functions of texts", OURS, "1 P(concat(x, y))", "E110", "function"),
    ("counts", ("alchemy", "tuffy", "lomrf"), "1 count(P(x) | x) <= 2", "E110", "`count|operation on bits"),
    ("`head :- body`", (*OURS, "alchemy", "rockit"), "P(x) :- Q(x)", "E110", "rule"),
    (
        "`head :- body` where head depends on itself",
        ("tuffy",),
        "R(x, y) :- R(x, z), R(z, y)",
        "E110",
        "recursive rule",
    ),
    ("`head :- body` where head depends on itself", (*OURS, "alchemy", "rockit"), "R(x, y) :- R(y, x)", "E110", "rule"),
    ("macros, `domSize`, `p=0.8:`, `#unique`", FOREIGN, "$w Rain", "E110", "macro"),
    ("macros, `domSize`, `p=0.8:`, `#unique`", FOREIGN, "log(domSize(t)) Rain", "E110", "domSize"),
    ("scoping `:=`, `FD:`, utilities, numeric features, labels", FOREIGN, "R(x, y) := P(x)", "E110", "scoping"),
    ("scoping `:=`, `FD:`, utilities, numeric features, labels", FOREIGN, "FD: a -> b", "E110", "functional dep"),
    ("scoping `:=`, `FD:`, utilities, numeric features, labels", FOREIGN, "1:2 Rain", "E110", "utility"),
    ("scoping `:=`, `FD:`, utilities, numeric features, labels", FOREIGN, "2 (P(x)) * (N(x) = 3.0)", "E110", "numeric"),
    ("scoping `:=`, `FD:`, utilities, numeric features, labels", FOREIGN[1:], "[Big] 1 P(x)", "E110", "label"),
    ("scoping `:=`, `FD:`, utilities, numeric features, labels", ("tuffy",), "$V(x) :- P(x)", "E110", "view"),
    ("scoping `:=`, `FD:`, utilities, numeric features, labels", ("tuffy",), "@V(x) :- P(x)", "E110", "afterwards"),
    ("scoping `:=`, `FD:`, utilities, numeric features, labels", ("tuffy",), "#V(x) :- P(x)", "E110", "passing"),
    (
        "scoping `:=`, `FD:`, utilities, numeric features, labels",
        ("tuffy",),
        "1 N(x, a), a & 3 = 1 => P(x)",
        "E110",
        "bits",
    ),
    (
        "scoping `:=`, `FD:`, utilities, numeric features, labels",
        ("rockit",),
        "2 |x| P(x) <= 1",
        "E110",
        "in front of a count",
    ),
    (
        "scoping `:=`, `FD:`, utilities, numeric features, labels",
        ("rockit",),
        "S(x) := [x == 1]",
        "E110",
        "computed predicate",
    ),
    ("graded truth (`#fuzzy`), probability constraints `P(f) = 0.3`", DIALECTS, "#fuzzy\nF(t)", "E110", "graded"),
    ("graded truth (`#fuzzy`), probability constraints `P(f) = 0.3`", OURS, "P(Rain) = 0.3", "E110", "probability"),
]


def each(rows):
    return [
        pytest.param(dialect, *rest, id=f"{row}-{dialect}-{rest[0].splitlines()[0]}")
        for row, dialects, *rest in rows
        for dialect in dialects
    ]


def written(text, dialect):
    """With the variables of the prac dialect."""
    if dialect != "prac":
        return text
    lines = (
        re.sub(r"(?<=[(,+ ])(?<![?\w])([a-c]|[x-z])(?=[),: ]|$)", r"?\1", line) if "(t" not in line else line
        for line in text.split("\n")
    )
    return re.sub(r"^([a-c]):", r"?\1:", "\n".join(lines), flags=re.MULTILINE)


def meaning(text, dialect):
    model = ml.model_from_text(DECLARED + text, dialect=dialect)
    lifted = [re.sub(r"\b(u1|b)\b", "u", t.text.replace("?", "")) for t in model.templates]
    kept = [(text, t.hard, t.fixed, t.weights.tolist()) for text, t in zip(lifted, model.templates, strict=True)]
    return kept, {p: q for p, q in model.predicates.items() if not q.comparison}, model.types


@pytest.mark.parametrize(("dialect", "text", "standard"), each(READ))
def test_read(dialect, text, standard):
    found = meaning(written(text, dialect), dialect)
    if standard is not None:
        assert found == meaning(standard, "standard")


@pytest.mark.parametrize(("dialect", "text", "code", "words"), each(REFUSED))
def test_refused(dialect, text, code, words):
    with pytest.raises(ml.SyntaxMistake) as caught:
        ml.model_from_text(DECLARED + written(text, dialect), dialect=dialect)
    first = caught.value.diagnostics[0]
    assert first.code == code
    assert re.search(words, first.message)
    assert first.span
    assert first.hint


def test_the_table_says_so():
    rows = {row for row, *_ in (*READ, *REFUSED)}
    assert rows == set(CELLS)
    for row, cells in CELLS.items():
        for dialects, cell in zip((OURS, *((d,) for d in FOREIGN)), cells, strict=True):
            for dialect in dialects:
                read = any(r == row and dialect in ds for r, ds, *_ in READ)
                refused = any(r == row and dialect in ds for r, ds, *_ in REFUSED)
                assert read + refused == (cell != "-"), (row, dialect)
                assert refused == cell.startswith("refused"), (row, dialect, cell)
