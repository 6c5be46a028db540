"""How sure a best world is of each value: comes in a network, goes out the best log-weight with each value forced.

Small components from their tables, others by one pass up and one down their clique tree; components too wide for that
are solved again for each value that was asked for. (Max-marginals: Koller and Friedman 2009, chapter 13.)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32, Int64, Network
from mlnlite.infer.deadline import in_seconds
from mlnlite.infer.exact.elimination import combined
from mlnlite.infer.exact.order import TooWide, Tree, plan
from mlnlite.infer.map.rungs import Options, answers_of
from mlnlite.infer.reduce.conjunctions import Cells, starts_of
from mlnlite.infer.reduce.narrow import narrowed
from mlnlite.infer.reduce.parts import Batch, Part, batches, divide, parts, value_of
from mlnlite.infer.reduce.potentials import potentials_of

_CHEAP, _CHEAP_IN_ALL = 1 << 18, 1 << 22


def margins_of(
    network: Network, truth: Bool, atoms: Int64 | None = None, *, time_limit: float | None = None, seed: int = 0
) -> Float:
    """How much log-weight is lost if an atom has to be the other way round than in a best world.

    Args:
        network: what was ground.
        truth: shape (n_atoms,), a best world.
        atoms: indices of the atoms that are asked for, None for all.
        time_limit: [s] for components that cannot be eliminated; what is not known by then is nan.
        seed: of the search.

    Returns:
        Shape (n_atoms,), infinity for what is forced, nan for what was not asked for or is not known.
    """
    wanted = np.zeros(network.n_atoms, np.bool_)
    wanted[slice(None) if atoms is None else atoms] = True
    potentials = potentials_of(network, max_arity=np.inf)
    start = starts_of(potentials.cardinality)
    gain = np.full(int(potentials.cardinality.sum()), np.nan)
    needed = np.zeros(len(potentials.cardinality), np.bool_)
    needed[network.variable[wanted]] = True
    division = divide(potentials)
    take = np.zeros(division.n_components, np.bool_)
    take[division.label[needed]] = True
    options = Options("ilp", in_seconds(time_limit), seed)
    for batch in batches(division, take):
        _of_batch(batch, start, gain)
    for part in parts(division, take):
        _of_part(part, needed, start, gain, options)
    return np.where(wanted, _margins(network, truth, start, gain), np.nan)


def _margins(network: Network, truth: Bool, start: Int64, gain: Float) -> Float:
    """Best value with each atom as it is, less the best one with it otherwise."""
    n = len(start)
    best = np.full(n, -np.inf)
    second = np.full(n, -np.inf)
    owner = np.repeat(np.arange(n), np.diff(np.append(start, len(gain))))
    known = np.where(np.isnan(gain), -np.inf, gain)
    np.maximum.at(best, owner, known)
    at = start[network.variable] + network.value
    others = known.copy()
    others[at[truth]] = -np.inf
    np.maximum.at(second, owner, others)
    # a true atom loses to the best other value of its variable; a false one, to itself
    with np.errstate(invalid="ignore"):
        margin = np.where(truth, best[network.variable] - second[network.variable], best[network.variable] - gain[at])
    unknown = np.isnan(gain)
    partly = np.zeros(n, np.bool_)
    np.logical_or.at(partly, owner, unknown)
    return np.where(truth & partly[network.variable], np.nan, margin)


def _of_batch(batch: Batch, start: Int64, gain: Float) -> None:
    """Max-marginals of small components."""
    for axis in range(batch.variables.shape[1]):
        others = tuple(i + 1 for i in range(batch.variables.shape[1]) if i != axis)
        best = batch.tables.max(axis=others)
        gain[start[batch.variables[:, axis], None] + np.arange(best.shape[1])] = best


def _of_part(part: Part, needed: Bool, start: Int64, gain: Float, options: Options) -> None:
    """Max-marginals of a large component: by elimination, or value by value."""
    small = narrowed(part)
    tree = plan(small.cardinality, [c.scope for c in small.cells], _CHEAP, _CHEAP_IN_ALL)
    if not isinstance(tree, TooWide):
        for v, best in max_marginals(tree, small.cardinality, small.cells).items():
            if v < len(part.variables):
                gain[start[part.variables[v]] + np.arange(len(best))] = best
        return
    for v in np.flatnonzero(needed[part.variables]).tolist():
        for value in range(int(part.cardinality[v])):
            if not options.deadline.is_over:
                gain[start[part.variables[v]] + value] = _forced(part, v, value, options)


def _forced(part: Part, v: int, value: int, options: Options) -> float:
    """The best log-weight of a component with one value forced; nan if it is not known."""
    others = np.array([x for x in range(int(part.cardinality[v])) if x != value], np.int32)[:, None]
    scope = np.full(others.shape, v, np.int32)
    forced = replace(part, cells=(*part.cells, Cells(scope, others, np.full(len(others), -np.inf))))
    (answers,) = answers_of([forced], options)
    proved = [a.world for a in answers if a.optimal and a.world is not None]
    if any(np.isneginf(a.bound) for a in answers):
        return -np.inf
    return value_of(forced, proved[0]) if proved else np.nan


def max_marginals(tree: Tree, cardinality: Int32, cells: tuple[Cells, ...]) -> dict[int, Float]:
    """For each variable the best log-weight with each of its values.

    Args:
        tree: the plan.
        cardinality: shape (n,).
        cells: of the component.
    """
    tables: list[Float] = []
    messages: list[Float] = []
    for _, table, out in combined(tree, cardinality, cells):
        tables.append(table)
        messages.append(table.max(axis=0))
        out.append(messages[-1])
    total = sum(float(m[0]) for m, parent in zip(messages, tree.parents, strict=True) if parent < 0)
    from_above: dict[int, Float] = {}
    found: dict[int, Float] = {}
    children = [[c for c, p in enumerate(tree.parents) if p == k] for k in range(len(tables))]
    for k in reversed(range(len(tables))):
        scope, count = tree.scopes[k], tree.n_eliminated[k]
        if tree.parents[k] < 0:
            belief = tables[k] + (total - messages[k])
        else:
            finite = np.isfinite(messages[k])
            belief = tables[k] + np.where(finite, from_above.pop(k) - np.where(finite, messages[k], 0.0), -np.inf)
        shaped = belief.reshape(cardinality[list(scope)])
        for axis, v in enumerate(scope[:count]):
            found[v] = shaped.max(axis=tuple(i for i in range(len(scope)) if i != axis))
        for child in children[k]:
            kept = set(tree.scopes[child][tree.n_eliminated[child] :])
            from_above[child] = shaped.max(axis=tuple(i for i, v in enumerate(scope) if v not in kept)).ravel()
    return found
