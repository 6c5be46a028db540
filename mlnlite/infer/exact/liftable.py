"""Answers without grounding, where that is possible: comes in a model and evidence, goes out a result, or none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from mlnlite.errors import Contradiction, LimitReached, QueryMistake
from mlnlite.infer.conflict import contradiction_of
from mlnlite.infer.exact.cells import LIFTED, WORTH_LIFTING, Fragment, fragment_of, n_lifted_atoms
from mlnlite.infer.query import Question, question_of
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.model.templates import Template
from mlnlite.results import Marginals, Statistics


def lifted_marginals(
    model: Model, evidence: Evidence, query: str | Sequence[str], *, others_closed: bool, must: bool
) -> Marginals | None:
    """Answers without grounding, where a model is in the two-variable fragment.

    Args:
        model: as in `marginal`.
        evidence: as in `marginal`.
        query: as in `marginal`.
        others_closed: whether the world is closed but for what is asked.
        must: say why it is not possible, not None; and do it even if grounding would be cheap.

    Raises:
        QueryMistake: it is not possible.
        LimitReached: it would take too long.
        Contradiction: no world is possible; names hard formulas that exclude each other.
    """
    start = perf_counter()
    fragment = "worlds are closed but for what is asked" if others_closed else fragment_of(model, evidence)
    if isinstance(fragment, str):
        if must:
            raise QueryMistake(f"no lifted inference for this model: {fragment}")
        return None
    question = question_of(query, model, evidence, lasting=False) if must or _is_large(fragment, evidence) else None
    if question is None or not _fits(question, fragment):
        if must:
            raise QueryMistake("lifted inference answers atoms of predicates that formulas mention, nothing else")
        return None
    from mlnlite.infer.exact.lifted import classes_of, lifted_probabilities

    try:
        probability, log_z = lifted_probabilities(classes_of(fragment, evidence), evidence, question.atoms)
    except LimitReached:
        if must:
            raise
        return None
    except Contradiction as error:
        raise contradiction_of(_conflict(model, evidence)) from error
    n = len(probability)
    return Marginals(
        names=tuple(evidence.atom_texts(question.atoms)),
        probabilities=probability,
        methods=(LIFTED,) * n,
        exact=np.ones(n, np.bool_),
        error=np.zeros(n),
        log_z=log_z,
        statistics=Statistics(n_lifted_atoms(fragment, evidence), seconds={"infer": perf_counter() - start}),
    )


def _is_large(fragment: Fragment, evidence: Evidence) -> bool:
    """Whether grounding would take longer."""
    return n_lifted_atoms(fragment, evidence) >= WORTH_LIFTING


def _fits(question: Question, fragment: Fragment) -> bool:
    """Whether it asks for atoms of predicates in formulas, and nothing else."""
    return not question.formulas and question.predicates <= {*fragment.unary, *fragment.binary}


def _conflict(model: Model, evidence: Evidence) -> list[Template]:
    """Hard formulas that exclude each other: none of them can be left out."""
    keep = [t for t in model.templates if np.isposinf(t.weights).any()]
    for template in list(keep):
        rest = [t for t in keep if t is not template]
        if not _is_possible(replace(model, templates=tuple(rest)), evidence):
            keep = rest
    return keep


def _is_possible(model: Model, evidence: Evidence) -> bool:
    """Whether some world satisfies a model of hard formulas."""
    from mlnlite.infer.exact.lifted import IMPOSSIBLE, classes_of, log_sum

    fragment = fragment_of(model, evidence)
    return isinstance(fragment, str) or bool(log_sum(classes_of(fragment, evidence)) > IMPOSSIBLE)
