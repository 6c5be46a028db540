"""Compiles a network into log-potentials over variables: comes in a `Network`, goes out a list of cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlnlite.errors import QueryMistake
from mlnlite.ground.network import Bool, Clauses, Float, Int32, Int64, Network, Tables
from mlnlite.infer.reduce.conjunctions import MAX_ARITY, Cells, Conjunctions, cells_of, split_wide
from mlnlite.infer.reduce.counting import Chains, chains_of, diagram, written_out
from mlnlite.infer.reduce.propagate import propagate


@dataclass(frozen=True, slots=True)
class Potentials:
    """The log-weight of a world as a sum of cells.

    Attributes:
        cardinality: shape (n_variables,): the variables of the network, then auxiliary ones that the former determine.
        cells: at most one for each arity, arity rising; what hard formulas force is drawn (see `propagate`).
        constant: log-weight that every world has, the groundings that evidence decides included; minus infinity if no
            world is possible.
        chains: counting factors that are not among the cells.
    """

    cardinality: Int32
    cells: tuple[Cells, ...]
    constant: float
    chains: tuple[Chains, ...] = ()


def potentials_of(
    network: Network,
    extra: Sequence[Conjunctions] = (),
    auxiliary: int = 0,
    max_arity: float = MAX_ARITY,
    *,
    chained: bool = False,
    logical: int = 0,
) -> Potentials:
    """The log-potentials of a network.

    Args:
        network: what was ground.
        extra: further conjunctions, over the variables of the network and `auxiliary` binary ones after them.
        auxiliary: number of those.
        max_arity: longer conjunctions become chains of auxiliary variables.
        chained: leave counting factors as `chains`, do not write them out as cells.
        logical: but write out those that forbid something and need at most so many states: what they force is drawn.

    Raises:
        QueryMistake: a weight is not known.
    """
    check_weights(network)
    rows, constant = [*extra], decided_log_weight(network)
    for clauses in network.clauses:
        add, gain = _clause_rows(network, clauses)
        rows, constant = [*rows, *add], constant + gain
    for tables in network.tables:
        rows += _table_rows(network, tables)
    cardinality = np.concatenate([network.cardinality, np.full(auxiliary, 2, np.int32)])
    chains: list[Chains] = []
    for chain in chains_of(network):
        plan = diagram(chain.worth, chain.steps)
        if plan is None:
            return Potentials(cardinality, (), -np.inf)
        if chained and (plan.n_states > logical or np.isfinite(chain.worth).all()):
            chains.append(chain)
            continue
        add, cardinality, _ = written_out(chain, plan, cardinality)
        rows += add
    narrow: list[Conjunctions] = []
    for row in rows:
        parts, cardinality = split_wide(row, cardinality, max_arity)
        narrow += parts
    cells: list[Cells] = []
    for row in narrow:
        add_cells, gain = cells_of(row, cardinality)
        cells, constant = [*cells, *add_cells], constant + gain
    return Potentials(cardinality, *propagate(cells, cardinality, constant), tuple(chains))


def check_weights(network: Network) -> None:
    """Refuses weights that nobody gave.

    Raises:
        QueryMistake: naming the templates.
    """
    missing = np.unique(network.template[np.isnan(network.weights)])
    if len(missing):
        names = ", ".join(network.model.templates[t].name for t in missing)
        raise QueryMistake(f"no weight is given for {names}", hint="write a weight, or learn the weights first")


def decided_log_weight(network: Network) -> float:
    """Log-weight of the groundings that evidence decides; minus infinity if it makes one of a hard formula false."""
    if len(decided_false(network)):
        return -np.inf
    soft = np.where(np.isposinf(network.weights), 0.0, network.weights)
    return float(np.sum(soft * network.decided_true))


def decided_false(network: Network) -> Int64:
    """Indices of the hard weights of which evidence makes a grounding false."""
    possible = network.decided_true + network.n_open
    return np.flatnonzero(np.isposinf(network.weights) & (possible < network.n_groundings))


def literals_of(network: Network, atoms: Int32, true: Bool, amount: Float) -> Conjunctions:
    """Conjunctions of ground literals.

    Args:
        network: of the atoms.
        atoms: shape (n, k).
        true: shape (n, k), whether each atom has to be true.
        amount: shape (n,).
    """
    return Conjunctions(network.variable[atoms], network.value[atoms], true, amount)


def _clause_rows(network: Network, clauses: Clauses) -> tuple[list[Conjunctions], float]:
    """The cell of each clause in which all its literals are false, and what all other cells have in common."""
    weight = network.weights[clauses.weight] * clauses.count
    atoms, false = np.abs(clauses.literals) - 1, clauses.literals < 0
    soft, hard = np.isfinite(weight) & (weight != 0), np.isposinf(weight)
    if soft.all():
        gain = weight if clauses.negated else -weight
        return [literals_of(network, atoms, false, gain)], 0.0 if clauses.negated else float(weight.sum())
    gain = weight[soft] if clauses.negated else -weight[soft]
    rows = [literals_of(network, atoms[soft], false[soft], gain)]
    if clauses.negated:  # a hard conjunction forbids each of its literals to fail
        units, wrong = atoms[hard].reshape(-1, 1), ~false[hard].reshape(-1, 1)
        rows.append(literals_of(network, units, wrong, np.full(len(units), -np.inf)))
    else:
        rows.append(literals_of(network, atoms[hard], false[hard], np.full(int(hard.sum()), -np.inf)))
    return [r for r in rows if len(r.amount)], 0.0 if clauses.negated else float(weight[soft].sum())


def _table_rows(network: Network, tables: Tables) -> list[Conjunctions]:
    """The true cells of each soft table, the false cells of each hard one."""
    weight = network.weights[tables.weight] * tables.count
    rows = []
    for which, cells, sign in (
        (np.isfinite(weight) & (weight != 0), np.argwhere(tables.truth), 1.0),
        (np.isposinf(weight), np.argwhere(~tables.truth), -1.0),
    ):
        n, m = int(which.sum()), len(cells)
        if n and m:
            atoms = np.repeat(tables.atoms[which], m, axis=0)
            rows.append(literals_of(network, atoms, np.tile(cells == 1, (n, 1)), np.repeat(sign * weight[which], m)))
    return rows
