"""The most probable world: comes in a network, goes out a world with its log-weight and a bound on any other's."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32, Int64, Network
from mlnlite.infer.conflict import contradiction
from mlnlite.infer.deadline import in_seconds, interruptible
from mlnlite.infer.exact.elimination import best_world
from mlnlite.infer.exact.marginal import CLOSED_FORM, ELIMINATION, MEMORY_LIMIT, WIDTH_LIMIT, limit_reached
from mlnlite.infer.exact.order import TooWide, plan
from mlnlite.infer.map import mincut
from mlnlite.infer.map.rungs import Method, Options, answers_of
from mlnlite.infer.map.satisfy import feasible_world
from mlnlite.infer.map.twins import twins_of
from mlnlite.infer.reduce.components import labels_of
from mlnlite.infer.reduce.dominance import without_dominated
from mlnlite.infer.reduce.equivalence import contracted, put_back_ties
from mlnlite.infer.reduce.narrow import narrowed, written
from mlnlite.infer.reduce.parts import SMALL, Batch, Part, PartAnswer, all_gains, batches, divide, parts, value_of
from mlnlite.infer.reduce.peel import Leaves, changed_by, peel, put_back_labels, put_back_values
from mlnlite.infer.reduce.potentials import Potentials, potentials_of
from mlnlite.infer.score import log_weight, truth_of

SAT = "satisfiability"
_CHEAP = 1 << 18
_CHEAP_IN_ALL = 1 << 20
_DENSE, _SPARSE, _MANY = 16, 5, 2000
_AT_ONCE, _FEW_CELLS = 100_000, 2000
_LOGICAL = 4
"""States of a counting factor that forbids something up to which its logic is drawn upon, as that of clauses."""


@dataclass(frozen=True, slots=True)
class BestWorld:
    """A most probable world, or the best that was found.

    Attributes:
        truth: shape (n_atoms,).
        log_weight: of that world, worked out from the network anew.
        bound: no world has a larger log-weight, up to rounding of the solver where it is larger than `log_weight`.
        status: "optimal" or "feasible".
        component: shape (n_atoms,), the component of each atom.
        component_status: of each component.
        component_method: of each component.
        component_gap: shape (n_components,), how much better the component could at most be.
        methods: number of components that each method answered.
        largest_table: number of entries of the largest table.
    """

    truth: Bool
    log_weight: float
    bound: float
    status: Literal["optimal", "feasible"]
    component: Int64
    component_status: tuple[str, ...]
    component_method: tuple[str, ...]
    component_gap: Float
    methods: Mapping[str, int]
    largest_table: int

    @property
    def gap(self) -> float:
        """How much larger the log-weight of another world could at most be."""
        return float(self.component_gap.sum())


@dataclass(slots=True)
class _Search:
    """The answer so far: values of the variables; value, method, status and gap of each component."""

    values: Int64
    best: Float
    method: list[str]
    status: list[str]
    gap: Float
    largest_table: int = 0
    wide: list[tuple[Part, TooWide]] = field(default_factory=list)


def map_of(
    network: Network,
    *,
    method: Method = "auto",
    time_limit: float | None = None,
    seed: int = 0,
    gap: float = 0.0,
    width_limit: int = WIDTH_LIMIT,
) -> BestWorld:
    """A most probable world, component by component.

    Args:
        network: what was ground.
        method: which rung answers the components that are not small, see `rungs.answers_of`; "auto" is the cheapest
            that can.
        time_limit: [s] for the search, None for no limit. Ctrl-C ends it too; both leave the best world so far.
        seed: for the search.
        gap: good enough is a world that costs at most this share more than the best one.
        width_limit: largest number of entries of a table in elimination.

    Raises:
        Contradiction: no world satisfies the hard formulas.
        LimitReached: a component is too wide for "ve".
        MissingPart: "wcsp" without toulbar2.
        QueryMistake: a weight is not known, or the method cannot answer such a network.
    """
    deadline = in_seconds(time_limit)
    options = Options(method, deadline, seed, gap)
    with interruptible(deadline):
        tied, ties = contracted(potentials_of(network, max_arity=np.inf, chained=True, logical=_LOGICAL))
        leaves: tuple[Leaves, ...] = ()
        found = _at_once(tied, options)
        if found is None:
            core = without_dominated(tied)
            core, leaves = peel(core, maximise=True) if method in ("auto", "ve") else (core, leaves)
            found = _climb(network, core, options, width_limit)
    search, label = found
    put_back_values(leaves, search.values)
    put_back_ties(ties, search.values)
    label = put_back_labels(leaves, label)[ties.leader]
    for component in np.unique(label[changed_by(leaves)]).tolist():
        search.method[component] = search.method[component].replace(CLOSED_FORM, ELIMINATION)
    return _answer(network, label, search)


def _at_once(potentials: Potentials, options: Options) -> tuple[_Search, Int32] | None:
    """A minimum cut through a large network as a whole, if all of it attracts: quicker than component by component."""
    n_cells = 0 if potentials.chains else sum(len(c.amount) for c in potentials.cells)
    if options.method not in ("auto", mincut.MINCUT) or n_cells < _AT_ONCE or np.isneginf(potentials.constant):
        return None
    n = len(potentials.cardinality)
    whole = Part(0, np.arange(n), potentials.cardinality, potentials.cells)
    answer = mincut.solve_part(whole, options.deadline)
    if answer is None or answer.world is None:
        return None
    label = labels_of(n, [c.scope for c in whole.cells]) if answer.optimal else np.zeros(n, np.int32)
    m = int(label.max()) + 1
    gap = np.zeros(m)
    gap[0] = answer.bound - value_of(whole, answer.world)
    status = "optimal" if answer.optimal else "feasible"
    return _Search(answer.world, np.zeros(m), [answer.method] * m, [status] * m, gap), label


def _climb(network: Network, core: Potentials, options: Options, width_limit: int) -> tuple[_Search, Int32]:
    """The best worlds of all components, and the component of each variable."""
    eliminates = options.method in ("auto", "ve")
    division = divide(core, small=SMALL if eliminates else 2)
    n = division.n_components
    search = _Search(np.zeros(len(core.cardinality), np.int64), np.zeros(n), [""] * n, ["optimal"] * n, np.zeros(n))
    everything = np.ones(n, np.bool_)
    for batch in batches(division, everything):
        _list_worlds(batch, search)
    large = list(parts(division, everything))
    twins = twins_of(large)
    originals = [large[i] for i in np.flatnonzero(twins.original == np.arange(len(large))).tolist()]
    wide = [p for p in originals if not (eliminates and _eliminate(p, options.method, width_limit, search))]
    if np.isneginf(core.constant) or np.isneginf(search.best).any():
        raise contradiction(network)
    if wide and options.method == "ve":
        raise limit_reached(network, search.wide, width_limit)
    for part, answers in zip(wide, answers_of(wide, options), strict=True):
        _choose(network, part, answers, search)
    for i, original in enumerate(twins.original.tolist()):
        if original != i:
            _copy(large[i], large[original], twins.world(i, search.values[large[original].variables]), search)
    return search, division.label


def _copy(part: Part, original: Part, world: Int64, search: _Search) -> None:
    """What is known of a component, said of a copy of it."""
    search.values[part.variables] = world
    for answer in (search.best, search.method, search.status, search.gap):
        answer[part.component] = answer[original.component]


def _answer(network: Network, label: Int32, search: _Search) -> BestWorld:
    """Puts the components together."""
    truth = truth_of(network, search.values)
    value = log_weight(network, truth)
    used, component = np.unique(label[network.variable], return_inverse=True)
    status = tuple(search.status[c] for c in used.tolist())
    method = tuple(search.method[c] for c in used.tolist())
    return BestWorld(
        truth=truth,
        log_weight=value,
        bound=value + float(search.gap[used].sum()),
        status="optimal" if all(s == "optimal" for s in status) else "feasible",
        component=component.ravel(),
        component_status=status,
        component_method=method,
        component_gap=search.gap[used],
        methods=dict(Counter(method)),
        largest_table=search.largest_table,
    )


def _list_worlds(batch: Batch, search: _Search) -> None:
    """Best worlds of small components."""
    flat = batch.tables.reshape(len(batch.components), -1)
    best = flat.argmax(axis=1)
    search.best[batch.components] = flat[np.arange(len(flat)), best]
    values = np.unravel_index(best, batch.tables.shape[1:])
    search.values[batch.variables] = np.stack(values, axis=1)
    for component in batch.components.tolist():
        search.method[component] = CLOSED_FORM if batch.variables.shape[1] == 1 else ELIMINATION
    search.largest_table = max(search.largest_table, flat.shape[1])


def _eliminate(part: Part, method: Method, width_limit: int, search: _Search) -> bool:
    """Best world of a large component, if its tables are affordable."""
    largest, total, n = width_limit, max(MEMORY_LIMIT, width_limit), len(part.variables)
    part, constant = written(part)
    if method == "auto":
        largest, total = min(width_limit, _CHEAP), _CHEAP_IN_ALL
        n_cells = sum(len(c.amount) for c in part.cells if c.scope.shape[1] > 1)
        if n_cells > max(_FEW_CELLS, (_DENSE if n < _MANY else _SPARSE) * len(part.cardinality)):
            return False
    part = narrowed(part)
    tree = plan(part.cardinality, [c.scope for c in part.cells], largest, total)
    if isinstance(tree, TooWide):
        search.wide.append((part, tree))
        return False
    value, world = best_world(tree, part.cardinality, part.cells)
    search.values[part.variables] = world[:n]
    search.best[part.component] = value + constant
    search.method[part.component] = ELIMINATION
    search.largest_table = max(search.largest_table, *tree.sizes)
    return True


def _choose(network: Network, part: Part, answers: list[PartAnswer], search: _Search) -> None:
    """Keeps the best of some answers; if none has a world, any world that satisfies the hard formulas."""
    worlds = [(a.world, a.method) for a in answers]
    if all(world is None for world, _ in worlds):
        worlds = [(feasible_world(part), SAT)]
    scored = [(value_of(part, world), world, name) for world, name in worlds if world is not None]
    if not scored:
        raise contradiction(network)
    value, world, name = max(scored, key=lambda s: s[0])
    proved = any(a.optimal for a in answers)
    search.values[part.variables] = world
    search.best[part.component] = value
    search.method[part.component] = next((a.method for a in answers if a.optimal), name)
    search.status[part.component] = "optimal" if proved else "feasible"
    search.gap[part.component] = max(0.0, min([all_gains(part), *(a.bound for a in answers)]) - value)
