"""What is believed of weights before the data: priors as users state them, and their penalty for the search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, QueryMistake, did_you_mean
from mlnlite.model.templates import Template

Float = NDArray[np.float64]

PRIOR_SD = 5.0
"""Default standard deviation of the Gaussian prior of each weight."""


@dataclass(frozen=True, slots=True)
class Gaussian:
    """Each weight is near `mean`, give or take `sd`."""

    sd: float = PRIOR_SD
    mean: float = 0.0

    def __str__(self) -> str:
        """A phrase for a summary."""
        return f"Gaussian, mean {self.mean:g}, standard deviation {self.sd:g}"


@dataclass(frozen=True, slots=True)
class Laplace:
    """Most weights are exactly 0, the others about `scale` (Tibshirani 1996)."""

    scale: float = 1.0

    def __str__(self) -> str:
        """A phrase for a summary."""
        return f"Laplace, scale {self.scale:g}"


@dataclass(frozen=True, slots=True)
class Cauchy:
    """Weights are within `scale`, some far outside (Gelman, Jakulin, Pittau and Su 2008)."""

    scale: float = 2.5

    def __str__(self) -> str:
        """A phrase for a summary."""
        return f"Cauchy, scale {self.scale:g}"


@dataclass(frozen=True, slots=True)
class Hierarchical:
    """The rows of a `+` template share a mean and a spread, which are learnt with them (empirical Bayes).

    A row that is rarely seen is drawn to the mean of its template, one that is never seen gets it. Weights of
    templates with a single row have a Gaussian prior with standard deviation `sd`; so have the means.
    """

    sd: float = PRIOR_SD

    def __str__(self) -> str:
        """A phrase for a summary."""
        return f"hierarchical: rows of a template share a mean and a spread; standard deviation {self.sd:g} above"


OnePrior: TypeAlias = Gaussian | Laplace | Cauchy | Hierarchical
Prior: TypeAlias = OnePrior | Mapping[str, OnePrior | None]
"""One prior for all weights; or by name (`formula 2`) or text of a formula, `*` being all others."""


@dataclass(frozen=True, slots=True)
class Penalty:
    """Minus the log prior, `p (w - m)^2 / 2 + l |w| + log(1 + ((w - m) / s)^2)`; arrays of shape (n_weights,).

    Attributes:
        mean: m.
        precision: p, 0 for none.
        l1: l, 0 for none.
        cauchy: 1 / s^2, 0 for none.
    """

    mean: Float
    precision: Float
    l1: Float
    cauchy: Float

    def smooth(self, x: Float) -> tuple[float, Float, Float]:
        """The part with derivatives: value, gradient, and a positive bound on the curvature."""
        away = x - self.mean
        scaled = 1.0 + self.cauchy * away**2
        value = 0.5 * float(self.precision @ away**2) + float(np.log(scaled).sum())
        pull = self.precision + 2.0 * self.cauchy / scaled
        return value, pull * away, pull

    def of(self, columns: NDArray[np.int64]) -> Penalty:
        """The penalty of some weights."""
        return Penalty(self.mean[columns], self.precision[columns], self.l1[columns], self.cauchy[columns])

    @property
    def proper(self) -> bool:
        """Whether every weight has a prior."""
        return bool((self.precision + self.l1 + self.cauchy > 0).all())


def prior_of(given: Prior | float | None) -> Prior | None:
    """The prior that a user means: a number, also for a formula, is the standard deviation of a Gaussian.

    Raises:
        QueryMistake: if a scale is not a positive number, or a mean is no number.
    """
    prior = {name: _one(value) for name, value in given.items()} if isinstance(given, Mapping) else _one(given)
    every = [] if prior is None else prior.values() if isinstance(prior, Mapping) else [prior]
    for one in every:
        scale = 1.0 if one is None else one.sd if isinstance(one, Gaussian | Hierarchical) else one.scale
        if not 0 < scale < np.inf:
            hint = "for none say prior=None (`--prior none`)" if scale == np.inf else ""
            raise QueryMistake(f"the scale of a prior is a positive number, found {scale:g}", hint)
        if isinstance(one, Gaussian) and not np.isfinite(one.mean):
            raise QueryMistake(f"the mean of a prior is a number, found {one.mean:g}")
    return prior


def _one(given: OnePrior | float | None) -> OnePrior | None:
    return Gaussian(given) if isinstance(given, int | float) else given


def prior_of_each(prior: Prior | None, templates: Sequence[Template]) -> list[OnePrior | None]:
    """The prior of each template.

    Raises:
        QueryMistake: if a name is of no formula.
    """
    if not isinstance(prior, Mapping):
        return [prior] * len(templates)
    known = {t.name for t in templates} | {t.text for t in templates} | {"*"}
    for name in prior:
        if name not in known:
            hint = did_you_mean(name, sorted(known)) or "say `formula 2`, or the formula as the model writes it"
            raise QueryMistake([Diagnostic("E520", f"there is no formula {name!r} to give a prior", hint=hint)])
    default = prior.get("*")
    return [prior.get(t.name, prior.get(t.text, default)) for t in templates]


def verify_prior(prior: Prior | None, templates: Sequence[Template], objective: str) -> None:
    """Complains of a prior that does not fit the formulas, or what is maximised.

    Raises:
        QueryMistake: if a name is of no formula, or weights of max-margin learning have no Gaussian prior.
    """
    each = prior_of_each(prior, templates)
    learnt = [one for one, t in zip(each, templates, strict=True) if not (t.hard or t.fixed)]
    if objective == "max-margin" and not all(isinstance(one, Gaussian) for one in learnt):
        hint = "its standard deviation, squared, is the usual C"
        raise QueryMistake("max-margin learning needs a Gaussian prior of each weight", hint)


def penalty_of(prior: Prior | None, templates: Sequence[Template]) -> Penalty:
    """The penalty of all weights, template by template; of a hierarchical prior, where its search starts."""
    sizes = [len(t.weights) for t in templates]
    rows = [_row(one) for one in prior_of_each(prior, templates)]
    mean, precision, l1, cauchy = np.repeat(np.array(rows, float).reshape(-1, 4), sizes, axis=0).T
    return Penalty(mean, precision, l1, cauchy)


def _row(prior: OnePrior | None) -> tuple[float, float, float, float]:
    match prior:
        case None:
            return 0.0, 0.0, 0.0, 0.0
        case Gaussian(sd, mean):
            return mean, sd**-2, 0.0, 0.0
        case Hierarchical(sd):
            return 0.0, sd**-2, 0.0, 0.0
        case Laplace(scale):
            return 0.0, 0.0, 1.0 / scale, 0.0
        case Cauchy(scale):
            return 0.0, 0.0, 0.0, scale**-2


def prior_text(prior: Prior | None) -> str:
    """A prior as a summary says it."""
    if isinstance(prior, Mapping):
        return "; ".join(f"{name}: {'none' if one is None else one}" for name, one in prior.items())
    return "none" if prior is None else str(prior)


def prior_data(prior: Prior | None) -> object:
    """A prior as plain data."""
    if prior is None:
        return None
    if isinstance(prior, Mapping):
        return {name: prior_data(one) for name, one in prior.items()}
    fields = {name: getattr(prior, name) for name in type(prior).__slots__}
    return {"family": type(prior).__name__.lower(), **fields}
