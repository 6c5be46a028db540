"""Exact marginals: comes in a network, goes out a probability for each atom and the log partition function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from mlnlite.errors import LimitReached
from mlnlite.ground.network import Bool, Float, Int32, Int64, Network
from mlnlite.infer.conflict import contradiction
from mlnlite.infer.exact.elimination import log_sum
from mlnlite.infer.exact.order import TooWide, plan
from mlnlite.infer.reduce.conjunctions import starts_of
from mlnlite.infer.reduce.fold import fold, unfold
from mlnlite.infer.reduce.jointly import jointly
from mlnlite.infer.reduce.parts import Batch, Division, Part, Summed, batches, divide, identity, parts
from mlnlite.infer.reduce.peel import (
    Gone,
    changed_by,
    peel,
    put_back_distributions,
    put_back_labels,
    with_parents,
)
from mlnlite.infer.reduce.potentials import Potentials, potentials_of

WIDTH_LIMIT = 1 << 25
MEMORY_LIMIT = 1 << 27
CLOSED_FORM, ELIMINATION = "closed form", "elimination"

Rung = Callable[[Part, Bool], Summed | None]
"""Answers a component that is too wide for elimination, about some of its variables; None if it cannot."""


@dataclass(frozen=True, slots=True)
class AtomProbabilities:
    """Probabilities of the atoms of a network.

    Attributes:
        probability: shape (n_atoms,), nan for atoms that were not asked for or not answered.
        slack: shape (n_atoms,), share of all worlds that a probability may leave out: 0 where it is exact to machine
            precision, nan where nothing is known.
        method: how each was found, empty where it was not.
        log_z: log of the sum of the weights of all worlds of the atoms in the network, the groundings that evidence
            decides included. (Unknown atoms that no factor and no question touches are not in the network; each of
            them, were it counted, would add log 2.) nan if the answer did not need every component.
        n_components: how many components the network has.
        largest_table: number of entries of the largest table.
        component: shape (n_atoms,), the component of each atom.
        part_log_z: shape (n_atoms,), log partition function of that component, but for what every world has.
        wide: numbers of the components past a limit.
        costly: those past the limit of all tables together only.
    """

    probability: Float
    slack: Float
    method: tuple[str, ...]
    log_z: float
    n_components: int
    largest_table: int
    component: Int32
    part_log_z: Float
    wide: tuple[int, ...]
    costly: tuple[int, ...] = ()

    @property
    def exact(self) -> Bool:
        """Shape (n_atoms,), whether each probability is exact to machine precision."""
        return np.asarray(self.slack == 0)


@dataclass(slots=True)
class Distributions:
    """Distributions of variables, filled in component by component.

    Attributes:
        start: shape (n_variables,), where the distribution of each variable starts in `probability`.
        probability: shape (total cardinality,), nan where not worked out.
        label: shape (n_variables,), the component of each variable (leaves that were peeled off have left numbers of
            components unused).
        log_z: shape (n_components,), nan where not worked out.
        method: of each component, empty where not worked out.
        constant: log-weight that every world has; minus infinity if no world is possible.
        guessed: components of which the distributions are not exact.
        wide: components past the limit, with what it would have taken.
        largest_table: number of entries.
    """

    start: Int64
    probability: Float
    label: Int32
    log_z: Float
    method: list[str]
    constant: float
    guessed: list[int] = field(default_factory=list)
    wide: list[tuple[Part, TooWide]] = field(default_factory=list)
    largest_table: int = 0


def marginals_of(
    network: Network,
    atoms: Int64 | None = None,
    *,
    width_limit: int = WIDTH_LIMIT,
    in_all: int | None = None,
    too_wide: Literal["raise", "leave"] = "raise",
    rung: Rung | None = None,
) -> AtomProbabilities:
    """Probabilities of atoms by closed form, listing and elimination.

    Args:
        network: what was ground.
        atoms: indices into `network.atoms`; None for all. Components without any of them are not looked at.
        width_limit: largest number of entries of a table.
        in_all: of all tables of a component together; None for `MEMORY_LIMIT`, or the width limit if that is more.
        too_wide: what to do with components past the limit: raise, or leave their atoms to another method.
        rung: what to try with them before that.

    Raises:
        Contradiction: no world satisfies the hard formulas.
        LimitReached: a component is too wide.
        QueryMistake: a weight is not known.
    """
    potentials = potentials_of(network, chained=True)
    asked = np.zeros(network.n_atoms, np.bool_)
    asked[slice(None) if atoms is None else atoms] = True
    wanted = np.zeros(len(potentials.cardinality), np.bool_)
    wanted[network.variable[asked]] = True
    found = distributions_of(potentials, wanted, wanted if atoms is not None else None, width_limit, rung, in_all)
    if np.isneginf(found.constant) or np.isneginf(found.log_z).any():
        raise contradiction(network)
    if found.wide and too_wide == "raise":
        raise limit_reached(network, found.wide, width_limit)
    probability = np.where(asked, found.probability[found.start[network.variable] + network.value], np.nan)
    label = found.label[network.variable]
    method = tuple(found.method[c] if a else "" for c, a in zip(label.tolist(), asked.tolist(), strict=True))
    wide = tuple(part.component for part, _ in found.wide)
    costly = tuple(part.component for part, needs in found.wide if needs.in_all)
    log_z = float(found.log_z.sum() + found.constant)
    slack = np.where(np.isnan(probability) | np.isin(label, found.guessed), np.nan, 0.0)
    n_components = len(np.unique(found.label[: network.n_variables]))
    return AtomProbabilities(
        probability, slack, method, log_z, n_components, found.largest_table, label, found.log_z[label], wide, costly
    )


def distributions_of(
    potentials: Potentials,
    wanted: Bool,
    needed: Bool | None = None,
    width_limit: int = WIDTH_LIMIT,
    rung: Rung | None = None,
    in_all: int | None = None,
) -> Distributions:
    """Distributions of variables and the log partition function of each component.

    Args:
        potentials: of a network.
        wanted: shape (n_variables,), whose distribution to work out.
        needed: shape (n_variables,): only components with one of these are looked at; None for all components.
        width_limit: largest number of entries of a table.
        rung: what to try with components past the limit.
        in_all: as in `marginals_of`.
    """
    flat, folded = fold(potentials)
    core, leaves = peel(flat, maximise=False)
    gone: tuple[Gone, ...] = (*folded, *leaves)
    more = len(core.cardinality) - len(wanted)
    cardinality = np.concatenate([potentials.cardinality, flat.cardinality[len(wanted) :]])
    wanted, division = with_parents(gone, np.pad(wanted, (0, more))), divide(core)
    found = _nothing_yet(cardinality, flat.constant, division, gone)
    take = np.ones(division.n_components, np.bool_)
    if needed is not None:
        needed = with_parents(gone, np.pad(needed, (0, more)))
        take = np.bincount(division.label[needed], minlength=division.n_components) > 0
    for batch in batches(division, take):
        _list_worlds(batch, found)
    known: dict[object, Summed | TooWide] = {}
    for part in parts(division, take):
        own = wanted[part.variables]
        key = identity(part), own.tobytes()
        if key not in known:
            tried = _summed(part, own, (width_limit, in_all or max(MEMORY_LIMIT, width_limit)), found)
            known[key] = (rung(part, own) or tried) if rung is not None and isinstance(tried, TooWide) else tried
        _enter(part, known[key], found)
    put_back_distributions(leaves, found.start, found.probability)
    unfold(folded, found.start, found.probability)
    for component in np.unique(found.label[changed_by(gone)]).tolist():
        found.method[component] = found.method[component].replace(CLOSED_FORM, ELIMINATION)
    return found


def _nothing_yet(cardinality: Int32, constant: float, division: Division, gone: Sequence[Gone]) -> Distributions:
    """Distributions to be filled in."""
    n = division.n_components
    start = starts_of(cardinality)
    label = put_back_labels(gone, division.label)
    log_z = np.full(n, np.nan)
    log_z[division.label[label != division.label]] = 0.0
    return Distributions(start, np.full(int(cardinality.sum()), np.nan), label, log_z, [""] * n, constant)


def _list_worlds(batch: Batch, found: Distributions) -> None:
    """Sums over all worlds of small components."""
    n = len(batch.components)
    flat = batch.tables.reshape(n, -1)
    peak = flat.max(axis=1)
    weight = np.exp(flat - np.where(np.isneginf(peak), 0.0, peak)[:, None])
    mass = weight.sum(axis=1)
    with np.errstate(divide="ignore"):
        found.log_z[batch.components] = np.where(np.isneginf(peak), peak, peak + np.log(mass))
    weight = (weight / np.where(mass > 0, mass, 1.0)[:, None]).reshape(batch.tables.shape)
    n_axes = batch.variables.shape[1]
    for axis in range(n_axes):
        distribution = weight.sum(axis=tuple(a + 1 for a in range(n_axes) if a != axis))
        for value in range(distribution.shape[1]):
            found.probability[found.start[batch.variables[:, axis]] + value] = distribution[:, value]
    for component in batch.components.tolist():
        found.method[component] = CLOSED_FORM if n_axes == 1 else ELIMINATION
    found.largest_table = max(found.largest_table, flat.shape[1])


def _summed(part: Part, wanted: Bool, limits: tuple[int, int], found: Distributions) -> Summed | TooWide:
    """Sums over all worlds of a large component, with tables of so many entries, and so many in all."""
    tree = plan(part.cardinality, [c.scope for c in part.cells], *limits)
    if isinstance(tree, TooWide):
        return _summed_jointly(part, wanted, limits, found) or tree
    found.largest_table = max(found.largest_table, *tree.sizes)
    return Summed(*log_sum(tree, part.cardinality, part.cells, wanted), ELIMINATION)


def _summed_jointly(part: Part, wanted: Bool, limits: tuple[int, int], found: Distributions) -> Summed | None:
    """As `_summed`, with variables as one where hard formulas leave few joint states; None if that does not help."""
    joint = jointly(part)
    if joint is None:
        return None
    small = joint.part
    tree = plan(small.cardinality, [c.scope for c in small.cells], *limits)
    if isinstance(tree, TooWide):
        return None
    found.largest_table = max(found.largest_table, *tree.sizes)
    asked = np.zeros(len(small.cardinality), np.bool_)
    asked[joint.owner[wanted]] = True
    log_z, every = log_sum(tree, small.cardinality, small.cells, asked)
    mine = {v: joint.distribution(v, every[joint.owner[v]]) for v in np.flatnonzero(wanted).tolist() if every}
    return Summed(log_z, mine, ELIMINATION)


def _enter(part: Part, summed: Summed | TooWide, found: Distributions) -> None:
    """Writes down what is known of a large component."""
    if isinstance(summed, TooWide):
        found.wide.append((part, summed))
        return
    found.log_z[part.component], found.method[part.component] = summed.log_z, summed.method
    found.guessed += [] if summed.exact else [part.component]
    for v, distribution in summed.distributions.items():
        begin = found.start[part.variables[v]]
        found.probability[begin : begin + len(distribution)] = distribution


def limit_reached(network: Network, wide: list[tuple[Part, TooWide]], width_limit: int) -> LimitReached:
    """Says how wide the widest of some components is and what would help."""
    part, needs = max(wide, key=lambda w: w[1].log2_size)
    n_atoms = int(np.isin(network.variable, part.variables).sum())
    example = _example(network, part)
    if needs.in_all:
        limit = max(MEMORY_LIMIT, width_limit)
        takes = f"tables over up to {needs.variables} variables (2^{needs.log2_size:.1f} entries in all"
    else:
        limit = width_limit
        takes = f"a table over {needs.variables} variables (2^{needs.log2_size:.1f} entries"
    return LimitReached(
        f"{n_atoms} unknown atoms{example} hang together so closely that an exact answer needs {takes}; "
        f"the limit is 2^{np.log2(limit):.0f})",
        hint="give more evidence, declare predicates closed world, mark a functional argument with `!` or `?`, "
        "ask for fewer atoms, or raise the width limit",
    )


def _example(network: Network, part: Part) -> str:
    """One atom of the component, if atoms have names."""
    if not network.evidence.predicates:
        return ""
    atom = int(np.flatnonzero(np.isin(network.variable, part.variables))[0])
    return f" (such as {network.evidence.atom_text(int(network.atoms[atom]))})"
