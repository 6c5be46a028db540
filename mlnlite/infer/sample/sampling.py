"""Sampling: comes in part of a network and a question about it, go out estimates with their errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlnlite.ground.network import Bool, Float, Float32, Int64, Network
from mlnlite.ground.patterns import with_counts
from mlnlite.infer.approach import PATIENCE, Sampler
from mlnlite.infer.deadline import Deadline, in_seconds, interruptible
from mlnlite.infer.sample.columns import Columns
from mlnlite.infer.sample.diagnostics import jeffreys
from mlnlite.infer.sample.factors import Factors, factors_of
from mlnlite.infer.sample.run import (
    FIRST_LOOK,
    LEAST_SIZE,
    MOST_R_HAT,
    Ending,
    Look,
    Run,
    new_run,
    until_precise,
    warm_up,
)
from mlnlite.infer.sample.worlds import can_differ, start_worlds
from mlnlite.model.formulas import Expression

STEEP = 4.0
DISAGREE = 1.05
_WARM_UP = 32
_NAMES = {"gibbs": "Gibbs sampling", "mcsat": "MC-SAT", "tempering": "parallel tempering"}
_NORMAL = 1.959963984540054


@dataclass(frozen=True, slots=True)
class Effort:
    """How hard to try.

    Attributes:
        precision: largest standard error of a probability.
        time_limit: [s]; None for 60.
        n_chains: at least 2.
        seed: where chance starts.
    """

    precision: float = 0.005
    time_limit: float | None = None
    n_chains: int = 4
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Estimates:
    """What sampling found about atoms, then formulas.

    Attributes:
        columns: the numbers; an answer is exact where hard formulas exclude the other value.
        methods: shape (n,), how each was found.
        ending: why sampling stopped.
        traces: of the log-weight of the world and of the number of true groundings of each formula, by name; shape
            (n_chains, n_batches).
        draws: shape (n_chains, n_batches, n), means of batches of draws.
        n_draws: of all chains together.
    """

    columns: Columns
    methods: tuple[str, ...]
    ending: Ending
    traces: dict[str, Float]
    draws: Float32
    n_draws: int


def sample(
    network: Network,
    variables: Bool,
    asked: tuple[Int64, Sequence[Expression]],
    sampler: Sampler | None = None,
    effort: Effort = Effort(),
) -> Estimates:
    """Estimates probabilities by sampling.

    Args:
        network: what was ground.
        variables: shape (n_variables,), whole components that hold all atoms asked for.
        asked: indices into `network.atoms`, and formulas over such.
        sampler: which; None to choose, and to choose again if its chains do not agree after half of the time.
        effort: how hard to try.

    Raises:
        Contradiction: no world satisfies the hard formulas.
        QueryMistake: a weight is not known.
    """
    deadline = in_seconds(PATIENCE if effort.time_limit is None else effort.time_limit)
    factors = factors_of(with_counts(network), variables)
    chosen = sampler or best_sampler(factors)
    with interruptible(deadline):
        whole = deadline if sampler else deadline.within(deadline.left / 2)
        run, found, ending = _run(network, factors, asked, chosen, effort, whole)
        says_little = run.traces.n_draws < FIRST_LOOK
        if sampler is None and ending == "time" and (says_little or _worst(found) <= DISAGREE):
            found, ending = until_precise(run, effort.precision, deadline)
        elif sampler is None and ending == "time":
            second: Sampler = "mcsat" if chosen == "gibbs" else "tempering"
            again = _run(network, factors, asked, second, effort, deadline)
            if _worst(again[1]) < _worst(found):
                chosen, (run, found, ending) = second, again
    return _estimates(network, run, asked, found, ending, chosen)


def best_sampler(factors: Factors) -> Sampler:
    """MC-SAT where a factor over several atoms is hard or nearly so, else Gibbs sampling, which is faster there."""
    rows, index = np.unique(factors.row, return_inverse=True)
    highest = np.maximum.reduceat(factors.value, rows)[index] if len(rows) else np.zeros(0)
    steep = (highest - factors.lowest)[(np.diff(factors.scope) > 1) & ~factors.grouped] >= STEEP
    return "mcsat" if steep.any() else "gibbs"


def _run(
    network: Network,
    factors: Factors,
    asked: tuple[Int64, Sequence[Expression]],
    sampler: Sampler,
    effort: Effort,
    deadline: Deadline,
) -> tuple[Run, Look, Ending]:
    """One attempt."""
    rng = np.random.default_rng(effort.seed)
    worlds = start_worlds(network, effort.n_chains, rng)[:, factors.atom]
    run = new_run(network, factors, worlds, asked, sampler, rng)
    warm_up(run, _WARM_UP, deadline)
    return run, *until_precise(run, effort.precision, deadline)


def _worst(found: Look) -> float:
    """The largest R-hat; infinity if nothing moved at all."""
    return float(np.nanmax(found.r_hat, initial=1.0)) if found.moved.any() else np.inf


def _estimates(
    network: Network,
    run: Run,
    asked: tuple[Int64, Sequence[Expression]],
    found: Look,
    ending: Ending,
    sampler: Sampler,
) -> Estimates:
    """The estimates, and what has to be said about them."""
    n_atoms, moved = len(asked[0]), found.moved
    mean = np.clip(found.mean, 0.0, 1.0)
    low, high = np.clip(mean - _NORMAL * found.error, 0, 1), np.clip(mean + _NORMAL * found.error, 0, 1)
    typical = float(np.median(found.size[moved])) if moved.any() else float(run.traces.n * len(run.chains))
    low[~moved], high[~moved] = jeffreys(mean[~moved] < 0.5, typical)
    exact = np.zeros(len(mean), np.bool_)
    still = np.flatnonzero(~moved[:n_atoms])
    exact[still] = ~can_differ(network, asked[0][still], mean[still] > 0.5)
    for array in (mean, low, high):
        array[exact] = np.round(mean[exact])
    uneven = ~run.even.all(axis=0)
    of_atom = np.repeat(uneven, np.diff(run.factors.first))[run.columns]
    uneven = np.concatenate([of_atom, np.full(len(mean) - n_atoms, uneven.any())])
    mixed = ~moved | ((found.size >= LEAST_SIZE) & (found.r_hat <= MOST_R_HAT))
    traces = {name: run.traces.points[:, run.traces.kept, i] for i, name in enumerate(run.names)}
    columns = Columns(
        mean,
        np.where(exact, 0.0, found.error),
        low,
        high,
        np.where(moved, found.r_hat, np.nan),
        np.where(moved, found.size, np.nan),
        exact,
        mixed,
    )
    said = zip(exact.tolist(), moved.tolist(), uneven.tolist(), strict=True)
    return Estimates(
        columns,
        tuple(_method(sampler, e, m, u) for e, m, u in said),
        ending,
        traces,
        run.traces.means[:, run.traces.kept],
        run.traces.n_draws * len(run.chains),
    )


def _method(sampler: Sampler, exact: bool, moved: bool, uneven: bool) -> str:
    """How one estimate was found."""
    if exact:
        return "forced by hard formulas"
    said = (["partly SampleSAT"] if uneven else []) + ([] if moved else ["never seen otherwise"])
    return ", ".join([_NAMES[sampler], *said])
