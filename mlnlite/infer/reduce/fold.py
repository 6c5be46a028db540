"""Sums lone literals out of counting factors: comes in potentials with chains, go out potentials with cells only.

A literal is alone if its variable is in one counting factor and else in cells of its own. Whatever order a chain reads
its literals in, the sum is the same: lone ones go first, along the diagram, in time of its size (k^2 for k of them).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.reduce.conjunctions import Cells, cells_of, split_wide, starts_of
from mlnlite.infer.reduce.counting import Chains, Diagram, diagram, written_out
from mlnlite.infer.reduce.potentials import Potentials
from mlnlite.infer.reduce.propagate import propagate


@dataclass(frozen=True, slots=True)
class Folded:
    """Lone literals of n chains that read them in the same way.

    Attributes:
        literals: the chains, the lone literals first.
        parent: shape (n,), the variable that holds the state after the lone literals.
        own: shape (n, n_lone, 2), log-weight of each literal if it is false, and if it is true.
        plan: how the chains read them.
        before: for each literal and after the last, shape (n, n_states): log of the sum of what leads to each state.
    """

    literals: Chains
    parent: Int64
    own: Float
    plan: Diagram
    before: tuple[Float, ...]

    @property
    def variable(self) -> Int64:
        """Shape (n * n_lone,), the variables that were summed out."""
        return self.literals.variable[:, : self.own.shape[1]].ravel().astype(np.int64)

    @property
    def hangs_on(self) -> Int64:
        """Shape (n * n_lone,), the variable that each of them hangs on."""
        return np.repeat(self.parent, self.own.shape[1])


def fold(potentials: Potentials) -> tuple[Potentials, tuple[Folded, ...]]:
    """Potentials without chains, in which folded variables have one value and no cells."""
    if not potentials.chains:
        return potentials, ()
    lone, start, own = _lone(potentials)
    cardinality, constant = potentials.cardinality, potentials.constant
    cells = list(potentials.cells)
    folded: list[Folded] = []
    for chains in potentials.chains:
        for same, n_lone in _by_order(chains, lone):
            plan = diagram(same.worth, same.steps)
            if plan is None:
                return replace(potentials, chains=(), constant=-np.inf), ()
            rows, cardinality, states = written_out(same, plan, cardinality, n_lone)
            for row in rows:
                narrow, cardinality = split_wide(row, cardinality)
                for part in narrow:
                    add, gain = cells_of(part, cardinality)
                    cells, constant = [*cells, *add], constant + gain
            if n_lone:
                folded.append(_folded(same, plan, n_lone, states[:, n_lone - 1].astype(np.int64), (start, own)))
                cells.append(_arrived(folded[-1]))
    gone = np.zeros(len(cardinality), np.bool_)
    for group in folded:
        gone[group.variable] = True
    kept = [c for c in (_without(c, gone) for c in cells) if len(c.amount)]
    small = np.where(gone, 1, cardinality).astype(np.int32)
    return Potentials(small, *propagate(kept, small, constant)), tuple(folded)


def _lone(potentials: Potentials) -> tuple[Bool, Int64, Float]:
    """Which variables are alone; where the values of each start, and what each value gains by itself."""
    n, cardinality = len(potentials.cardinality), potentials.cardinality
    start = starts_of(cardinality)
    own, uses = np.zeros(int(cardinality.sum())), np.zeros(n, np.int64)
    for c in potentials.cells:
        if c.scope.shape[1] == 1:
            np.add.at(own, start[c.scope[:, 0]] + c.value[:, 0], c.amount)
        else:
            uses += 2 * np.bincount(c.scope.ravel(), minlength=n)
    for chains in potentials.chains:
        uses += np.bincount(chains.variable.ravel(), minlength=n)
    return (uses == 1) & (cardinality == 2), start, own


def _by_order(chains: Chains, lone: Bool) -> list[tuple[Chains, int]]:
    """Chains with their lone literals first, those together whose steps are then equal, and how many those are.

    One literal at least stays, so that nothing is left without a variable.
    """
    alone = lone[chains.variable]
    keys, which = np.unique(alone, axis=0, return_inverse=True)
    found = []
    for i, key in enumerate(keys):
        n_lone = min(int(key.sum()), len(key) - 1)
        order = np.argsort(~key, kind="stable")
        found.append((chains.pick(np.flatnonzero(which.ravel() == i), order), n_lone))
    return found


def _folded(chains: Chains, plan: Diagram, n_lone: int, parent: Int64, single: tuple[Int64, Float]) -> Folded:
    """Sums along the diagram."""
    start, gain = single
    true_at = np.where(chains.equal, chains.value, 1 - chains.value)[:, :n_lone]
    first = start[chains.variable[:, :n_lone]]
    own = np.stack([gain[first + 1 - true_at], gain[first + true_at]], axis=2)
    here = np.zeros((len(parent), 1))
    before = [here]
    for i in range(n_lone):
        rows = plan.after[i]
        following = np.full((int(rows.max()) + 1, len(parent)), -np.inf)
        for truth in (0, 1):
            alive = rows[:, truth] >= 0
            worth = here[:, alive] + own[:, i, truth, None]
            np.logaddexp.at(following, rows[alive, truth], worth.T)
        here = following.T
        before.append(here)
    return Folded(chains, parent, own, plan, tuple(before))


def _arrived(folded: Folded) -> Cells:
    """What the states after the lone literals gain."""
    n, n_states = folded.before[-1].shape
    scope = np.repeat(folded.parent, n_states).astype(np.int32)[:, None]
    return Cells(scope, np.tile(np.arange(n_states, dtype=np.int32), n)[:, None], folded.before[-1].ravel())


def _without(cells: Cells, gone: Bool) -> Cells:
    """Cells without those of variables that are gone."""
    keep = ~gone[cells.scope].any(axis=1)
    return Cells(cells.scope[keep], cells.value[keep], cells.amount[keep])


def unfold(folded: tuple[Folded, ...], start: Int64, probability: Float) -> None:
    """Gives each lone variable its distribution, once those of the states are known.

    Args:
        folded: what was summed out.
        start: shape (n_variables,), where each distribution starts.
        probability: shape (total cardinality,), filled in here.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        for group in folded:
            _unfold(group, start, probability)


def _unfold(group: Folded, start: Int64, probability: Float) -> None:
    """Goes back along one diagram; nan where the distribution of the states is not known."""
    last, chains = group.before[-1], group.literals
    arrived = np.log(probability[start[group.parent, None] + np.arange(last.shape[1])])
    later = np.where(np.isneginf(last), -np.inf, arrived - last)
    for i in reversed(range(group.own.shape[1])):
        rows = group.plan.after[i]
        both = np.where(rows >= 0, later[:, rows], -np.inf) + group.own[:, i, None, :]
        share = np.exp(group.before[i][:, :, None] + both).sum(axis=1)
        later = np.logaddexp(both[:, :, 0], both[:, :, 1])
        for truth in (0, 1):
            value = np.where((truth == 1) == chains.equal[:, i], chains.value[:, i], 1 - chains.value[:, i])
            probability[start[chains.variable[:, i]] + value] = share[:, truth]
