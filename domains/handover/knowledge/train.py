"""Training: a model without weights and instances in, a learnt model out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mlnlite as ml
from mlnlite.domains.handover.knowledge.facts import Fact, gathered_text, kept
from mlnlite.domains.handover.knowledge.words import asked_predicates


def train(
    model: ml.Model, instances: Sequence[Sequence[Fact]], *, prior: ml.Prior | float | None = None
) -> ml.LearnedModel:
    """Weights by conditional likelihood of what is asked, given all that is known.

    Args:
        model: one of `read_knowledge`, or your own with its predicates.
        instances: facts of each instance, the answer among them; facts the model has no word for are left out.
        prior: see `mlnlite.learn`; by default rows of a template share a learnt mean and spread.

    Raises:
        MlnError: a fact does not fit the model, or there is nothing to learn from.
    """
    rows = [kept(facts, model.predicates) for facts in instances]
    data = ml.evidence_from_text(gathered_text(rows), model=model)
    own = ml.Hierarchical() if prior is None else prior
    return ml.learn(model, data, predict=asked_predicates(model), prior=own)


def write_knowledge(learned: ml.LearnedModel, path: str | Path) -> None:
    """Writes the model with its weights."""
    Path(path).write_text(ml.model_text(learned.model), encoding="utf-8")
