"""Answers of people: a CSV file in, a checked `Survey` out; and back.

One line for each participant: `participant`, `level`, `preferred`; `safety_A` ... `appropriateness_ours`, ratings from
1 to 5; `rank_safety` ... `rank_speed`, places from 1 (most important) to 5; `comment`, free text.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import mlnlite as ml
from mlnlite.domains.handover.study.preferences import published
from mlnlite.domains.handover.tables import choose

METHODS = ("A", "B", "ours")
RATED = ("safety", "comfort", "appropriateness")
RANKED = ("safety", "comfort", "appropriateness", "reach", "speed")
"""Five aspects, as many as the paper ranks; the last two names are our reading."""


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """Answers of n people.

    Attributes:
        source: where they come from; a simulation says so.
        levels: mobility level of each.
        preferred: method each prefers, empty if not told.
        ratings: shape (n, methods, rated aspects), 1 to 5.
        ranks: shape (n, ranked aspects), 1 to 5.
        comments: free text.
    """

    source: str
    levels: tuple[str, ...]
    preferred: tuple[str, ...]
    ratings: NDArray[np.int64]
    ranks: NDArray[np.int64]
    comments: tuple[str, ...]

    @property
    def n(self) -> int:
        """How many people."""
        return len(self.levels)


_RATINGS = tuple(f"{aspect}_{method}" for method in METHODS for aspect in RATED)
_RANKS = tuple(f"rank_{aspect}" for aspect in RANKED)
_HEAD = ("participant", "level", "preferred", *_RATINGS, *_RANKS, "comment")


def read_survey(path: str | Path) -> Survey:
    """A survey file.

    Raises:
        MlnError: no such file, a column is missing, or a cell is no answer; with line and column.
    """
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [name for name in _HEAD if name not in (reader.fieldnames or ())]
            if missing:
                raise ml.MlnError(f"{path}:1: columns are missing: {', '.join(missing)}",
                                  hint="`mlnlite handover study` writes an example")  # fmt: skip
            rows = [_checked(row, f"{path}:{reader.line_num}") for row in reader]
    except (OSError, UnicodeDecodeError) as reason:
        raise ml.MlnError(f"cannot read the survey {path}: {reason}", hint="give the path of a CSV file") from None
    if not rows:
        raise ml.MlnError(f"{path}: no participants", hint="one line for each participant below the head")
    levels, preferred, ratings, ranks, comments = zip(*rows, strict=True)
    shape = (len(rows), len(METHODS), len(RATED))
    return Survey(f"file {Path(path).name}", levels, preferred, np.array(ratings).reshape(shape), np.array(ranks),
                  comments)  # fmt: skip


_Row = tuple[str, str, list[int], list[int], str]


def _checked(row: Mapping[str, str], where: str) -> _Row:
    level = choose(row["level"], published().levels, f"level in {where}")
    preferred = row["preferred"] and choose(row["preferred"], METHODS, f"preferred method in {where}")
    ratings = [_number(row, name, where) for name in _RATINGS]
    ranks = [_number(row, name, where) for name in _RANKS]
    if sorted(ranks) != list(range(1, len(RANKED) + 1)):
        raise ml.MlnError(f"{where}: the ranks are {ranks}, expected each place from 1 to 5 once")
    return level, preferred, ratings, ranks, row["comment"]


def _number(row: Mapping[str, str], name: str, where: str) -> int:
    text = (row[name] or "").strip()
    if text not in {"1", "2", "3", "4", "5"}:
        raise ml.MlnError(f"{where}: {name} is {text!r}, expected a number from 1 to 5")
    return int(text)


def write_survey(survey: Survey, path: str | Path) -> None:
    """A survey as a file that `read_survey` reads."""
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_HEAD)
        for i in range(survey.n):
            writer.writerow((i + 1, survey.levels[i], survey.preferred[i], *survey.ratings[i].ravel().tolist(),
                             *survey.ranks[i].tolist(), survey.comments[i]))  # fmt: skip
