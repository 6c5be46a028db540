"""The most probable world: comes in a network, goes out a world with its log-weight and a bound on any other's."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32, Int64, Network
from mlnlite.infer import toulbar2
from mlnlite.infer.conflict import contradiction
from mlnlite.infer.elimination import best_world
from mlnlite.infer.marginal import CLOSED_FORM, ELIMINATION, MEMORY_LIMIT, WIDTH_LIMIT, limit_reached
from mlnlite.infer.order import TooWide, Tree, plan
from mlnlite.infer.parts import SMALL, Batch, Part, batches, divide, parts
from mlnlite.infer.peel import changed_by, peel, put_back_labels, put_back_values
from mlnlite.infer.potentials import potentials_of
from mlnlite.infer.satisfy import feasible_world
from mlnlite.infer.score import log_weight, truth_of

Method = Literal["auto", "ve", "wcsp"]
WCSP, SAT = "wcsp", "satisfiability"
_CHEAP = 1 << 23


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
        return self.bound - self.log_weight


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
    width_limit: int = WIDTH_LIMIT,
) -> BestWorld:
    """A most probable world, component by component.

    Args:
        network: what was ground.
        method: "ve" eliminates, "wcsp" uses toulbar2, "auto" eliminates where that is cheap or toulbar2 is missing.
        time_limit: [s] for toulbar2.
        seed: for toulbar2.
        width_limit: largest number of entries of a table in elimination.

    Raises:
        Contradiction: no world satisfies the hard formulas.
        LimitReached: a component is too wide for elimination.
        MissingPart: "wcsp" without toulbar2.
        QueryMistake: a weight is not known.
    """
    potentials = potentials_of(network)
    core, leaves = (potentials, ()) if method == "wcsp" else peel(potentials, maximise=True)
    division = divide(core, small=2 if method == "wcsp" else SMALL)
    n = division.n_components
    values = np.zeros(len(potentials.cardinality), np.int64)
    search = _Search(values, np.zeros(n), [""] * n, ["optimal"] * n, np.zeros(n))
    everything = np.ones(n, np.bool_)
    for batch in batches(division, everything):
        _list_worlds(batch, search)
    for_toulbar2 = []
    for part in parts(division, everything):
        if method == "wcsp" or not _eliminate(part, method, width_limit, search):
            for_toulbar2.append(part)
    if np.isneginf(potentials.constant) or np.isneginf(search.best).any():
        raise contradiction(network)
    if for_toulbar2 and method != "wcsp" and (method == "ve" or not toulbar2.is_available()):
        raise limit_reached(network, search.wide, width_limit)
    _ask_toulbar2(network, for_toulbar2, (time_limit, seed), search)
    put_back_values(leaves, search.values)
    label = put_back_labels(leaves, division.label)
    for component in np.unique(label[changed_by(leaves)]).tolist():
        search.method[component] = search.method[component].replace(CLOSED_FORM, ELIMINATION)
    return _answer(network, label, search)


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
        bound=value + float(search.gap.sum()),
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
    use_other = method == "auto" and toulbar2.is_available()
    tree = plan(part.cardinality, [c.scope for c in part.cells], min(width_limit, _CHEAP) if use_other else width_limit)
    if isinstance(tree, Tree) and sum(tree.sizes) > (4 * _CHEAP if use_other else max(MEMORY_LIMIT, width_limit)):
        tree = TooWide(max(map(len, tree.scopes)), float(np.log2(sum(tree.sizes))))
    if isinstance(tree, TooWide):
        search.wide.append((part, tree))
        return False
    value, world = best_world(tree, part.cardinality, part.cells)
    search.values[part.variables] = world
    search.best[part.component] = value
    search.method[part.component] = ELIMINATION
    search.largest_table = max(search.largest_table, *tree.sizes)
    return True


def _ask_toulbar2(network: Network, wide: list[Part], limits: tuple[float | None, int], search: _Search) -> None:
    """Best worlds by toulbar2; where it finds none in time, any world that satisfies the hard formulas."""
    for part, answer in zip(wide, toulbar2.solve_parts(wide, *limits) if wide else [], strict=True):
        found = feasible_world(part) if answer.world is None else answer.world
        if found is None:
            raise contradiction(network)
        value, highest = _value_and_bound(part, found)
        search.values[part.variables] = found
        search.best[part.component] = value
        search.method[part.component] = SAT if answer.world is None else WCSP
        search.status[part.component] = "optimal" if answer.optimal else "feasible"
        search.gap[part.component] = max(0.0, min(answer.bound, highest) - value)


def _value_and_bound(part: Part, world: Int64) -> tuple[float, float]:
    """Log-weight of a world of a component, and the sum of all gains, which no world can pass."""
    value = highest = 0.0
    for c in part.cells:
        value += float(c.amount[(world[c.scope] == c.value).all(axis=1)].sum())
        highest += float(c.amount[c.amount > 0].sum())
    return value, highest
