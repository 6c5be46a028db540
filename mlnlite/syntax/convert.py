"""From one dialect to another: what is rewritten, and what cannot be kept."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from mlnlite.syntax import tree


def rewritten(program: tree.Program) -> tree.Program:
    """The program as one file: included files written out. The dialect only says how it is to be written."""
    return replace(program, statements=tuple(_flat(program.statements)))


def _flat(statements: Sequence[tree.Statement]) -> Iterator[tree.Statement]:
    for statement in statements:
        if isinstance(statement, tree.Include):
            yield from _flat(statement.program.statements)
        else:
            yield statement


_WRITTEN_OUT = (
    ("$", "macros are written as their values"),
    ("#include", "included files are written out"),
    ("#group", "`#group` lines are dropped; they had no meaning"),
    ("p=", "probabilities (`p=0.8:`) are written as `logit(0.8)`"),
    ("...", "ranges are written out"),
)


def losses(program: tree.Program, texts: Sequence[str]) -> Iterator[str]:
    """What is not kept as it was written, and what means something else than in the system of the dialect."""
    origin = program.origin
    if origin:
        why = f" ({'; '.join(origin.reasons)})" if origin.reasons else ""
        yield f"read as {origin.dialect}{why}"
        for note in origin.notes:
            yield f"  differs: {note}"
    if any("//" in text or "/*" in text for text in texts):
        yield "  not kept: comments"
    for sign, note in _WRITTEN_OUT:
        if any(sign in text for text in texts):
            yield f"  rewritten: {note}"
    if any(isinstance(s, tree.FormulaTable) for s in _flat(program.statements)):
        yield "  rewritten: formulas that differ only in constants stand together"
