"""Learnt weights to their standard errors, intervals and correlations.

The pseudo-likelihood and misstated models make the inverse Hessian too sure. The sandwich `H^-1 J H^-1`, with J from
the scores of independent clusters (databases, or components of one), is not (Godambe 1960; White 1982); the parametric
bootstrap (Efron 1979) draws worlds from the learnt model and learns again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.stats import norm, t

from mlnlite.errors import QueryMistake
from mlnlite.learn.data.wide import wide_slopes
from mlnlite.learn.data.worlds import MOST_WORLDS
from mlnlite.learn.learned import How, LearnedModel
from mlnlite.learn.objectives.sampled import sampled_scores
from mlnlite.learn.optimise import information
from mlnlite.learn.optimise.problem import Problem
from mlnlite.learn.optimise.problem import information as operator
from mlnlite.learn.trust.clusters import clustered
from mlnlite.learn.trust.simulate import APART, simulate
from mlnlite.learn.weights import learn
from mlnlite.model.evidence import Evidence

Float = NDArray[np.float64]
Method = Literal["sandwich", "information", "bootstrap"]

FEW = 20
"""Clusters below which a sandwich is not to be trusted."""


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """How sure learnt weights are.

    Attributes:
        sd: shape (n_weights,), standard error of each weight; nan for those that are not learnt, not supported by
            data, or unbounded.
        low: shape (n_weights,), lower end of the interval.
        high: shape (n_weights,), upper end.
        level: how often such intervals hold the best weight.
        method: `sandwich`, `information` (trusts the model, and that the likelihood is exact) or `bootstrap`.
        n_clusters: independent pieces of data; 0 if the method does not use them.
        covariance: shape (n_weights, n_weights), sparse.
        warnings: what to be careful of.
    """

    sd: Float
    low: Float
    high: Float
    level: float
    method: Method
    n_clusters: int
    covariance: sparse.csr_array
    warnings: tuple[str, ...] = ()

    @property
    def correlation(self) -> Float:
        """Correlations of the weights, shape (n_weights, n_weights); nan where there is no standard error."""
        return np.asarray(self.covariance.todense()) / np.outer(self.sd, self.sd)


def uncertainty(
    learned: LearnedModel,
    databases: Evidence,
    *,
    method: Method = "sandwich",
    level: float = 0.95,
    repetitions: int = 100,
    seed: int = 0,
) -> Uncertainty:
    """Standard errors of learnt weights.

    Args:
        learned: what `learn` gave.
        databases: what it was learnt from.
        method: `sandwich`, from clusters of the data; `information`, from the curvature; `bootstrap`, from worlds drawn
            from the learnt model.
        level: of the intervals.
        repetitions: of the bootstrap.
        seed: of the bootstrap.

    Raises:
        QueryMistake: if the level is not between 0 and 1, there are fewer than two clusters, or the weights were not
            learnt from a likelihood.
    """
    verify_method(learned.how, method)
    if not 0 < level < 1:
        raise QueryMistake(f"the level of an interval is between 0 and 1, found {level:g}")
    if method == "bootstrap":
        return _bootstrap(learned, databases, level, repetitions, seed)
    grouped, n_clusters = learned.problem, 0
    if method == "sandwich":
        grouped, n_clusters = clustered(learned.model, databases, learned.how)
        verify_clusters(n_clusters)
    covariance = _covariance(learned, grouped, method)
    few = f"only {n_clusters} independent clusters: these standard errors are rough; compare the bootstrap"
    warnings = (few,) if method == "sandwich" and n_clusters < FEW else ()
    quantile = t.ppf(0.5 + level / 2, n_clusters - 1) if method == "sandwich" else norm.ppf(0.5 + level / 2)
    sd = _sd(covariance, learned)
    weights = learned.weights
    low, high = weights - quantile * sd, weights + quantile * sd
    return Uncertainty(sd, low, high, level, method, n_clusters, covariance, warnings)


def verify_method(how: How, method: Method) -> None:
    """Complains of a method that does not fit what was learnt."""
    if how.objective == "max-margin" and method != "bootstrap":
        raise QueryMistake("max-margin weights have no likelihood to tell their errors", "ask for the bootstrap")


def verify_clusters(n_clusters: int) -> None:
    """Complains of too few clusters for a sandwich."""
    if n_clusters < 2:
        hint = 'say method="bootstrap" or "information" (`--report bootstrap`), or give several databases'
        raise QueryMistake(f"a sandwich needs at least two independent clusters of data, found {n_clusters}", hint)


def _sd(covariance: sparse.csr_array, learned: LearnedModel) -> Float:
    variance = covariance.diagonal()
    finite = np.zeros(len(variance), bool)
    finite[np.diff(learned.problem.share.indptr) > 0] = True
    finite &= (learned.unbounded == 0) | (learned.prior is not None)
    return np.where(finite & (variance > 0), np.sqrt(np.maximum(variance, 0.0)), np.nan)


def _covariance(learned: LearnedModel, problem: Problem, method: Method) -> sparse.csr_array:
    """Covariance of all weights, block by block.

    The prior counts as one more observation, so that a weight that only the prior holds is as unsure as the prior.
    """
    x = learned.weights[problem.free]
    bend = information.hessian(problem.every, x)
    if problem.known is not None:
        bend = sparse.csr_array(bend - information.hessian(problem.known, x))
    wide, more = _wide(learned, problem, x)
    pull = learned.penalty.of(problem.free).smooth(x)[2]
    bend = sparse.csr_array(bend + more + sparse.diags_array(pull))
    slopes = sparse.vstack([_scores(problem, x), wide], format="csr") if method == "sandwich" else None
    rows, columns, data = [], [], []
    for block in information.blocks(bend):
        inverse = np.linalg.pinv(information.dense(bend, block), rcond=1e-12, hermitian=True)
        if slopes is not None:
            meat = _meat(np.asarray(slopes[:, block].todense(), float)) + np.diag(pull[block])
            inverse = inverse @ meat @ inverse
        grid = np.meshgrid(block, block, indexing="ij")
        rows.append(grid[0].ravel())
        columns.append(grid[1].ravel())
        data.append(inverse.ravel())
    n = len(x)
    entries = (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_array(problem.share @ sparse.csr_array(entries, shape=(n, n)) @ problem.share.T)


def _wide(learned: LearnedModel, problem: Problem, x: Float) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Scores of the databases kept as networks, and what they add to minus the Hessian: as they were learnt from."""
    n = len(x)
    if learned.monte_carlo.any():
        slopes, bend = sampled_scores(problem, x, 0)
        return sparse.csr_array(slopes), sparse.csr_array(bend)
    if not problem.wide:
        return sparse.csr_array((0, n)), sparse.csr_array((n, n))
    wanted = np.asarray(np.diff(problem.share.indptr) > 0)
    slopes = wide_slopes(problem.wide, problem.all_weights(x), wanted)
    only = replace(problem, every=information.without_rows(problem.every), known=None)
    product = operator(only, x)
    bend = np.column_stack([product(direction) for direction in np.eye(n)])
    return sparse.csr_array(slopes @ problem.share), sparse.csr_array((bend + bend.T) / 2)


