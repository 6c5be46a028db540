"""A network as samplers want it: comes in a network, go out flat arrays in which every factor is a number.

The state of a factor is the sum of what its true atoms add to it: for clauses and counting factors how many literals
are true, for tables the place in the truth table. Its log-weight is looked up by that state, so whatever a factor is,
one atom changes it by one addition and one look-up.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32, Int64, Network
from mlnlite.infer.reduce.components import rows_by_label
from mlnlite.infer.reduce.potentials import check_weights

FORBIDDEN = -1e8
"""Log-weight of a violated hard formula: far below all others, yet finite, so that differences make sense."""


class Factors(NamedTuple):
    """Variables, their atoms, and the factors that these touch, as a tuple, which compiled code takes as it is.

    Attributes:
        atom: shape (n_atoms,), index of each in `Network.atoms`; all below are over the places in here. The atoms of a
            variable stand together.
        first: shape (n_variables + 1,), where the atoms of each variable start.
        none: shape (n_variables,), whether "no atom true" is a value of the variable.
        use: shape (n_atoms + 1,), where the factors of each atom start in `factor` and `step`.
        factor: shape (n_uses,).
        step: shape (n_uses,), what the state of that factor gains where the atom is true.
        scope: shape (n_factors + 1,), where the atoms of each factor start in `member` and `gain`.
        member: shape (n_uses,), the atoms of each factor.
        gain: shape (n_uses,), their steps.
        base: shape (n_factors,), state of each factor if no atom is true.
        row: shape (n_factors,), where the log-weights of each factor's states start in `value`.
        size: shape (n_factors,), how many states it has.
        value: log-weights, `FORBIDDEN` for hard formulas that are violated.
        weight: shape (n_factors,), index of each one's weight in the network.
        counted: shape (n_factors,), whether the state is a sum over true literals, not a place in a table.
        grouped: shape (n_factors,), whether it was a counting factor with equal steps in the network.
    """

    atom: Int64
    first: Int32
    none: Bool
    use: Int64
    factor: Int32
    step: Int32
    scope: Int64
    member: Int32
    gain: Int32
    base: Int32
    row: Int32
    size: Int32
    value: Float
    weight: Int32
    counted: Bool
    grouped: Bool

    @property
    def n_atoms(self) -> int:
        """How many atoms."""
        return len(self.atom)

    @property
    def n_variables(self) -> int:
        """How many variables."""
        return len(self.none)

    @property
    def n_factors(self) -> int:
        """How many factors."""
        return len(self.base)

    @property
    def is_hard(self) -> Bool:
        """Shape (n_factors,): which are hard."""
        return np.asarray(self.lowest <= FORBIDDEN)

    @property
    def lowest(self) -> Float:
        """Shape (n_factors,): the smallest log-weight of each."""
        rows, index = np.unique(self.row, return_inverse=True)
        return np.asarray(np.minimum.reduceat(self.value, rows)[index] if len(rows) else np.zeros(0))


@dataclass(frozen=True, slots=True)
class _Rows:
    """Factors of one kind: atoms (n, k) of the network, steps (n, k), base (n,), worth (n, n_states), weight (n,).

    Also whether their state is a number of true literals, and whether they were counting factors.
    """

    atoms: Int64
    steps: Int32
    base: Int32
    worth: Float
    weight: Int32
    counted: bool = True
    grouped: bool = False

    def pick(self, which: Bool) -> _Rows:
        """Some of the factors."""
        steps, weight = self.steps[which], self.weight[which]
        return _Rows(self.atoms[which], steps, self.base[which], self.worth[which], weight, self.counted, self.grouped)


def factors_of(network: Network, variables: Bool) -> Factors:
    """The factors over some variables.

    Args:
        network: with counting factors, if it is to have them (see `patterns.with_counts`).
        variables: shape (n_variables,), which of them: whole components.

    Raises:
        QueryMistake: a weight is not known.
    """
    check_weights(network)
    atom = np.flatnonzero(variables[network.variable])
    atom = atom[np.argsort(network.variable[atom], kind="stable")]
    owners, n_own = np.unique(network.variable[atom], return_counts=True)
    place = np.full(network.n_atoms, -1, np.int64)
    place[atom] = np.arange(len(atom))
    kinds = [r.pick(np.asarray(place[r.atoms[:, 0]] >= 0)) for r in _kinds(network) if r.atoms.shape[1]]
    kinds = [r for r in kinds if len(r.base)]
    lengths = np.concatenate([np.zeros(0, np.int64), *(np.full(len(r.base), r.atoms.shape[1]) for r in kinds)])
    scope = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    member = _joined([place[r.atoms].ravel() for r in kinds], np.int32)
    gain = _joined([r.steps.ravel() for r in kinds], np.int32)
    order, use = rows_by_label(member, len(atom))
    row, size, value = _values(kinds)
    return Factors(
        atom,
        np.concatenate([[0], np.cumsum(n_own)]).astype(np.int32),
        network.cardinality[owners] > n_own,
        use.astype(np.int64),
        np.repeat(np.arange(len(lengths), dtype=np.int32), lengths)[order],
        gain[order],
        scope,
        member,
        gain,
        _joined([r.base for r in kinds], np.int32),
        row,
        size,
        value,
        _joined([r.weight for r in kinds], np.int32),
        np.concatenate([np.zeros(0, np.bool_), *(np.full(len(r.base), r.counted) for r in kinds)]),
        np.concatenate([np.zeros(0, np.bool_), *(np.full(len(r.base), r.grouped) for r in kinds)]),
    )


def _joined(parts: list[Int32] | list[Int64], kind: type[np.int32]) -> Int32:
    """Arrays one after the other."""
    return np.concatenate([np.zeros(0, kind), *parts]).astype(kind)


def _kinds(network: Network) -> Iterator[_Rows]:
    """All factors with a weight, kind by kind."""
    for c in network.clauses:
        k = c.literals.shape[1]
        true = np.full(k + 1, not c.negated)
        true[0] = c.negated
        yield _rows(network, c.literals, true.astype(np.int64), c.weight, c.count)
    for n in network.counts:
        rows = _rows(network, n.literals, n.true, n.weight, n.count)
        steps = rows.steps * n.steps
        yield replace(rows, steps=steps, base=-np.minimum(steps, 0).sum(axis=1, dtype=np.int32), grouped=n.plain)
    for t in network.tables:
        k = t.atoms.shape[1]
        literals = (t.atoms + 1).astype(np.int32)
        rows = _rows(network, literals, t.truth.ravel().astype(np.int64), t.weight, t.count)
        powers = np.broadcast_to(1 << np.arange(k - 1, -1, -1, dtype=np.int32), rows.steps.shape)
        yield replace(rows, steps=powers.astype(np.int32), counted=False)


def _rows(network: Network, literals: Int32, true: Int64, weight: Int32, count: Int64) -> _Rows:
    """Factors whose state is the number of true literals."""
    log_weight = network.weights[weight]
    keep = log_weight != 0
    hard = np.isposinf(log_weight)[:, None]
    soft = np.where(hard, 0.0, log_weight[:, None]) * true * count[:, None]
    worth = np.where(hard, np.where(true == true.max(initial=0), 0.0, FORBIDDEN), soft)
    steps, base = np.sign(literals), (literals < 0).sum(axis=1)
    atoms = np.abs(literals).astype(np.int64) - 1
    return _Rows(atoms, steps.astype(np.int32), base.astype(np.int32), worth, weight).pick(keep)


def _values(kinds: list[_Rows]) -> tuple[Int32, Int32, Float]:
    """Where each factor's log-weights start, how many they are, and all of them; equal ones once."""
    rows, sizes, values, start = [], [], [np.zeros(0)], 0
    for r in kinds:
        distinct, which = np.unique(r.worth, axis=0, return_inverse=True)
        rows.append((start + which.ravel() * distinct.shape[1]).astype(np.int32))
        sizes.append(np.full(len(which), distinct.shape[1], np.int32))
        values.append(distinct.ravel())
        start += distinct.size
    return _joined(rows, np.int32), _joined(sizes, np.int32), np.concatenate(values)
