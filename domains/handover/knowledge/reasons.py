"""Reasons: two worlds that differ in one answer in, what each formula adds to the odds of the first out.

The log-odds of two worlds that differ in one answer are a sum over the formulas, so the ledger is complete: its
entries add up to the log-odds of the answer over the runner-up.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp

import mlnlite as ml
from mlnlite.domains.handover.knowledge.facts import Fact, fact_text
from mlnlite.domains.handover.knowledge.words import words_table

NOTABLE = 0.1
"""Log-odds below this are not worth a sentence: odds of 1.1 to 1."""


@dataclass(frozen=True, slots=True)
class Reason:
    """What one formula says for an answer.

    Attributes:
        predicate: what was asked.
        winner: the answer.
        runner_up: the second best.
        formula: as the model writes it.
        log_odds: what it adds to the log-odds of the winner over the runner-up; negative speaks against.
        because: what the formula takes into account, in plain words.
    """

    predicate: str
    winner: str
    runner_up: str
    formula: str
    log_odds: float
    because: str


def reasons_for(
    model: ml.Model, facts: Sequence[Fact], predicate: str, names: tuple[str, str], worlds: tuple[str, str]
) -> tuple[Reason, ...]:
    """The ledger of an answer, strongest first.

    Args:
        model: with weights.
        facts: what is known.
        predicate: what was asked.
        names: of the answer and of the runner-up.
        worlds: all facts of the world with the answer, and of that with the runner-up.
    """
    evidence = ml.closed(_database(model, "".join(f"{fact_text(f)}\n" for f in facts)), {f[0] for f in facts})
    first, second = (ml.score(model, evidence, _database(model, world)).formulas for world in worlds)
    gains = [(a.formula, b.cost - a.cost) for a, b in zip(first, second, strict=True)]
    found = [Reason(predicate, *names, formula, gain, plain(formula, facts)) for formula, gain in gains if gain]
    return tuple(sorted(found, key=lambda r: -abs(r.log_odds)))


def _database(model: ml.Model, text: str) -> ml.Evidence:
    return ml.evidence_from_text(text, model=model)


def plain(formula: str, facts: Sequence[Fact]) -> str:
    """What a formula takes into account, in words: `the person's arm mobility (low)`."""
    words = words_table()
    known = {fact[0]: fact[-1] for fact in facts}
    used = [name for name in re.findall(r"\w+(?=\()", formula) if name in words["because"]]
    parts = []
    for name in dict.fromkeys(used):
        slot = re.search(r"\{(\w+)\}", words["because"][name])
        value = words["levels"].get(known.get(name, ""), known.get(name, "")).replace("_", " ")
        phrase = words["because"][name]
        parts.append(
            phrase.replace(f" ({slot[0]})", f" ({value})" if value and name != "hasPart" else "") if slot else phrase
        )
    return " with ".join(parts) or str(words["because"]["nothing"])


def said(reasons: Sequence[Reason], predicate: str, *, most: int = 4) -> list[str]:
    """The strongest reasons of an answer as sentences, then what the others come to together."""
    about = [r for r in reasons if r.predicate == predicate]
    chosen = [r for r in about[:most] if abs(r.log_odds) >= NOTABLE]
    others = about[len(chosen) :]
    if others:
        what = "all else together" if chosen else "all that is known"
        chosen.append(replace(others[0], because=what, log_odds=sum(r.log_odds for r in others)))
    return [f"{r.because} {_strength(r)} ({r.log_odds:+.2f})" for r in chosen]


def _strength(reason: Reason) -> str:
    factor = exp(min(abs(reason.log_odds), 20.0))
    name = reason.runner_up if reason.log_odds > 0 else reason.winner
    other = reason.winner if reason.log_odds > 0 else reason.runner_up
    if abs(reason.log_odds) < NOTABLE:
        return f"makes hardly a difference between {other} and {name}"
    return f"makes {other} {factor:.{int(factor < 10)}f} times as likely, compared with {name}"
