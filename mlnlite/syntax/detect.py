"""Which language a model is written in, and why."""

from __future__ import annotations

import re
from collections.abc import Iterable

from mlnlite.source import Span
from mlnlite.syntax import tree
from mlnlite.syntax.lines import Code

# What only one language has, the surest first: the language, a pattern at the begin of a line or anywhere, what it is.
_SIGNS: tuple[tuple[tree.AnyDialect, re.Pattern[str], str], ...] = tuple(
    (dialect, re.compile(pattern, re.MULTILINE), sign)  # type: ignore[misc]
    for dialect, pattern, sign in (
        ("prac", r"(?<![\w)])\?\w[\w']*(?=\s*[,)=:]|\s*[-+*/<>])", "a variable with a question mark"),
        ("rockit", r"^[ \t]*\|[\w ,]+\|", "a count (`|x| ...`)"),
        ("rockit", r"^[ \t]*\*?[^\W\d]\w*\([^()\n]*\bfloat_", "a type `float_`"),
        ("tuffy", r"^[^\n]*:=", "scoping (`:=`)"),
        ("tuffy", r"^[ \t]*FD[ \t]*:", "a functional dependency"),
        ("tuffy", r"\[[^\]\n]*(?:<>|=|<|>)[^\]\n]*\]", "a condition in brackets"),
        ("tuffy", r"^[^\n]*:-[^\n]*\)[ \t]*,", "a rule with commas (`h :- a, b`)"),
        (
            "tuffy",
            r"^[ \t]*(?:@?-?[\d.]+[ \t]+)?!?[^\W\d]\w*\([^()\n]*\)[ \t]*,[^\n]*=>",
            "a body with commas (`a, b => h`)",
        ),
        ("lomrf", r":-", "a rule (`h :- b`)"),
        ("lomrf", r"\w\+\+", "a successor (`t++`)"),
        (
            "alchemy",
            r"^[ \t]*(?!(?i:exists?|forall|inf|not|if)\b)[^\W\d][\w-]*[ \t]+(?!v[ \t])[^\W\d][\w-]*\([^()\n]*\)[ \t]*$",
            "a function declaration",
        ),
        ("alchemy", r"\b(?:succ|plus|minus|times|dividedBy|mod)[ \t]*\(", "a built-in function"),
    )
)

_CLOSED = re.compile(r"^[ \t]*\*\w+\(", re.MULTILINE)

NOTES: dict[tree.AnyDialect, tuple[str, ...]] = {
    "standard": (),
    "prac": (),
    "alchemy": (
        "a weight belongs to the formula as a whole; Alchemy divides it among the clauses of its normal form",
        "`^` binds tighter than `v`, and `a => b => c` is `(a => b) => c`, as in Alchemy",
        "a predicate with facts is open here unless it is closed (`*` or --closed-world); Alchemy closes it",
        "a function is a predicate with exactly one value, and its value may be unknown",
    ),
    "tuffy": (
        "atoms that Tuffy would never activate exist here and may be asked",
        "`head :- body` makes head true exactly where some body is; Tuffy runs it once, in the order of the file",
    ),
    "rockit": ("a predicate without `*` is open; which one is asked is said by the query",),
    "lomrf": (
        "`head :- body` is completed: head is true only where some body is",
        "a weight belongs to the formula as a whole, not to the clauses of its normal form",
        "a function is a predicate with exactly one value, and its value may be unknown",
    ),
}
"""What a text means here that its own system takes in another way."""


def detected(codes: Iterable[Code]) -> tuple[tree.AnyDialect, tuple[str, ...]]:
    """The language of a model and the reasons; `standard` if nothing speaks for another."""
    found: dict[tree.AnyDialect, str] = {}
    codes = list(codes)
    for dialect, pattern, sign in _SIGNS:
        for code in codes:
            if "comma" in sign and not _CLOSED.search(code.bare):
                continue  # a slip in our own dialect, rather
            match = pattern.search(code.bare)
            if match and dialect not in found:
                place = Span(code.source, match.start(), match.end()).place
                found[dialect] = f"{sign} at {place}"
    if not found:
        return "standard", ("nothing in it belongs to another dialect: variables start in lower case",)
    dialect, reason = next(iter(found.items()))
    others = tuple(f"against it: {r}, which is {d}" for d, r in found.items() if d != dialect)
    return dialect, (reason, *others)
