"""What was predicted, for others to check: splits and held-out rows in, Parquet files out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from mlnlite.domains.handover.evaluation.protocol import Split
from mlnlite.domains.handover.evaluation.real import HeldOut
from mlnlite.domains.handover.parquet import write_parquet


def write_splits(found: Mapping[str, Sequence[Split]], path: Path) -> None:
    """Of every split what our model answers for each unseen object, task and level; the other objects trained it."""
    write_parquet(_answers(found), path)


def _answers(found: Mapping[str, Sequence[Split]]) -> Iterator[dict[str, Any]]:
    for labels, splits in found.items():
        for number, split in enumerate(splits):
            for (thing, task, level), (region, method) in split.answers.items():
                yield {"labels": labels, "split": number, "object": thing, "task": task, "level": level,
                       "region": region, "method": method}  # fmt: skip


def write_rows(found: Sequence[HeldOut], path: Path) -> None:
    """Of every row of the authors the probabilities by each model that had not seen it, and its fold."""
    write_parquet(_rows(found), path)


def _rows(found: Sequence[HeldOut]) -> Iterator[dict[str, Any]]:
    for one in found:
        for model, probabilities in one.found.items():
            for i, p in enumerate(probabilities.tolist()):
                yield {"predicate": one.question.predicate, "scheme": one.scheme, "model": model, "row": i + 1,
                       "fold": int(one.folds[i]), "group": one.groups[i],
                       "label": one.question.classes[one.truth[i]],
                       **{f"p{k + 1}": round(x, 6) for k, x in enumerate(p)}}  # fmt: skip
