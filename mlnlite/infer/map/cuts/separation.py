"""Rows that a fractional solution of a linear program violates: comes in values of columns, go out clauses and stars.

A lazy template is asked, as a query, which of its groundings are not fulfilled. Clauses of three literals that allow
two things together only with an excuse, `a and b => e`, also make stars: of a set of things of which every two need an
excuse, `sum of things - sum of excuses <= 1` holds in every world, and cuts off what single clauses leave. (For
transitivity these are 2-partition inequalities, Groetschel and Wakabayashi, Mathematical Programming 1989.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mlnlite.engines.plan import Engine
from mlnlite.ground.lazy import violations, world_evidence
from mlnlite.ground.network import Float, Int32, Int64
from mlnlite.infer.map.cuts.waiting import Lazy, literals_of_piece

_POSSIBLE = 1e-3
_LEAST, _LARGEST = 1e-3, 16


@dataclass(frozen=True, slots=True)
class Reading:
    """How the truth of atoms is read off the columns of a program; both of shape (n_atoms,).

    Attributes:
        column: of each atom.
        sign: 1 if the atom is true where the column is 1, -1 if where it is 0.
    """

    column: Int64
    sign: Float

    def truth(self, x: Float) -> Float:
        """Between 0 and 1 for each atom."""
        return truths(self.column, self.sign, x)


def truths(column: Int64, sign: Float, x: Float) -> Float:
    """How true literals are: `x` of their columns, or `1 - x`, 0 where the sign is 0; any shape."""
    return np.asarray(np.where(sign > 0, x[column], np.where(sign < 0, 1 - x[column], 0.0)))


@dataclass(frozen=True, slots=True)
class GroundClauses:
    """Ground clauses of lazy templates as literals over columns, equal ones once.

    Attributes:
        literals: shape (n, k), over atoms of the network, 0 for none.
        weight: shape (n,), index of the weight.
        count: shape (n,), how many groundings.
        column: shape (n, k).
        sign: shape (n, k), 0 where there is no literal.
    """

    literals: Int32
    weight: Int32
    count: Int64
    column: Int64
    sign: Float

    def __len__(self) -> int:
        """How many."""
        return len(self.weight)

    def pick(self, rows: Int64) -> GroundClauses:
        """Some of them."""
        return GroundClauses(
            self.literals[rows], self.weight[rows], self.count[rows], self.column[rows], self.sign[rows]
        )


@dataclass(frozen=True, slots=True)
class Stars:
    """Sets of literals of which at most one holds without an excuse.

    Attributes:
        column: shape (n, m), of each literal.
        sign: shape (n, m), 0 beyond the end.
        clause: shape (n, m (m - 1) / 2), which clauses say so, -1 beyond the end.
        excuse: shape (n_clauses,), place of the excuse among the literals of each clause.
        above: shape (n,), by how much the inequality is violated.
    """

    column: Int64
    sign: Float
    clause: Int64
    excuse: Int64
    above: Float

    def pick(self, rows: Int64) -> Stars:
        """Some of them."""
        return Stars(self.column[rows], self.sign[rows], self.clause[rows], self.excuse, self.above[rows])


def near_violations(lazy: Lazy, reading: Reading, x: Float, engine: Engine | None = None) -> GroundClauses:
    """The groundings of lazy templates that have no literal that is true for certain.

    Args:
        lazy: the network and its lazy templates.
        reading: of its atoms.
        x: shape (n_columns,), a fractional solution.
        engine: what runs the query.
    """
    truth = reading.truth(x)
    possible, certain = (world_evidence(lazy.network, truth > level) for level in (_POSSIBLE, 1 - _POSSIBLE))
    found = [
        literals_of_piece(lazy.network, template, piece)
        for template in lazy.templates
        for piece in violations(lazy.network, possible, template, certain=certain, engine=engine)
    ]
    width = max((f[0].shape[1] for f in found), default=1)
    literals = [np.pad(f[0], ((0, 0), (0, width - f[0].shape[1]))) for f in found]
    return _over_columns(
        reading,
        len(x),
        np.concatenate([np.zeros((0, width), np.int32), *literals]),
        np.concatenate([np.zeros(0, np.int32), *(f[1] for f in found)]),
        np.concatenate([np.zeros(0, np.int64), *(f[2] for f in found)]),
    )


def _over_columns(reading: Reading, n: int, literals: Int32, weight: Int32, count: Int64) -> GroundClauses:
    """The clauses over columns: no literal twice, none that always hold, equal ones once."""
    atom = np.maximum(np.abs(literals) - 1, 0)
    column = np.where(literals != 0, reading.column[atom], n)
    sign = np.sign(literals) * reading.sign[atom]
    order = np.argsort(column, axis=1, kind="stable")
    column, sign, literals = (np.take_along_axis(a, order, 1) for a in (column, sign, literals))
    again = (column[:, 1:] == column[:, :-1]) & (column[:, 1:] < n)
    always = (again & (sign[:, 1:] != sign[:, :-1])).any(axis=1)
    sign[:, 1:][again] = 0.0
    code = weight.astype(np.int64)
    for c, s in zip(column.T, sign.T, strict=True):
        code = np.unique(code * (3 * n + 3) + 3 * c + s.astype(np.int64) + 1, return_inverse=True)[1]
    _, first, code = np.unique(code, return_index=True, return_inverse=True)
    total = np.bincount(code, count, len(first)).astype(np.int64)
    column[column == n] = 0
    keep = ~always[first]
    return GroundClauses(
        literals[first][keep], weight[first][keep], total[keep], column[first][keep], sign[first][keep]
    )


def lack(clauses: GroundClauses, x: Float) -> Float:
    """By how much a solution violates each clause; shape (n,)."""
    return np.asarray(1 - truths(clauses.column, clauses.sign, x).sum(axis=1))


@dataclass(frozen=True, slots=True)
class Graph:
    """Which literals need an excuse to hold together: literals, and clauses between them.

    Attributes:
        column: shape (n,), of each literal.
        sign: shape (n,), of each literal.
        begin: shape (n + 1,), where the neighbours of each literal start.
        other: shape (m,), the neighbour.
        clause: shape (m,), the clause that asks for an excuse.
        excuse: shape (n_clauses,), place of the excuse among the literals of each clause.
    """

    column: Int64
    sign: Float
    begin: Int64
    other: Int64
    clause: Int64
    excuse: Int64


def graph_of(clauses: GroundClauses, x: Float, paid: Float) -> Graph:
    """The graph of those clauses of three literals of which two need the third as an excuse.

    Args:
        clauses: any.
        x: shape (n_columns,), a fractional solution; of clauses over the same two literals that one is taken of which
            the excuse is least true
        paid: shape (n_clauses,), and which is least paid for.
    """
    whole = (np.abs(clauses.sign).sum(axis=1) == 3) & (np.abs(clauses.sign.sum(axis=1)) == 1)
    rows = np.flatnonzero(whole)
    odd = clauses.sign == -clauses.sign.sum(axis=1, keepdims=True)
    excuse = np.where(whole, odd.argmax(axis=1), 0)
    value = _held(clauses, excuse, x) + paid
    others = np.argsort(odd[rows] | (clauses.sign[rows] == 0), axis=1, kind="stable")[:, :2]
    ends = [np.take_along_axis(a[rows], others, 1) for a in (clauses.column, clauses.sign)]
    names, node = np.unique(2 * ends[0] + (ends[1] < 0), return_inverse=True)
    node = node.reshape(-1, 2)
    edge = np.tile(np.arange(len(node)), 2)
    start, end = np.concatenate([node[:, 0], node[:, 1]]), np.concatenate([node[:, 1], node[:, 0]])
    order = np.lexsort((value[rows][edge], end, start))
    start, end, edge = start[order], end[order], edge[order]
    first = np.ones(len(order), np.bool_)
    first[1:] = (start[1:] != start[:-1]) | (end[1:] != end[:-1])
    begin = np.searchsorted(start[first], np.arange(len(names) + 1))
    # a thing holds where its literal in the clauses does not
    column = np.asarray(names // 2, np.int64)
    return Graph(column, np.where(names % 2 == 1, 1.0, -1.0), begin, end[first], rows[edge[first]], excuse)


def excuses(clauses: GroundClauses, graph: Graph, x: Float) -> Float:
    """How true the excuse of each clause is."""
    return _held(clauses, graph.excuse, x)


def _held(clauses: GroundClauses, place: Int64, x: Float) -> Float:
    """How true the literal at some place of each clause is."""
    at = (np.arange(len(clauses)), place)
    return truths(clauses.column[at], clauses.sign[at], x)


def stars(graph: Graph, excuse: Float, x: Float, least: float = _LEAST) -> Stars:
    """Violated stars, each found once.

    Args:
        graph: of clauses.
        excuse: shape (n_clauses,), how true their excuses are, or how far they count as paid for.
        x: shape (n_columns,), a fractional solution.
        least: by how much violated.
    """
    from mlnlite.infer.map.cuts.star_kernel import grow

    holds = truths(graph.column, graph.sign, x)
    members, clause, above = grow(graph.begin, graph.other, excuse[graph.clause], graph.clause, holds, _LEAST, _LARGEST)
    found = np.flatnonzero(above > least)
    _, once = np.unique(np.sort(members[found], axis=1), axis=0, return_index=True)
    found = found[once]
    inside, at = members[found] >= 0, np.maximum(members[found], 0)
    column = np.where(inside, graph.column[at], 0)
    return Stars(column, np.where(inside, graph.sign[at], 0.0), clause[found], graph.excuse, above[found])
