"""Takes potentials apart: components small enough to list their worlds, in batches of equal shape, and the others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32, Int64
from mlnlite.infer.reduce.components import labels_of, rows_by_label
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.counting import Chains
from mlnlite.infer.reduce.fill import Placed, fill
from mlnlite.infer.reduce.potentials import Potentials

SMALL = 1024
_BATCH = 1 << 20
_DECIMALS, _LARGEST, _EXACT = 4, 2.0**40, 1e-6


@dataclass(frozen=True, slots=True)
class Batch:
    """Components of equal shape with the log-weights of all their worlds.

    Attributes:
        components: shape (n,), their numbers.
        variables: shape (n, k), the variable on each axis.
        tables: shape (n, *cardinalities).
    """

    components: Int64
    variables: Int64
    tables: Float


@dataclass(frozen=True, slots=True)
class Part:
    """A component that is too large to list its worlds.

    Attributes:
        component: its number.
        variables: shape (n,), its variables, rising.
        cardinality: shape (n,).
        cells: its cells, over indices of `variables`.
        chains: its counting factors that are not among the cells, likewise.
    """

    component: int
    variables: Int64
    cardinality: Int32
    cells: tuple[Cells, ...]
    chains: tuple[Chains, ...] = ()


@dataclass(frozen=True, slots=True)
class PartAnswer:
    """What a solver says of the best world of a component.

    Attributes:
        world: shape (n,), a value for each variable, None if none was found (there may be none).
        bound: no world has a larger log-weight than this; infinity if nothing is known.
        optimal: whether `world` is proved best, up to rounding.
        method: name of the solver.
    """

    world: Int64 | None
    bound: float
    optimal: bool
    method: str


@dataclass(frozen=True, slots=True)
class Summed:
    """What sums over all worlds of a component are, or what is taken for them.

    Attributes:
        log_z: log of the sum of all weights, minus infinity if no world is possible, nan if not known.
        distributions: of the variables that were asked for.
        method: how they were found.
        exact: whether that is more than a guess.
    """

    log_z: float
    distributions: dict[int, Float]
    method: str
    exact: bool = True


@dataclass(frozen=True, slots=True)
class Division:
    """The components of potentials.

    Attributes:
        potentials: of which.
        label: shape (n_variables,), the component of each variable.
        rank: shape (n_components,), place of each component, those of equal shape together, small ones first.
        shapes: the sorted cardinalities of small components, each list once.
        shape_starts: shape (n_shapes + 1,), where the ranks of each shape start; after the last one come large ones.
        members: variables in order of rank; those of one component by cardinality if it is small, else rising.
        starts: shape (n_components + 1,), where each rank starts in `members`.
        cells: sorted by rank.
        cell_starts: for each of the cells, where each rank starts.
        chains: sorted by rank.
        chain_starts: for each of the chains, where each rank starts.
    """

    potentials: Potentials
    label: Int32
    rank: Int64
    shapes: tuple[tuple[int, ...], ...]
    shape_starts: Int64
    members: Int64
    starts: Int64
    cells: tuple[Cells, ...]
    cell_starts: tuple[Int64, ...]
    chains: tuple[Chains, ...]
    chain_starts: tuple[Int64, ...]

    @property
    def n_components(self) -> int:
        """How many components there are."""
        return len(self.rank)


def divide(potentials: Potentials, small: int = SMALL) -> Division:
    """Finds the components and sorts everything by them.

    Args:
        potentials: of a network.
        small: up to how many worlds a component counts as small.
    """
    scopes = [*(c.scope for c in potentials.cells), *(c.variable for c in potentials.chains)]
    label = labels_of(len(potentials.cardinality), scopes)
    n = int(label.max(initial=-1)) + 1
    bits = np.bincount(label, np.log2(potentials.cardinality), minlength=n)
    is_small = bits <= np.log2(small) + 1e-9
    for chained in potentials.chains:
        is_small[label[chained.variable[:, 0]]] = False
    order = np.lexsort((np.where(is_small[label], potentials.cardinality, 0), label))
    starts = np.searchsorted(label[order], np.arange(n + 1))
    shapes, shape = _shapes(potentials.cardinality[order], starts, is_small)
    by_rank = np.argsort(shape, kind="stable")
    rank = np.empty(n, np.int64)
    rank[by_rank] = np.arange(n)
    moved = np.argsort(rank[label[order]], kind="stable")
    lengths = np.diff(starts)[by_rank]
    cells, cell_starts = [], []
    for c in potentials.cells:
        rows, begin = rows_by_label(rank[label[c.scope[:, 0]]].astype(np.int32), n)
        cells.append(Cells(c.scope[rows], c.value[rows], c.amount[rows]))
        cell_starts.append(begin)
    chains, chain_starts = [], []
    for chained in potentials.chains:
        rows, begin = rows_by_label(rank[label[chained.variable[:, 0]]].astype(np.int32), n)
        chains.append(chained.pick(rows, np.arange(len(chained.steps))))
        chain_starts.append(begin)
    return Division(
        potentials, label, rank, shapes, np.searchsorted(shape[by_rank], np.arange(len(shapes) + 1)), order[moved],
        np.concatenate([[0], np.cumsum(lengths)]), tuple(cells), tuple(cell_starts), tuple(chains), tuple(chain_starts),
    )  # fmt: skip


def _shapes(sizes: Int32, starts: Int64, is_small: Bool) -> tuple[tuple[tuple[int, ...], ...], Int64]:
    """The shapes of small components, and for each component the number of its shape, the next one if it is large.

    Args:
        sizes: cardinalities, component by component, rising in small ones.
        starts: shape (n_components + 1,), where each component starts.
        is_small: shape (n_components,).
    """
    shapes: list[tuple[int, ...]] = []
    lengths, shape = np.diff(starts), np.empty(len(is_small), np.int64)
    for length in np.flatnonzero(np.bincount(lengths[is_small])).tolist():
        rows = np.flatnonzero(is_small & (lengths == length))
        found, which = np.unique(sizes[starts[rows, None] + np.arange(length)], axis=0, return_inverse=True)
        shape[rows] = len(shapes) + which.ravel()
        shapes += [tuple(row) for row in found.tolist()]
    shape[~is_small] = len(shapes)
    return tuple(shapes), shape


def batches(division: Division, take: Bool) -> Iterator[Batch]:
    """The small components among some, filled.

    Args:
        division: of potentials.
        take: shape (n_components,), which of them.
    """
    axis = _place_in_component(division)
    number = np.argsort(division.rank)
    for first, last, shape in _stretches(division):
        chosen = np.flatnonzero(take[number[first:last]])
        if not len(chosen):
            continue
        variables = division.members[division.starts[first] : division.starts[last]].reshape(last - first, -1)
        index = np.full(last - first, -1)
        index[chosen] = np.arange(len(chosen))
        placed = []
        for c, begin in zip(division.cells, division.cell_starts, strict=True):
            rows = np.arange(begin[first], begin[last])
            table = index[division.rank[division.label[c.scope[rows, 0]]] - first]
            rows, table = rows[table >= 0], table[table >= 0]
            placed.append(Placed(table, axis[c.scope[rows]], c.value[rows].astype(np.int64), c.amount[rows]))
        yield Batch(number[first:last][chosen], variables[chosen], fill(len(chosen), shape, placed))


def _stretches(division: Division) -> Iterator[tuple[int, int, tuple[int, ...]]]:
    """Ranks of small components of equal shape: first, last + 1, shape; a bounded number of table entries each."""
    for shape, (first, end) in zip(division.shapes, pairwise(division.shape_starts.tolist()), strict=True):
        step = max(1, _BATCH // int(np.prod(shape)))
        for begin in range(first, end, step):
            yield begin, min(begin + step, end), shape


def _place_in_component(division: Division) -> Int64:
    """For each variable its index among the members of its component."""
    place = np.empty(len(division.members), np.int64)
    place[division.members] = np.arange(len(place)) - np.repeat(division.starts[:-1], np.diff(division.starts))
    return place


def parts(division: Division, take: Bool) -> Iterator[Part]:
    """The large components among some.

    Args:
        division: of potentials.
        take: shape (n_components,), which of them.
    """
    local = _place_in_component(division).astype(np.int32)
    number = np.argsort(division.rank)
    for r in range(int(division.shape_starts[-1]), division.n_components):
        if take[number[r]]:
            variables = division.members[division.starts[r] : division.starts[r + 1]]
            cells = tuple(
                Cells(local[c.scope[b[r] : b[r + 1]]], c.value[b[r] : b[r + 1]], c.amount[b[r] : b[r + 1]])
                for c, b in zip(division.cells, division.cell_starts, strict=True)
                if b[r] < b[r + 1]
            )
            chains = tuple(
                replace(own, variable=local[own.variable])
                for c, b in zip(division.chains, division.chain_starts, strict=True)
                if b[r] < b[r + 1]
                for own in [c.pick(np.arange(b[r], b[r + 1]), np.arange(len(c.steps)))]
            )
            yield Part(int(number[r]), variables, division.potentials.cardinality[variables], cells, chains)


def identity(part: Part) -> object:
    """Equal for components that differ in the names of their variables only (if they stand in the same order)."""
    assert not part.chains
    arrays = [a.tobytes() for c in part.cells for a in (c.scope, c.value, c.amount)]
    return part.cardinality.tobytes(), *arrays


def all_gains(part: Part) -> float:
    """The sum of all gains, which no world can pass."""
    of_chains = sum(worth.max() * len(rows) for c in part.chains for rows, worth in c.scaled())
    return float(sum(c.amount[c.amount > 0].sum() for c in part.cells) + of_chains)


def value_of(part: Part, world: Int64) -> float:
    """Log-weight of a world of a component.

    Args:
        part: the component.
        world: shape (n,), a value for each variable.
    """
    of_chains = sum(c.gains(world).sum() for c in part.chains)
    return float(sum(c.amount[holding(c, world)].sum() for c in part.cells) + of_chains)


def holding(cells: Cells, world: Int64) -> Bool:
    """Which cells hold in a world, see `value_of`; shape (n_cells,)."""
    holds = np.ones(len(cells.amount), np.bool_)
    for variable, value in zip(cells.scope.T, cells.value.T, strict=True):
        holds &= world[variable] == value
    return holds


def grain_of(amounts: Sequence[Float]) -> float:
    """The log-weights of two worlds differ by a multiple of this; 0 if nothing of the kind is known.

    Args:
        amounts: all that worlds may gain or lose.
    """
    finite = np.concatenate([np.zeros(0), *amounts])
    scaled = finite[np.isfinite(finite)] * 10.0**_DECIMALS
    if np.abs(scaled).max(initial=0.0) > _LARGEST or np.abs(scaled - np.rint(scaled)).max(initial=0.0) > _EXACT:
        return 0.0
    return float(np.gcd.reduce(np.rint(scaled).astype(np.int64))) / 10.0**_DECIMALS
