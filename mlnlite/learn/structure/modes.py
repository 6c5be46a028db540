"""Mode declarations, as of Progol and Aleph: which atoms a rule may have, and where their arguments come from."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from mlnlite.errors import QueryMistake, did_you_mean
from mlnlite.model.symbols import Predicate

_MODE = re.compile(r"\s*([^\W\d]\w*)\s*(?:\(([^()]*)\)\s*)?")


@dataclass(frozen=True, slots=True)
class Mode:
    """What atoms of a predicate may look like in a rule.

    Attributes:
        predicate: its name.
        signs: one for each argument. `+`: a variable that stands in the head or further left; `-`: such a variable, or
            a new one; `#`: a constant. In a head, `+` and `-` are the same.
        most_new: how many variables an atom of a body brings in at most.
    """

    predicate: str
    signs: tuple[str, ...]
    most_new: int = 1


def modes_of(texts: Iterable[str], predicates: Mapping[str, Predicate]) -> list[Mode]:
    """Modes such as `Friends(+, -)`; a name alone has variables everywhere, one new one at most.

    Raises:
        QueryMistake: a text is no mode, or does not fit the predicates.
    """
    return [_mode(text, predicates) for text in texts]


def _mode(text: str, predicates: Mapping[str, Predicate]) -> Mode:
    match = _MODE.fullmatch(text)
    if match is None:
        raise QueryMistake(f"`{text}` is no mode", "write the name of a predicate, or `Friends(+, -)`")
    predicate = predicates.get(match[1])
    if predicate is None:
        hint = did_you_mean(match[1], list(predicates)) or "the model does not declare it"
        raise QueryMistake(f"there is no predicate {match[1]} for rules to be about", hint)
    if match[2] is None:
        return Mode(match[1], ("-",) * predicate.arity)
    signs = tuple(sign.strip() for sign in match[2].split(","))
    for sign in signs:
        if sign not in ("+", "-", "#"):
            hint = "an argument is `+`: known before, `-`: known or new, or `#`: a constant"
            raise QueryMistake(f"the mode `{text.strip()}` has the argument `{sign}`", hint)
    if len(signs) != predicate.arity:
        message = f"the mode `{text.strip()}` has {len(signs)} arguments"
        raise QueryMistake(message, f"it is declared as {predicate}")
    return Mode(match[1], signs, signs.count("-"))
