"""Learnt weights to a report: how sure each is, what it means as a probability, and what not to trust."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlnlite.learn.advice import Advice, advice, formula_of
from mlnlite.learn.learned import LearnedModel
from mlnlite.learn.uncertainty import Method, Uncertainty, uncertainty
from mlnlite.model.evidence import Evidence

MOST_LINES = 200


@dataclass(frozen=True, slots=True)
class Line:
    """One weight.

    Attributes:
        formula: with the constants of its row.
        weight: its value.
        sd: standard error, None if there is none.
        low: lower end of the interval.
        high: upper end.
        probability: `1 / (1 + e^-weight)`: of the formula's head given its body when nothing else speaks.
    """

    formula: str
    weight: float
    sd: float | None
    low: float | None
    high: float | None
    probability: float


@dataclass(frozen=True, slots=True)
class Report:
    """What there is to know of learnt weights.

    Attributes:
        lines: of the weights that the data speak of, in the order of the model.
        uncertainty: their standard errors.
        advice: what to be careful of.
    """

    lines: tuple[Line, ...]
    uncertainty: Uncertainty
    advice: tuple[Advice, ...]

    def __str__(self) -> str:
        """A table, then the warnings."""
        found = [
            f"{'weight':>9}  {'error':>7}  {f'{100 * self.uncertainty.level:g} % interval':<19}  {'P':>6}  formula"
        ]
        for line in self.lines[:MOST_LINES]:
            sd = "" if line.sd is None else f"{line.sd:.4f}"
            ends = "" if line.low is None else f"[{line.low:.4f}, {line.high:.4f}]"
            found.append(f"{line.weight:9.4f}  {sd:>7}  {ends:<19}  {line.probability:6.4f}  {line.formula}")
        left = len(self.lines) - MOST_LINES
        if left > 0:
            found.append(f"... and {left:,} more")
        found.append(f"standard errors: {self.uncertainty.method}{self._clusters()}")
        found += [f"warning: {text}" for text in self.uncertainty.warnings]
        return "\n".join([*found, *(f"warning: {one.kind}: {one.text}" for one in self.advice)])

    def _clusters(self) -> str:
        n = self.uncertainty.n_clusters
        return f", {n:,} independent clusters" if n else ""

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        return {
            "method": self.uncertainty.method,
            "level": self.uncertainty.level,
            "n_clusters": self.uncertainty.n_clusters,
            "weights": [{name: getattr(line, name) for name in Line.__slots__} for line in self.lines],
            "warnings": [
                *self.uncertainty.warnings,
                *({"kind": a.kind, "text": a.text, "weights": list(a.weights)} for a in self.advice),
            ],
        }


def report(learned: LearnedModel, databases: Evidence, *, method: Method = "sandwich", seed: int = 0) -> Report:
    """A report on learnt weights.

    Args:
        learned: what `learn` gave.
        databases: what it was learnt from.
        method: of the standard errors.
        seed: of the bootstrap.
    """
    found = uncertainty(learned, databases, method=method, seed=seed)
    lines = [_line(learned, found, w) for w in learned.problem.free.tolist()]
    return Report(tuple(lines), found, advice(learned))


def _line(learned: LearnedModel, found: Uncertainty, weight: int) -> Line:
    value = float(learned.weights[weight])
    ends = [float(a[weight]) for a in (found.sd, found.low, found.high)]
    sd, low, high = (None if np.isnan(e) else e for e in ends)
    return Line(formula_of(learned, weight), value, sd, low, high, float(1.0 / (1.0 + np.exp(-value))))
