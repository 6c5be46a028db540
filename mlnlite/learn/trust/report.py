"""Learnt weights to a report: how sure each is, what it means as a probability, and what not to trust."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mlnlite.learn.learned import LearnedModel
from mlnlite.learn.trust.advice import Advice, advice, formula_of
from mlnlite.learn.trust.effects import Effect, effects
from mlnlite.learn.trust.uncertainty import Method, Uncertainty, uncertainty
from mlnlite.model.evidence import Evidence

MOST_LINES = 200
MOST_PAIRS = 10
STRONG = 0.7
"""Correlations from which on they are listed."""


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
        effects: tests of each formula, where components can be listed and the weights are few.
        correlated: pairs of formulas whose weights the data tell apart badly, with their correlation.
    """

    lines: tuple[Line, ...]
    uncertainty: Uncertainty
    advice: tuple[Advice, ...]
    effects: tuple[Effect, ...]
    correlated: tuple[tuple[float, str, str], ...]

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
        found += [f"correlation {r:+.2f} of {first} and {second}" for r, first, second in self.correlated]
        if self.effects:
            found += ["", f"{'ratio':>9}  {'score':>9}  {'p':>8}  without the formula"]
            found += [f"{e.ratio:9.3f}  {e.score:9.3f}  {e.p_value:8.2g}  {e.formula}" for e in self.effects]
            found.append("")
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
            "correlations": [{"correlation": r, "formulas": [a, b]} for r, a, b in self.correlated],
            "effects": [{name: getattr(e, name) for name in Effect.__slots__} for e in self.effects],
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
    return Report(tuple(lines), found, advice(learned), _effects(learned), tuple(_correlated(learned, found)))


def _effects(learned: LearnedModel) -> tuple[Effect, ...]:
    """The tests of formulas, if there are few and their likelihood is in a list."""
    problem = learned.problem
    listed = not problem.wide and learned.how.objective != "max-margin"
    return effects(learned) if listed and len(problem.free) <= MOST_LINES else ()


def _correlated(learned: LearnedModel, found: Uncertainty) -> Iterator[tuple[float, str, str]]:
    """The pairs with the largest correlations."""
    free = learned.problem.free
    if not 1 < len(free) <= MOST_LINES:
        return
    covariance, sd = np.asarray(found.covariance[free][:, free].todense()), found.sd[free]
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.triu(np.nan_to_num(np.abs(covariance / np.outer(sd, sd))), 1)
    order = np.argsort(-size, axis=None)[:MOST_PAIRS]
    for i, j in zip(*np.unravel_index(order, size.shape), strict=True):
        if size[i, j] >= STRONG:
            r = float(covariance[i, j] / (sd[i] * sd[j]))
            yield r, formula_of(learned, int(free[i])), formula_of(learned, int(free[j]))


def _line(learned: LearnedModel, found: Uncertainty, weight: int) -> Line:
    value = float(learned.weights[weight])
    ends = [float(a[weight]) for a in (found.sd, found.low, found.high)]
    sd, low, high = (None if np.isnan(e) else e for e in ends)
    return Line(formula_of(learned, weight), value, sd, low, high, float(1.0 / (1.0 + np.exp(-value))))
