# ruff: noqa: RUF001 (signs that look like ours are the point here)
"""What users of other languages write: their operators, with ours, and constructs of theirs that are not supported."""

from __future__ import annotations

import re

# How it begins where the parser stopped, and what to write instead.
_OPERATORS: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), advice)
    for pattern, advice in (
        (r"<-+>|≡|⇔|↔|(?i:iff\b)", "equivalence is written `<=>`"),
        (r"-+>|⇒|→|(?i:implies\b|then\b)", "implication is written `=>`"),
        (r"&&?|∧|/\\|(?i:and\b)", "conjunction is written `^`"),
        (r"\|\|?|∨|\\/|V\b|(?i:or\b)", "disjunction is written `v`"),
        (r"¬|~|(?i:not\b)", "negation is written `!`"),
        (r"∃", "write `EXIST x (...)`"),
        (r"∀", "write `FORALL x (...)`"),
        (r"≠|<>", "write `!=` for terms that differ"),
    )
)
_WORD_BEFORE = re.compile(r"\b(not|if|NOT|IF|Not|If)\s*$")
_DOUBLED = {"==": "equality is written `=`", "**": "a power is written `^`"}


def foreign_operator(text: str, at: int) -> tuple[int, int, str] | None:
    """An operator of another language at offset `at` or just before it: its start, its end, what to write instead."""
    for pattern, advice in _OPERATORS:
        match = pattern.match(text, at)
        if match:
            return match.start(), match.end(), advice
    if text[max(0, at - 1) : at + 1] in _DOUBLED:
        return at - 1, at + 1, _DOUBLED[text[at - 1 : at + 1]]
    word = _WORD_BEFORE.search(text[:at])
    if word is None:
        return None
    advice = "negation is written `!`" if word[1].lower() == "not" else "leave the `if` out: `a => b` says it"
    return word.start(1), word.end(1), advice


# Constructs of other systems, how to call them, and what to do instead. The failure has to lie inside the match.
CONSTRUCTS: tuple[tuple[re.Pattern[str], str, str], ...] = tuple(
    (re.compile(pattern), name, advice)
    for pattern, name, advice in (
        (r"^\s*(?:P|R|SE)\s*\(.*\)\s*=\s*[\d.]+\s*$", "a probability constraint", "give the formula a weight"),
        (r"\bcount\s*\([^|]*\|.*", "`count(...)`", "say how many with `!` or `?` in the declaration, or with EXIST"),
        (r"\bdomSize\s*\(.*", "`domSize(...)`", "write the number itself"),
        (r"\$\w*", "a macro (`$name`)", "write its value where it is used"),
        (r"[\w'-]+(?:\|[\w'-]+)+\s*\(", "a group of predicates (`p|q(...)`)", "write one formula for each of them"),
        (r"\*\s*[^\W\d]\w*\s*\(", "`*P(...)` inside a formula", "write one formula with `P(...)`, one with `!P(...)`"),
        (r":-", "a rule (`head :- body`)", "write `body => head`"),
        (r"\.\.\.", "a range of constants (`...`)", "list every constant"),
        (
            r"<=(?!>)|<(?![=>-])|(?<![=<-])>=?",
            "a comparison by size here",
            "compare variables and numbers: `x + 1 < y`",
        ),
        (
            r"[\w'?]+\s*[-+*/%]\s*[\w'?]+(?=\s*[,)=])",
            "arithmetic here",
            "put blanks around the sign, and a variable first: `x + 1 = y`",
        ),
        (r"(?<=[(,])\s*[^\W\d][\w']*\(", "a function inside an argument", "use a predicate with one more argument"),
        (r"[\[{]", "this kind of bracket in a formula", "use ( and )"),
    )
)

OURS = {
    "`count(...)`": "write `count(P(x) | x) <= 2`: a formula, `|`, variables, a comparison, a whole number",
    "`domSize(...)`": "it is part of a weight: `log(domSize(person)) P(x)`",
    "a macro (`$name`)": "it is part of a weight, as in `$w P(x)` or `2 * $w P(x)`",
    "a group of predicates (`p|q(...)`)": "write `P|Q(x)`: names of predicates, then their arguments",
    "`*P(...)` inside a formula": "write `*P(x) ^ Q(x)`: the star stands before a predicate",
    "a range of constants (`...`)": "it stands between two whole numbers of a type: `year = {1, ..., 12}`",
}
"""Those that our dialects have, and how they are written."""
