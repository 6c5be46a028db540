"""What `convert` writes means the same as the text that it read: by enumeration of all worlds."""

from __future__ import annotations

from dataclasses import replace

import pytest

import mlnlite as ml
from mlnlite.source import Source
from mlnlite.syntax.convert import rewritten
from mlnlite.syntax.parse import parse_model
from mlnlite.syntax.write import write_model
from tests.model.test_constructs import agrees
from tests.syntax.test_dialects import EXAMPLES

FACTS = {
    "standard": "",
    "prac": "t = {A, b}",
    "alchemy": "!P(Ann)",
    "tuffy": "wrote(Anna, P1)\nwrote(Anna, P2)\nyear(P1, 1999)\nyear(P2, 2001)\nlabel = {B}",
    "rockit": "conf(Ann, 0.5)\nconf(Bob, -1.5)",
    "lomrf": "event = {E}\ntime = {1, 2}\nfluent = {F}\nHappensAt(E, 1)",
}
MORE = [
    (
        "standard",
        "P(t)\nQ(t)\nt = {A, B}\n1 P(x) ^ Q(x) v P(A)\n1 (P(x) => Q(x)) => Q(A)\n-2 !(P(x) <=> Q(x)).".replace(
            "-2 ", ""
        ),
    ),
    (
        "prac",
        'P(t)\nQ(t)\nt = {k, "b c"}\n1 P(?x)^Q(?x) v P(k)\n0.5 P("b c") => Q(?y)\n#unique{+?a,+?b}\n1 P(+?a) ^ Q(+?b)',
    ),
    ("alchemy", "P(t)\nQ(t)\nt = {A, B}\n1 P(x) ^ Q(x) v P(A)\n1 EXIST x P(x) ^ Q(y)\n2. P(x) => Q(x) => P(A)"),
    ("lomrf", "P(t)\nQ(t)\nN(t)\nt = {1, 2, 3}\nP(x) :- Q(x), N(x++)\nN(x++) :- Q(x)\n0.5 Q(x)"),
    (
        "tuffy",
        "P(t)\nQ(t)\nR(t)\nP(x) :- Q(x), R(y).\nP(x) :- R(x), [x <> A].\n0.5 Q(A), Q(B) => R(C)\n1 EXIST x Q(x) v R(A)",
    ),
    ("rockit", 'P(t)\nQ(t)\n|X| P(X) v Q(X) >= 1\n0.7 !P(X) v Q("Anna") v P("Bob")'),
]


@pytest.mark.parametrize("to", ["standard", "prac"])
@pytest.mark.parametrize(
    ("dialect", "text", "facts"),
    [(d, text, FACTS[d]) for d, text in EXAMPLES.items()] + [(d, text, "") for d, text in MORE],
    ids=lambda value: value.split("\n")[0][:12],
)
def test_same_meaning(dialect, text, facts, to):
    program = parse_model([Source("m.mln", text)], dialect)
    written = write_model(replace(rewritten(program), dialect=to))
    before = agrees(ml.model_from_text(text, dialect=dialect), facts)
    after = agrees(ml.model_from_text(written, dialect=to), facts)
    assert before
    assert after == pytest.approx(before, abs=1e-9)
