"""Counting factors as chains of partial counts: comes in what each count is worth, go out conjunctions or clauses.

A chain reads one literal after the other and keeps of their count only what its worth still depends on (the reduced
decision diagram of the count, Bryant 1986): two states for "at least one", k + 1 at most, never 2^k.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mlnlite.ground.network import Bool, Counts, Float, Int32, Int64, Network
from mlnlite.infer.reduce.conjunctions import Conjunctions


@dataclass(frozen=True, slots=True)
class Diagram:
    """How a chain reads its literals.

    Attributes:
        after: for each literal an array of shape (n_states, 2): the next state if it is false, and if it is true; -1
            where no world is possible. States are numbered from 0 at each level; the chain starts in state 0.
        worth: shape (n_states,), of the states after the last literal.
    """

    after: tuple[Int64, ...]
    worth: Float

    @property
    def n_states(self) -> int:
        """The most states that there are at one place."""
        return max(len(self.worth), *(len(states) for states in self.after))


def diagram(worth: Float, steps: Int32) -> Diagram | None:
    """The smallest chain for a function of a count.

    Args:
        worth: shape (sum of steps + 1,), what each count is worth; minus infinity forbids it.
        steps: shape (m,), what each literal adds to the count if it is true.

    Returns:
        None if no world is possible.
    """
    values, index = np.unique(worth[np.isfinite(worth)], return_inverse=True)
    state = np.full(len(worth), -1)
    state[np.isfinite(worth)] = index
    after: list[Int64] = []
    for step in reversed(steps.tolist()):
        both = np.stack([state[: len(state) - step], state[step:]], axis=1)
        rows, index = np.unique(both, axis=0, return_inverse=True)
        alive = (rows >= 0).any(axis=1)
        state = np.where(alive, np.cumsum(alive) - 1, -1)[index.ravel()]
        after.append(rows[alive])
    return _reachable(after[::-1], values, state[:1]) if state[0] >= 0 else None


def _reachable(after: list[Int64], worth: Float, first: Int64) -> Diagram:
    """The diagram without states that no literals lead to."""
    kept, here = [], first
    for rows in after:
        following = np.unique(rows[here][rows[here] >= 0])
        kept.append(np.where(rows[here] < 0, -1, np.searchsorted(following, rows[here])))
        here = following
    return Diagram(tuple(kept), worth[here])


# --- as conjunctions


@dataclass(frozen=True, slots=True)
class Chains:
    """Chains with the same steps and worth, over different literals `variable = value` or `variable != value`.

    Attributes:
        variable: shape (n, m).
        value: shape (n, m).
        equal: shape (n, m).
        steps: shape (m,), what each literal adds to the count.
        worth: shape (sum of steps + 1,), what each count is worth, minus infinity forbids it.
        scale: shape (n,), what `worth` is multiplied by.
    """

    variable: Int32
    value: Int32
    equal: Bool
    steps: Int32
    worth: Float
    scale: Float

    def true_at(self, world: Int64) -> Bool:
        """Which literals are true; shape (n, m).

        Args:
            world: shape (n_variables,), their values.
        """
        return np.asarray((world[self.variable] == self.value) == self.equal)

    def gains(self, world: Int64) -> Float:
        """What each chain gains in a world; shape (n,)."""
        worth = self.worth[self.true_at(world) @ self.steps]
        return np.where(np.isneginf(worth), worth, self.scale * np.where(np.isneginf(worth), 0.0, worth))

    def scaled(self) -> Iterator[tuple[Int64, Float]]:
        """Rows with equal scale, and what each count is worth to them."""
        for scale in np.unique(self.scale).tolist():
            finite = np.isfinite(self.worth)
            yield (
                np.flatnonzero(self.scale == scale),
                np.where(finite, np.where(finite, self.worth, 0) * scale, -np.inf),
            )

    def pick(self, rows: Int64, order: Int64) -> Chains:
        """Some of the chains, their literals in another order."""
        at = np.ix_(rows, order)
        arrays = self.variable[at], self.value[at], self.equal[at]
        return Chains(*arrays, self.steps[order], self.worth, self.scale[rows])


def chains_of(network: Network) -> list[Chains]:
    """The counting factors of a network that have a weight."""
    found = []
    for counts in network.counts:
        weight = network.weights[counts.weight]
        soft, hard = np.isfinite(weight) & (weight != 0), np.isposinf(weight)
        for rows, worth in ((soft, counts.true.astype(float)), (hard, allowed(counts))):
            atom = np.abs(counts.literals[rows]) - 1
            scale = np.where(hard[rows], 1.0, weight[rows] * counts.count[rows])
            literals = network.variable[atom], network.value[atom], counts.literals[rows] > 0
            found += [Chains(*literals, counts.steps, worth, scale)] if rows.any() else []
    return found


def allowed(counts: Counts) -> Float:
    """What each count is worth to a hard formula: 0, or minus infinity if a grounding is false."""
    return np.where(counts.true == counts.true.max(), 0.0, -np.inf)


def written_out(
    chains: Chains, plan: Diagram, cardinality: Int32, first: int = 0
) -> tuple[list[Conjunctions], Int32, Int32]:
    """Chains as conjunctions over auxiliary variables, which the literals determine.

    Args:
        chains: any.
        plan: their diagram.
        cardinality: shape (n_variables,), of the variables so far.
        first: number of the literal to start from; the states before it stay open.

    Returns:
        Conjunctions, the cardinalities of all variables, the auxiliary ones appended, and these, shape (n, m - 1): the
        state after each literal but the last (-1 for those before `first`).
    """
    n, m = chains.variable.shape
    own = max(first - 1, 0)
    states = np.full((n, m - 1), -1, np.int32)
    states[:, own:] = len(cardinality) + np.arange(n * (m - 1 - own), dtype=np.int32).reshape(n, -1)
    variable = np.concatenate([chains.variable, states], axis=1)
    true_at = np.concatenate([chains.value, states], axis=1)
    positive = np.concatenate([chains.equal, states >= 0], axis=1)
    rows = list(_rows(plan, first))
    found = []
    for k in sorted({len(slots) for slots, *_ in rows}):
        same = [r for r in rows if len(r[0]) == k]
        slots, asked = (np.array([r[c] for r in same], np.int32).reshape(len(same), k) for c in (0, 1))
        equal, amount = np.array([r[2] for r in same], np.bool_).reshape(len(same), k), np.array([r[3] for r in same])
        is_literal = slots < m
        value = np.where(is_literal, true_at[:, slots], asked)
        sign = np.where(is_literal, (asked == 1) == positive[:, slots], equal)
        gain = np.where(np.isneginf(amount), amount, np.where(np.isneginf(amount), 0.0, amount) * chains.scale[:, None])
        shape = n * len(same), k
        at = variable[:, slots].reshape(shape), value.astype(np.int32).reshape(shape), sign.reshape(shape)
        found.append(Conjunctions(*at, gain.ravel()))
    sizes = np.array([len(states) for states in plan.after[own + 1 :]], np.int32)
    return found, np.concatenate([cardinality, np.tile(sizes, n)]), states


_Row = tuple[tuple[int, ...], tuple[int, ...], tuple[bool, ...], float]
"""Slots of a conjunction (the literals of the factor, then the state after each), what it asks of each of them (of a
literal its truth, of a state its number), whether it is to be that or not to be that, and the gain."""


def _rows(plan: Diagram, first: int) -> Iterator[_Row]:
    """What a chain forbids and gains from a literal on; a level with one state only is not asked about."""
    m = len(plan.after)
    for i, before, truth, following in transitions(plan):
        asked = [(m + i - 1, before, True)] if len(plan.after[i]) > 1 else []
        asked += [] if truth is None else [(i, int(truth), True)]
        amount = -np.inf if following < 0 or i < m - 1 else float(plan.worth[following])
        if following >= 0 and i < m - 1:
            if len(plan.after[i + 1]) == 1:
                continue
            asked.append((m + i, following, False))
        slots, values, equal = zip(*asked, strict=True) if asked else ((), (), ())
        if amount != 0.0 and i >= first:
            yield slots, values, equal, amount


def transitions(plan: Diagram) -> Iterator[tuple[int, int, bool | None, int]]:
    """Number of the literal, state before it, its truth (None if that does not matter), state after it or -1."""
    for i, states in enumerate(plan.after):
        for before, (if_false, if_true) in enumerate(states.tolist()):
            if if_false == if_true:
                yield i, before, None, if_false
            else:
                yield i, before, False, if_false
                yield i, before, True, if_true


# --- as clauses


def count_clauses(network: Network, free: int) -> Iterator[tuple[int, list[int]]]:
    """Clauses of the hard counting factors, each with its weight.

    Args:
        network: of the factors.
        free: number of the first variable that no other clause uses.
    """
    hard = np.isposinf(network.weights)
    for counts in network.counts:
        rows = hard[counts.weight]
        plan = diagram(allowed(counts), counts.steps) if rows.any() else None
        for weight, literals in zip(counts.weight[rows].tolist(), counts.literals[rows].tolist(), strict=True):
            if plan is None:
                yield weight, []
                continue
            first = free + np.cumsum([0] + [len(states) for states in plan.after])
            free = int(first[-1])
            for i, before, truth, following in transitions(plan):
                clause = [-int(first[i] + before)] if i else []
                clause += [] if truth is None else [literals[i] if not truth else -literals[i]]
                clause += [int(first[i + 1] + following)] if following >= 0 and i + 1 < len(plan.after) else []
                if following < 0 or i + 1 < len(plan.after):
                    yield weight, clause
