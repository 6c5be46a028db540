"""New evidence on the open atoms of a network, without grounding again. Network and truth values in, network out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Contradiction, Diagnostic
from mlnlite.ground.merge import merged_clauses
from mlnlite.ground.network import Clauses, Counts, Network, Tables
from mlnlite.ground.residual import ClauseShape, CountShape, Decided, TableShape, table_shape
from mlnlite.ground.states import NONE, counts_of, reduced
from mlnlite.model.change import UNKNOWN, with_status
from mlnlite.model.evidence import Evidence

Int8 = NDArray[np.int8]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Bool = NDArray[np.bool_]


def condition(network: Network, known: Int8) -> Network:
    """The network with some of its atoms known.

    The distribution over the other atoms is the conditional one, and log-weights of worlds stay what they were.

    Args:
        network: what was ground.
        known: shape (n_atoms,): 0 false, 1 true, -1 unknown.

    Raises:
        Contradiction: if a block would have two values, or one that must have a value none.
    """
    known = _with_blocks(network, known)
    decided = network.decided_true.copy()
    place = np.cumsum(known == UNKNOWN, dtype=np.int32) - 1
    state = _State(known, place, decided)
    factors: list[Factor] = []
    for block in network.clauses:
        factors += _clauses(block, state)
    for table_block in network.tables:
        factors += _tables(table_block, state)
    for count_block in network.counts:
        factors += _counts(count_block, state)
    left = known == UNKNOWN
    variable, value, cardinality, is_block = _variables(network, left, known)
    return replace(
        network,
        evidence=with_facts(network, known),
        atoms=network.atoms[left],
        variable=variable,
        value=value,
        cardinality=cardinality,
        block=is_block,
        clauses=_gathered([f for f in factors if isinstance(f, Clauses)]),
        tables=tuple(f for f in factors if isinstance(f, Tables)),
        counts=tuple(f for f in factors if isinstance(f, Counts)),
        decided_true=decided,
    )


@dataclass(frozen=True, slots=True)
class _State:
    """`known` of the old atoms, `place` of the open ones in the new network, and the counts of decided groundings."""

    known: Int8
    place: Int32
    decided: Int64

    def decide(self, weight: Int32, count: Int64) -> None:
        """Notes groundings that have become true."""
        np.add.at(self.decided, weight, count)


# --- blocks and variables


def _with_blocks(network: Network, known: Int8) -> Int8:
    """What follows for the other atoms of a block."""
    known = known.copy()
    if not network.block.any():
        return known
    in_block = network.block[network.variable]
    n_true = np.bincount(network.variable[in_block & (known == 1)], minlength=network.n_variables)
    known[in_block & (n_true[network.variable] > 0) & (known == UNKNOWN)] = 0
    n_open = np.bincount(network.variable[in_block & (known == UNKNOWN)], minlength=network.n_variables)
    must = network.block & ~_may_be_none(network) & (n_true == 0)
    if (n_true[network.block] > 1).any() or (must & (n_open == 0)).any():
        wrong = np.flatnonzero((network.block & (n_true > 1)) | (must & (n_open == 0)))[0]
        name, _ = network.evidence.atom_at(int(network.atoms[np.flatnonzero(network.variable == wrong)[0]]))
        predicate = network.evidence.predicates[name]
        found = "two true values" if n_true[wrong] > 1 else "no value left"
        raise Contradiction([Diagnostic("E401", f"a block of {predicate} has {found}", predicate.span)])
    known[in_block & (must & (n_open == 1))[network.variable] & (known == UNKNOWN)] = 1
    return known


def _may_be_none(network: Network) -> Bool:
    n_atoms = np.bincount(network.variable, minlength=network.n_variables)
    return network.block & (network.cardinality > n_atoms)


def _variables(network: Network, left: Bool, known: Int8) -> tuple[Int32, Int32, Int32, Bool]:
    kept = np.zeros(network.n_variables, np.bool_)
    kept[network.variable[left]] = True
    number = np.cumsum(kept, dtype=np.int32) - 1
    old = network.variable[left]
    variable = number[old]
    order = np.lexsort((network.value[left], variable))
    start = np.searchsorted(variable[order], np.arange(int(kept.sum())))
    within = np.empty(len(variable), np.int64)
    within[order] = np.arange(len(variable)) - start[variable[order]]
    none = _may_be_none(network)
    n_left = np.bincount(old, minlength=network.n_variables)
    cardinality = np.where(network.block, n_left + none, 2)
    value = np.where(network.block[old], within + none[old], 1)
    return variable, value.astype(np.int32), cardinality[kept].astype(np.int32), network.block[kept]


def with_facts(network: Network, known: Int8) -> Evidence:
    """The evidence with the atoms that have become known."""
    index = np.flatnonzero(known != UNKNOWN)
    return with_status(network.evidence, network.atoms[index], known[index])


# --- factors

Factor: TypeAlias = Clauses | Tables | Counts


def _clauses(block: Clauses, state: _State) -> list[Factor]:
    atom = np.abs(block.literals) - 1
    value = state.known[atom]
    is_open = value == UNKNOWN
    satisfied = (~is_open & ((value == 1) == (block.literals > 0))).any(axis=1)
    n_open = is_open.sum(axis=1)
    now_true = satisfied != block.negated if not block.negated else ~satisfied & (n_open == 0)
    state.decide(block.weight[now_true], block.count[now_true])
    found: list[Factor] = []
    for n in np.unique(n_open[~satisfied & (n_open > 0)]).tolist():
        rows = np.flatnonzero(~satisfied & (n_open == n))
        columns = np.argsort(~is_open[rows], axis=1, kind="stable")[:, :n]
        literals = np.take_along_axis(block.literals[rows], columns, 1)
        moved = (state.place[np.abs(literals) - 1] + 1) * np.sign(literals)
        found.append(Clauses(moved.astype(np.int32), block.weight[rows], block.count[rows], block.negated))
    return found


def _tables(block: Tables, state: _State) -> list[Factor]:
    value = state.known[block.atoms]
    code = (value.astype(np.int64) + 1) @ (3 ** np.arange(value.shape[1], dtype=np.int64))
    found: list[Factor] = []
    for pattern in np.unique(code).tolist():
        rows = np.flatnonzero(code == pattern)
        index = tuple(slice(None) if v == UNKNOWN else int(v) for v in value[rows[0]].tolist())
        open_columns = tuple(np.flatnonzero(value[rows[0]] == UNKNOWN).tolist())
        shape = table_shape(open_columns, np.asarray(block.truth[index]))
        weight, count = block.weight[rows], block.count[rows]
        if not isinstance(shape, Decided):
            found.append(_factor(shape, state.place[block.atoms[rows][:, list(shape.atoms)]], weight, count))
        elif shape.truth:
            state.decide(weight, count)
    return found


def _counts(block: Counts, state: _State) -> list[Factor]:
    atom, positive = np.abs(block.literals) - 1, block.literals > 0
    value = state.known[atom]
    is_open = value == UNKNOWN
    holds_if_false = np.where(is_open, ~positive, (value == 1) == positive)
    offset = holds_if_false @ block.steps.astype(np.int64)
    steps = np.where(positive, block.steps, -block.steps).astype(np.int64)
    atoms = np.where(is_open, state.place[atom], NONE).astype(np.int64)
    found: list[Factor] = []
    for part in reduced(atoms, steps, offset, block.true):
        weight, count = block.weight[part.index], block.count[part.index]
        state.decide(weight, count * part.certain)
        if not isinstance(part.shape, Decided):
            found.append(_factor(part.shape, np.stack(part.atoms, axis=1), weight, count))
    return found


def _factor(shape: ClauseShape | TableShape | CountShape, atoms: Int32 | Int64, weight: Int32, count: Int64) -> Factor:
    """Factors of one shape over the columns of `atoms`, in the order of the shape's atoms."""
    rows = atoms.astype(np.int32)
    if isinstance(shape, ClauseShape):
        literals = ((rows + 1) * np.where(shape.signs, 1, -1)).astype(np.int32)
        order = np.argsort(np.abs(literals), axis=1)
        return Clauses(np.take_along_axis(literals, order, 1), weight, count, shape.negated)
    return (
        Tables(rows, shape.truth, weight, count)
        if isinstance(shape, TableShape)
        else counts_of(shape, rows, weight, count)
    )


def _gathered(blocks: Sequence[Clauses]) -> tuple[Clauses, ...]:
    """One block for each length and sign, equal rows merged."""
    by_kind: dict[tuple[int, bool], list[Clauses]] = {}
    for block in blocks:
        by_kind.setdefault((block.literals.shape[1], block.negated), []).append(block)
    gathered = []
    for (_, negated), members in sorted(by_kind.items()):
        columns = np.concatenate([m.literals for m in members])
        weight, count = (np.concatenate([getattr(m, name) for m in members]) for name in ("weight", "count"))
        gathered.append(Clauses(*merged_clauses(list(columns.T), weight, count), negated))
    return tuple(gathered)
