"""Joint tables: come in a few atoms or formulas, goes out the probability of each way in which they can be true."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import TypedDict, Unpack

from mlnlite.engines.plan import Engine
from mlnlite.errors import QueryMistake
from mlnlite.ground.forecast import Limits
from mlnlite.infer.answer import marginal
from mlnlite.infer.approach import MarginalMethod
from mlnlite.infer.query import question_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.results import Marginals

MOST = 8
"""Atoms and formulas of one table, which has 2 to the power of that many rows."""


class Options(TypedDict, total=False):
    """What `marginal` can be told."""

    closed_world: str | Iterable[str]
    method: MarginalMethod
    width_limit: int
    precision: float
    time_limit: float | None
    chains: int
    seed: int
    engine: Engine | None
    limits: Limits


def joint(model: Model, evidence: Evidence, query: str | Sequence[str], **options: Unpack[Options]) -> Marginals:
    """The joint distribution of a few atoms or formulas: exact where `marginal` would be, else with error bars.

    Args:
        model: a model with weights.
        evidence: one database.
        query: atoms (with variables: all groundings) and formulas, at most 8 in all.
        options: as for `marginal`.

    Returns:
        A row for each combination, `A(X) ^ !B(Y)`; all true comes first. The rows add up to 1.

    Raises:
        QueryMistake: it does not fit the model, or there are more than 8.
        Contradiction: if no world satisfies the evidence and the hard formulas.
        LimitReached: if an exact answer was asked for and would need more than the limit.
    """
    question = question_of(query, model, evidence)
    parts = [*evidence.atom_texts(question.atoms), *(f"({f.text})" for f in question.formulas)]
    if not 0 < len(parts) <= MOST:
        hint = "name atoms with constants: `A(X), B(Y)`"
        raise QueryMistake(f"a joint table is about 1 to {MOST} atoms or formulas, not {len(parts):,}", hint)
    rows = [
        " ^ ".join(part if true else f"!{part}" for part, true in zip(parts, signs, strict=True))
        for signs in product((True, False), repeat=len(parts))
    ]
    return marginal(model, evidence, rows, **options)
