"""Complete patterns to counting factors, and counting factors to tables. Network in, network out, one distribution.

A group of k atoms of which all pairs stand in a clause loses its k (k - 1) / 2 clauses of two literals.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.errors import Diagnostic, LimitReached
from mlnlite.ground.network import Clauses, Counts, Network, Tables
from mlnlite.ground.residual import WIDEST_TABLE

Bool = NDArray[np.bool_]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]

SMALLEST = 3
"""Members of the smallest group that becomes a counting factor."""


def with_counts(network: Network) -> Network:
    """The network with counting factors for complete pairwise patterns.

    A pattern is a set of literals of which every pair stands in a clause, all with the same weight, count and kind.
    """
    clauses: list[Clauses] = []
    counts: list[Counts] = list(network.counts)
    for block in network.clauses:
        if block.literals.shape[1] != 2:
            clauses.append(block)
            continue
        rest, found = _split(block)
        counts += found
        if len(rest.literals):
            clauses.append(rest)
    return replace(network, clauses=tuple(clauses), counts=tuple(counts))


def _split(block: Clauses) -> tuple[Clauses, list[Counts]]:
    """The clauses that are in no complete pattern, and the patterns."""
    kind = np.unique(np.column_stack([block.weight, block.count]), axis=0, return_inverse=True)[1].reshape(-1)
    node, literal = _nodes(block.literals, kind)
    n_nodes = len(literal)
    graph = sparse.csr_array((np.ones(len(node), np.int8), (node[:, 0], node[:, 1])), shape=(n_nodes, n_nodes))
    _, group = sparse.csgraph.connected_components(graph, directed=False)
    size = np.bincount(group)
    edges = np.bincount(group[node[:, 0]], minlength=len(size))
    complete = (edges == size * (size - 1) // 2) & (size >= SMALLEST)
    complete &= _distinct_atoms(literal, group, len(size))
    inside = complete[group[node[:, 0]]]
    rest = Clauses(block.literals[~inside], block.weight[~inside], block.count[~inside], block.negated)
    found = []
    first = np.zeros(len(size), np.int64)
    first[group[node[::-1, 0]]] = np.arange(len(node))[::-1]
    for m in np.unique(size[complete]).tolist():
        chosen = np.flatnonzero(complete & (size == m))
        members = np.flatnonzero(np.isin(group, chosen))
        order = np.lexsort((np.abs(literal[members]), group[members]))
        rows = literal[members][order].reshape(len(chosen), m)
        edge = first[chosen]
        true = _pairs(m, negated=block.negated)
        found.append(Counts(rows, true, block.weight[edge], block.count[edge], np.ones(m, np.int32)))
    return rest, found


def _nodes(literals: Int32, kind: Int64) -> tuple[Int64, Int32]:
    """A node for each literal of each kind of clause: node of each place, shape (n, 2), and literal of each node."""
    low = int(literals.min(initial=0))
    span = int(literals.max(initial=0)) - low + 1
    key = kind[:, None].astype(np.int64) * span + (literals - low)
    names, node = np.unique(key, return_inverse=True)
    return node.reshape(literals.shape), (names % span + low).astype(np.int32)


def _distinct_atoms(literal: Int32, group: NDArray[np.int32], n_groups: int) -> NDArray[np.bool_]:
    """Groups in which no atom stands with both signs."""
    names = np.unique(np.column_stack([group, np.abs(literal)]), axis=0)
    n_atoms = np.bincount(names[:, 0], minlength=n_groups)
    return np.asarray(n_atoms == np.bincount(group, minlength=n_groups))


def _pairs(m: int, *, negated: bool) -> Int64:
    """Number of true groundings of all pairs of m literals where j of these are true, shape (m + 1,).

    A clause is true where one of its two literals is, a negated one where both are false.
    """
    j = np.arange(m + 1, dtype=np.int64)
    both_false = (m - j) * (m - j - 1) // 2
    return both_false if negated else m * (m - 1) // 2 - both_false


def without_counts(network: Network) -> Network:
    """The network with truth tables in place of counting factors, for what does not take these.

    Raises:
        LimitReached: if such a factor has more than `WIDEST_TABLE` atoms.
    """
    tables = list(network.tables)
    for block in network.counts:
        m = block.literals.shape[1]
        if m > WIDEST_TABLE:
            template = network.model.templates[network.template[block.weight[0]]]
            message = f"{template.name} counts over {m} unknown atoms, and here at most {WIDEST_TABLE} are possible"
            hint = "give more evidence, or choose a method that takes counts"
            raise LimitReached([Diagnostic("E413", message, template.span, hint)])
        for signs in np.unique(block.literals > 0, axis=0):
            tables += _as_tables(block, signs, ((block.literals > 0) == signs).all(axis=1))
    return replace(network, tables=tuple(tables), counts=())


def _as_tables(block: Counts, signs: Bool, chosen: Bool) -> Iterator[Tables]:
    """Factors with the same signs as tables: one for each number of true groundings, counted so often more."""
    digits = np.indices((2,) * len(signs))
    state = np.tensordot(block.steps, np.where(signs.reshape(-1, *([1] * len(signs))), digits, 1 - digits), 1)
    true = block.true[state]
    for least in range(1, int(block.true.max(initial=0)) + 1):
        yield Tables(np.abs(block.literals[chosen]) - 1, true >= least, block.weight[chosen], block.count[chosen])