def _scores(problem: Problem, x: Float) -> sparse.csr_array:
    """The gradient of each cluster."""
    if problem.known is None:
        return information.scores(problem.every, x)
    n = int(problem.every.group.max(initial=0)) + 1
    total = sparse.csr_array((n, len(x)))
    for found, sign in ((problem.every, 1.0), (problem.known, -1.0)):
        clusters = np.unique(found.group)
        place = sparse.csr_array(
            (np.full(len(clusters), sign), (clusters, np.arange(len(clusters)))), (n, len(clusters))
        )
        total = total + place @ information.scores(found, x)
    return sparse.csr_array(total)


def _meat(slopes: Float) -> Float:
    """Covariance of the sum of the clusters' gradients."""
    n = len(slopes)
    away = slopes - slopes.mean(axis=0)
    return np.asarray(away.T @ away * (n / (n - 1)))


def _bootstrap(learned: LearnedModel, databases: Evidence, level: float, repetitions: int, seed: int) -> Uncertainty:
    """Worlds drawn from the learnt model, learnt from again."""
    random, how = np.random.default_rng(seed), learned.how
    approximate, simulated = simulate(learned, databases, repetitions, random)
    draws = []
    for data in simulated:
        again = learn(
            learned.model,
            data,
            objective=how.objective,
            predict=how.predict,
            open_predicates=how.open_predicates,
            prior=learned.prior,
            tied=how.tied,
            database_weights=how.database_weights,
        )
        draws.append(again.weights)
    table, finite = np.array(draws), np.isfinite(learned.weights)
    spread = np.cov(np.where(finite, table, 0.0).T, ddof=1).reshape(table.shape[1], table.shape[1])
    covariance = sparse.csr_array(spread)
    sd = _sd(covariance, learned)
    half = norm.ppf(0.5 + level / 2) * sd
    low, high = learned.weights - half, learned.weights + half
    drawn = f"components of more than {MOST_WORLDS:,} worlds were drawn by sampling, {APART} sweeps apart, not exactly"
    return Uncertainty(sd, low, high, level, "bootstrap", 0, covariance, (drawn,) if approximate else ())
