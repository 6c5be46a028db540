"""What `learn` gives back: the model with its weights, and how good and how trustworthy they are."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mlnlite.learn.optimise.problem import Problem
from mlnlite.learn.prior import Penalty, Prior, prior_data, prior_text
from mlnlite.model.model import Model

Objective: TypeAlias = Literal["pseudo-likelihood", "likelihood", "composite", "max-margin"]
"""What is maximised: the product over atoms of their probability given all else; the probability of all predicted
atoms together; the product over pairs of atoms that share a formula; or by how much the world in the data beats the
others."""


@dataclass(frozen=True, slots=True)
class How:
    """What was asked of `learn`.

    Attributes:
        objective: what was maximised.
        predict: what is predicted, None for all.
        open_predicates: what is unknown unless a fact.
        tied: groups of formulas with the same weights.
        database_weights: how much each database counts, None for 1.
    """

    objective: Objective = "pseudo-likelihood"
    predict: tuple[str, ...] | None = None
    open_predicates: tuple[str, ...] = ()
    tied: tuple[tuple[str, ...], ...] = ()
    database_weights: tuple[float, ...] | None = None


def targets_of(model: Model, how: How) -> frozenset[str]:
    """The predicates that are predicted; comparisons never are."""
    return frozenset(n for n, p in model.predicates.items() if p.comparison is None and n in (how.predict or [n]))


@dataclass(frozen=True, slots=True)
class LearnedModel:
    """A model with learnt weights.

    Attributes:
        model: the model; its templates have one row for each weight.
        objective: what was maximised.
        value: the objective at the weights, without the prior; nan where it was sampled, which leaves it unknown.
        prior: what was believed of the weights before; None for nothing.
        bound: no weight is larger than this in size.
        unbounded: shape (n_weights,), without a prior the best weight is plus (1) or minus (-1) infinity; else 0.
        unsupported: shape (n_weights,), no atom's probability depends on the weight; it stays 0.
        n_choices: number of atoms and blocks that were predicted from the rest.
        status: why the search stopped: `converged` or what stopped it.
        gradient: largest entry of the gradient of the objective and prior at the weights; of max-margin learning, how
            much better the objective could at most be.
        iterations: steps of the search.
        seconds: time spent by stage.
        history: objective and log prior at the start and after each step.
        how: what was asked.
        problem: what was solved, for what is asked of the weights afterwards.
        penalty: of each weight, with what was learnt of the prior put in.
        measure: what `gradient` is.
        monte_carlo: shape (n_weights,), the standard error that sampling leaves in each weight; 0 where nothing was.
    """

    model: Model
    objective: str
    value: float
    prior: Prior | None
    bound: float
    unbounded: NDArray[np.int8] = field(repr=False)
    unsupported: NDArray[np.bool_] = field(repr=False)
    n_choices: int
    status: str
    gradient: float
    iterations: int
    seconds: Mapping[str, float]
    history: tuple[float, ...] = field(repr=False)
    how: How
    problem: Problem = field(repr=False, compare=False)
    penalty: Penalty = field(repr=False, compare=False)
    measure: str
    monte_carlo: NDArray[np.float64] = field(repr=False)

    @property
    def weights(self) -> NDArray[np.float64]:
        """All weights, template by template, shape (n_weights,)."""
        return np.concatenate([np.empty(0), *(t.weights for t in self.model.templates)])

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        return {
            "objective": self.objective,
            "value": None if np.isnan(self.value) else self.value,
            "prior": prior_data(self.prior),
            "bound": self.bound,
            "n_weights": len(self.unbounded),
            "n_finite": self.n_finite,
            "n_zero": int(self.unsupported.sum()),
            "n_unbounded": int(np.count_nonzero(self.unbounded)),
            "n_choices": self.n_choices,
            "status": self.status,
            "gradient": self.gradient,
            "monte_carlo_error": float(self.monte_carlo.max(initial=0.0)),
            "iterations": self.iterations,
            "seconds": dict(self.seconds),
            "templates": [
                {"formula": t.text, "n_weights": len(t.weights), **_short(t.weights)} for t in self.model.templates
            ],
        }

    def to_json(self) -> str:
        """The same as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)

    @property
    def n_finite(self) -> int:
        """Number of weights that the data support and that have a finite best value."""
        return int(np.count_nonzero(~self.unsupported & (self.unbounded == 0)))

    def __str__(self) -> str:
        """A summary for a terminal."""
        n_unbounded = int(np.count_nonzero(self.unbounded))
        lines = [
            f"{self.objective:<36}{self._value}  ({self.n_choices:,} atoms and blocks predicted from the rest)",
            f"{'prior':<36}{prior_text(self.prior)}",
            f"{'weights':<36}{len(self.unbounded):,}",
            f"{'  finite':<36}{self.n_finite:,}",
            f"{'  zero':<36}{int(self.unsupported.sum()):,}  (not supported by any data)",
            f"{'  unbounded without prior':<36}{n_unbounded:,}" + self._clipped(n_unbounded),
            f"{'stopped':<36}{self.status} after {self.iterations} steps, {self.measure} {self.gradient:.1e}",
        ]
        if self.monte_carlo.any():
            lines.append(f"{'sampled':<36}standard errors of sampling up to {self.monte_carlo.max():.1e}")
        return "\n".join(lines)

    @property
    def _value(self) -> str:
        return "not known" if np.isnan(self.value) else f"{self.value:.6f}"

    def _clipped(self, n_unbounded: int) -> str:
        if not n_unbounded or self.prior is not None:
            return ""
        return f"  (kept within +-{self.bound:g}: without end these would only explain the data better)"

    def _repr_html_(self) -> str:
        """The same for a notebook, with the weights of small templates."""
        rows = "".join(
            f"<tr><td style='text-align:right'>{t.weights[0]:.6f}</td><td><code>{_escaped(t.text)}</code></td></tr>"
            for t in self.model.templates
            if len(t.weights) == 1
        )
        return f"<pre>{_escaped(str(self))}</pre><table><tr><th>weight</th><th>formula</th></tr>{rows}</table>"


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _short(weights: NDArray[np.float64]) -> dict[str, object]:
    """The weights of a template with few rows; of one with many, their range."""
    if np.isinf(weights).any():
        return {"hard": True}
    if len(weights) <= 20:
        return {"weights": [float(w) for w in weights]}
    return {"smallest": float(weights.min()), "largest": float(weights.max())}
