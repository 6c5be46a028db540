"""The k best worlds, and different good ones: comes in a network, go out worlds in order of their weight.

Within a component, the next best world is the best one when those before are forbidden (Lawler 1972); lists of the
components merge. Different worlds pay for each value that they share with those before (Batra et al., Diverse M-best
solutions in Markov random fields, ECCV 2012).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mlnlite.ground.network import Bool, Int64, Network
from mlnlite.infer.conflict import contradiction
from mlnlite.infer.deadline import in_seconds, interruptible
from mlnlite.infer.map.rungs import Options, answers_of
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.parts import Batch, Part, batches, divide, parts, value_of
from mlnlite.infer.reduce.potentials import Potentials, potentials_of
from mlnlite.infer.score import log_weight, truth_of


@dataclass(frozen=True, slots=True)
class World:
    """One world of several.

    Attributes:
        truth: shape (n_atoms,).
        log_weight: its own.
        proved: whether every world that is not listed before it has at most that log-weight.
    """

    truth: Bool
    log_weight: float
    proved: bool


@dataclass(frozen=True, slots=True)
class _Choice:
    """The worlds so far of the components so far: a value, the choice before, and what this component does."""

    value: float
    proved: bool
    before: _Choice | None
    variables: Int64
    values: Int64


def best_worlds(network: Network, k: int, *, time_limit: float | None = None, seed: int = 0) -> list[World]:
    """The k best worlds, fewer if there are not so many.

    Args:
        network: what was ground.
        k: how many.
        time_limit: [s] for all of them.
        seed: of the search.

    Raises:
        Contradiction: no world satisfies the hard formulas.
    """
    potentials = potentials_of(network, max_arity=np.inf)
    if np.isneginf(potentials.constant):
        raise contradiction(network)
    options = Options("ilp", in_seconds(time_limit), seed)
    choices: list[_Choice] = []
    with interruptible(options.deadline):
        for worlds in _lists(potentials, k, options):
            if not worlds:
                raise contradiction(network)
            choices = _product(choices, worlds, k) if choices else worlds
    return [_world(network, potentials, c) for c in choices]


def diverse_worlds(
    network: Network, k: int, penalty: float, *, time_limit: float | None = None, seed: int = 0
) -> list[World]:
    """A best world, then best worlds that lose `penalty` for each variable that is as in one before.

    Args:
        network: what was ground.
        k: how many.
        penalty: log-weight.
        time_limit: [s] for all of them.
        seed: of the search.

    Raises:
        Contradiction: no world satisfies the hard formulas.
    """
    potentials = potentials_of(network, max_arity=np.inf)
    found: list[World] = []
    deadline = in_seconds(time_limit)
    for _ in range(k):
        worlds: list[_Choice] = []
        options = Options("ilp", deadline, seed)
        for best in _lists(potentials, 1, options):
            if not best:
                raise contradiction(network)
            worlds = _product(worlds, best, 1) if worlds else best
        values = _values(potentials, worlds[0])
        found.append(replace(_world(network, potentials, worlds[0]), proved=worlds[0].proved and not found))
        potentials = replace(potentials, cells=(*potentials.cells, _as_before(values, penalty)))
    return found


def _as_before(values: Int64, penalty: float) -> Cells:
    """A cell for each variable: it pays for the value that it had."""
    n = len(values)
    return Cells(np.arange(n, dtype=np.int32)[:, None], values.astype(np.int32)[:, None], np.full(n, -penalty))


def _lists(potentials: Potentials, k: int, options: Options) -> Iterator[list[_Choice]]:
    """The best worlds of each component."""
    division = divide(potentials)
    everything = np.ones(division.n_components, np.bool_)
    for batch in batches(division, everything):
        yield from _listed(batch, k)
    for part in parts(division, everything):
        yield list(_searched(part, k, options))


def _listed(batch: Batch, k: int) -> Iterator[list[_Choice]]:
    """The best worlds of small components."""
    flat = batch.tables.reshape(len(batch.components), -1)
    order = np.argsort(-flat, axis=1, kind="stable")[:, :k]
    for variables, row, best in zip(batch.variables, flat, order, strict=True):
        values = np.stack(np.unravel_index(best, batch.tables.shape[1:]), axis=1)
        yield [
            _Choice(float(row[b]), True, None, variables, v)
            for b, v in zip(best.tolist(), values, strict=True)
            if np.isfinite(row[b])
        ]


def _searched(part: Part, k: int, options: Options) -> Iterator[_Choice]:
    """The best worlds of a large component, each forbidden once it is found."""
    n = len(part.variables)
    for _ in range(k):
        (answers,) = answers_of([part], options)
        worlds = [a.world for a in answers if a.world is not None]
        if not worlds:
            return
        best = max(worlds, key=lambda world: value_of(part, world))
        value = value_of(part, best)
        if np.isneginf(value):
            return
        yield _Choice(value, any(a.optimal for a in answers), None, part.variables, best)
        scope = np.arange(n, dtype=np.int32)[None]
        part = replace(part, cells=(*part.cells, Cells(scope, best.astype(np.int32)[None], np.array([-np.inf]))))


def _product(left: list[_Choice], right: list[_Choice], k: int) -> list[_Choice]:
    """The k best pairs, best first."""
    pairs = [
        _Choice(a.value + b.value, a.proved and b.proved, a, b.variables, b.values)
        for i, a in enumerate(left)
        for b in right[: k // (i + 1) + 1]
    ]
    return sorted(pairs, key=lambda c: -c.value)[:k]


def _values(potentials: Potentials, choice: _Choice) -> Int64:
    """Value of each variable."""
    values = np.zeros(len(potentials.cardinality), np.int64)
    link: _Choice | None = choice
    while link is not None:
        values[link.variables] = link.values
        link = link.before
    return values


def _world(network: Network, potentials: Potentials, choice: _Choice) -> World:
    truth = truth_of(network, _values(potentials, choice))
    return World(truth, log_weight(network, truth), choice.proved)
