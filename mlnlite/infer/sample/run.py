"""Chains at work: comes in where they start, go out traces, longer and longer, until they say enough or time is up."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from time import perf_counter
from typing import Literal, TypeVar

import numpy as np

from mlnlite.ground.network import Bool, Float, Float32, Int32, Int64, Network
from mlnlite.infer.approach import Sampler
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.sample.diagnostics import r_hat, standard_errors
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.gibbs import Chain, Sums, gibbs_draws, log_weights, start
from mlnlite.infer.sample.mcsat.chain import mcsat_draws
from mlnlite.infer.sample.tempering import tempered_draws, with_ladder
from mlnlite.infer.sample.traces import Traces, make_room, new_traces
from mlnlite.infer.sample.truth import Watched, truth_values, watched_by
from mlnlite.model.formulas import Expression

Ending = Literal["precise", "time", "interrupted"]

LEAST_SIZE = 400.0
MOST_R_HAT = 1.01
FIRST_LOOK, _LATER = 256, 1.5
_AT_ONCE, _FEWEST, _WORST, _STRIDE = 0.2, 8, 64, 8
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Run:
    """Chains and what they leave behind.

    Attributes:
        factors: what the chains are about.
        chains: the chains.
        columns: shape (n_atoms,), atoms to estimate, places in `factors`.
        watched: atoms of the formulas to estimate.
        formulas: those, over indices into `Network.atoms`.
        draws: how a chain goes on.
        even: shape (n_chains, n_variables), whether all slices drew that variable uniformly.
        template: shape (n_factors,), place of each factor's template in `names`, 0 for hard ones.
        weight: shape (n_factors,), log-weight of one grounding.
        names: of the point traces: the log-weight, then templates.
        traces: what the chains left behind.
    """

    factors: Factors
    chains: tuple[Chain, ...]
    columns: Int64
    watched: Watched
    formulas: tuple[Expression, ...]
    draws: Callable[[Chain, int, Int32, Bool], Sums]
    even: Bool
    template: Int64
    weight: Float
    names: tuple[str, ...]
    traces: Traces


@dataclass(frozen=True, slots=True)
class Look:
    """What the traces say so far of each column.

    Attributes:
        mean: shape (n,).
        error: shape (n,), standard error of the mean.
        r_hat: shape (n,).
        size: shape (n,), effective sample size.
        moved: shape (n,), whether one draw at least is to be expected on either side.
    """

    mean: Float
    error: Float
    r_hat: Float
    size: Float
    moved: Bool


def new_run(
    network: Network,
    factors: Factors,
    worlds: Bool,
    asked: tuple[Int64, Sequence[Expression]],
    sampler: Sampler,
    rng: np.random.Generator,
) -> Run:
    """Chains at their start.

    Args:
        network: of the factors.
        factors: what the chains are about.
        worlds: shape (n_chains, n_atoms of the factors), where they start.
        asked: indices into `network.atoms`, and formulas over such.
        sampler: how they go on.
        rng: where their chance comes from.
    """
    place = np.full(network.n_atoms, -1, np.int64)
    place[factors.atom] = np.arange(factors.n_atoms)
    atoms, formulas = asked
    chains = [start(factors, world, child) for world, child in zip(worlds, rng.spawn(len(worlds)), strict=True)]
    soft = np.isfinite(network.weights[factors.weight])
    used, template = np.unique(network.template[factors.weight[soft]], return_inverse=True)
    which = np.zeros(factors.n_factors, np.int64)
    which[soft] = template.ravel() + 1
    names = ("log-weight", *(network.model.templates[t].name for t in used.tolist()))
    return Run(
        factors,
        tuple(map(with_ladder, chains)) if sampler == "tempering" else tuple(chains),
        place[atoms],
        watched_by(formulas, factors, place),
        tuple(formulas),
        _DRAWS[sampler],
        np.ones((len(chains), factors.n_variables), np.bool_),
        which,
        np.where(soft, network.weights[factors.weight], 1.0),
        names,
        new_traces(len(chains), len(atoms) + len(formulas), len(names)),
    )


def _gibbs(chain: Chain, n: int, watched: Int32, _: Bool) -> Sums:
    """Draws of Gibbs sampling, which has no slices."""
    return gibbs_draws(chain, n, watched)


_DRAWS: dict[Sampler, Callable[[Chain, int, Int32, Bool], Sums]] = {
    "gibbs": _gibbs,
    "mcsat": mcsat_draws,
    "tempering": tempered_draws,
}


def warm_up(run: Run, n: int, deadline: Deadline) -> None:
    """Lets each chain go on by `n` draws that leave no trace, or until time is up."""

    def work(c: int) -> None:
        for _ in range(0, n, _STRIDE):
            if not deadline.is_over:
                run.draws(run.chains[c], _STRIDE, run.watched.atoms, run.even[c])

    _for_each_chain(run, work)


def advance(run: Run, n: int) -> None:
    """Adds `n` batches to the traces of each chain."""
    traces = run.traces

    def work(c: int) -> Float:
        squares = np.zeros(traces.means.shape[2])
        for t in range(traces.n, traces.n + n):
            sums = run.draws(run.chains[c], traces.batch, run.watched.atoms, run.even[c])
            formulas = truth_values(run.formulas, run.watched, sums.seen).sum(axis=0)
            traces.means[c, t] = np.concatenate([sums.total[0, run.columns], formulas]) / traces.batch
            traces.points[c, t] = _points(run, run.chains[c])
            squares += np.concatenate([sums.total[1, run.columns], formulas])
        return squares

    traces.squares += np.sum(_for_each_chain(run, work), axis=0)
    traces.n += n
    traces.n_draws += n * traces.batch


def _for_each_chain(run: Run, work: Callable[[int], T]) -> list[T]:
    """Does something with each chain, on all cores."""
    with ThreadPoolExecutor(min(len(run.chains), os.cpu_count() or 1)) as pool:
        return list(pool.map(work, range(len(run.chains))))


def _points(run: Run, chain: Chain) -> Float:
    """Log-weight of the present world, then the number of true groundings of each soft template."""
    worth = log_weights(chain)
    counts = np.bincount(run.template, worth / run.weight, len(run.names)).astype(float)
    counts[0] = worth.sum()
    return counts


def look(run: Run, precision: float = np.inf) -> Look:
    """What the traces say so far.

    Args:
        run: chains.
        precision: if errors are larger than this, R-hat is left out (nan).
    """
    traces = run.traces
    series = traces.means[:, traces.kept]
    error, entries = standard_errors(series)
    variance = series.var(axis=(0, 1), dtype=float)
    ratio = np.divide(variance, traces.draw_variance, out=np.ones_like(variance), where=variance > 0)
    mean = series.mean(axis=(0, 1), dtype=float)
    size = entries / np.maximum(ratio, 1e-300)
    n_draws = len(series) * series.shape[1] * traces.batch
    size = np.where(variance > 0, np.minimum(size, n_draws * np.log10(n_draws)), n_draws)
    moved = np.minimum(mean, 1 - mean) * n_draws >= 1.0
    agree = np.full(len(mean), np.nan)
    if (error <= precision).all() and (precision == np.inf or (size[moved] >= LEAST_SIZE).all()):
        changes = moved & (variance > 0)
        agree = np.where(moved, 1.0, np.nan)
        agree[changes] = _agreement(series[:, :, changes], ratio[changes], size[changes], precision)
    return Look(mean, error, agree, size, moved)


def _agreement(series: Float32, ratio: Float, size: Float, precision: float) -> Float:
    """R-hat of each column; with a finite `precision` nan if it is bad where it is likeliest to: at small sizes."""
    if precision < np.inf:
        worst = np.argsort(size)[:_WORST]
        if (r_hat(series[:, :, worst], ratio[worst]) > MOST_R_HAT).any():
            return np.full(len(size), np.nan)
    return r_hat(series, ratio)


def until_precise(run: Run, precision: float, deadline: Deadline) -> tuple[Look, Ending]:
    """Lets the chains go on until all columns are precise, effective sizes large and chains at one, or time is up.

    Twice in a row, because the first time may be luck. When to look depends on the number of draws alone, so that a
    seed gives the same answer each time unless time is up.

    Args:
        run: chains.
        precision: largest standard error.
        deadline: when to stop anyway.
    """
    n, due, was_enough = 1, FIRST_LOOK, False
    while run.traces.n < _FEWEST or not deadline.is_over:
        begin = perf_counter()
        make_room(run.traces)
        traces = run.traces
        n = min(n, traces.means.shape[1] - traces.n, max(1, (due - traces.n_draws) // traces.batch))
        advance(run, n)
        n = max(1, min(32, int(n * _AT_ONCE / (perf_counter() - begin))))
        if run.traces.n_draws >= due:
            found, before = look(run, precision), was_enough
            was_enough = is_enough(found, precision)
            if was_enough and before:
                return found, "precise"
            due = int(due * _LATER)
    return look(run), "interrupted" if deadline.stop.is_set() else "time"


def is_enough(found: Look, precision: float) -> bool:
    """Whether nothing is left to be wished for."""
    m = found.moved
    precise = (found.error[m] <= precision) & (found.size[m] >= LEAST_SIZE) & (found.r_hat[m] <= MOST_R_HAT)
    return bool(precise.all()) and bool((found.error <= precision).all())
