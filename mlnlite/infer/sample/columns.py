"""What is said of each answer, however it was found: arrays of shape (n_answers,)."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64


@dataclass(frozen=True, slots=True)
class Columns:
    """Answers about atoms, then formulas; the arrays, each of shape (n,), are filled in step by step.

    Attributes:
        probability: nan where there is no answer yet.
        error: standard error, 0 where exact.
        low: lower end of a 95 % interval.
        high: its upper end.
        r_hat: nan where not sampled, or never seen to change.
        size: effective sample size, nan likewise.
        exact: whether exact to machine precision.
        mixed: whether chains agree and the effective size is large.
    """

    probability: Float
    error: Float
    low: Float
    high: Float
    r_hat: Float
    size: Float
    exact: Bool
    mixed: Bool


def no_answers(n: int) -> Columns:
    """Columns of n answers that nobody has given yet."""
    probability, error, low, high, r_hat, size = np.full((6, n), np.nan)
    return Columns(probability, error, low, high, r_hat, size, np.zeros(n, np.bool_), np.ones(n, np.bool_))


def enter(columns: Columns, rows: Int64, answers: Columns) -> None:
    """Writes answers into some rows."""
    for field in fields(Columns):
        getattr(columns, field.name)[rows] = getattr(answers, field.name)
