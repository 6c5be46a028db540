"""Elimination orders and clique trees: in comes who shares a cell with whom, out comes a plan with its cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from itertools import combinations
from math import log2, prod
from typing import Literal

import numpy as np

from mlnlite.ground.network import Int32, Int64
from mlnlite.infer.exact.width import unavoidable_table

Rule = Literal["fill", "weight", "sweep"]
_EXPENSIVE, _MANY = 1 << 21, 2000


@dataclass(frozen=True, slots=True)
class Tree:
    """Cliques in an order in which each comes before its parent. Their variables stand in the order of elimination.

    Attributes:
        scopes: the variables of each clique, those eliminated in it first.
        n_eliminated: how many those are.
        parents: the clique that gets the message of each, -1 for a root.
        position: shape (n_variables,), when each variable is eliminated.
        sizes: number of entries of the table of each clique.
    """

    scopes: tuple[tuple[int, ...], ...]
    n_eliminated: tuple[int, ...]
    parents: tuple[int, ...]
    position: Int64
    sizes: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class TooWide:
    """No order was found within the limit.

    Attributes:
        variables: number of variables of the smallest table that would go past it, or of the largest table if only all
            of them together are too much.
        log2_size: log2 number of entries of that table, or of all.
        in_all: whether it is all tables together.
    """

    variables: int
    log2_size: float
    in_all: bool = False


def _edges(n: int, scopes: Sequence[Int32]) -> tuple[Int64, Int64]:
    """The pairs of `n` variables that share a row of one of the arrays, each once."""
    pairs = [np.zeros(0, np.int64)]
    for scope in scopes:
        pairs += [scope[:, i].astype(np.int64) * n + scope[:, j] for i, j in combinations(range(scope.shape[1]), 2)]
    start, end = np.divmod(np.unique(np.concatenate(pairs)), n)
    return start, end


def _neighbours(n: int, edges: tuple[Int64, Int64]) -> list[set[int]]:
    """The neighbours of each variable."""
    adjacent: list[set[int]] = [set() for _ in range(n)]
    for u, v in zip(edges[0].tolist(), edges[1].tolist(), strict=True):
        adjacent[u].add(v)
        adjacent[v].add(u)
    return adjacent


def _sweep(n: int, edges: tuple[Int64, Int64]) -> list[int]:
    """Place of each variable in a sweep from one end of the graph to the other (Cuthill and McKee 1969)."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    graph = csr_matrix((np.ones(len(edges[0]), np.int8), edges), shape=(n, n))
    place = np.empty(n, np.int64)
    place[reverse_cuthill_mckee(graph + graph.T, symmetric_mode=True)] = np.arange(n)
    return place.tolist()


def plan(cardinality: Int32, scopes: Sequence[Int32], limit: int, total: int | None = None) -> Tree | TooWide:
    """A clique tree by greedy elimination: fewest fill edges first; none if one of many variables is proven too wide.

    Where that is expensive, the cheapest of it, a sweep from one end of the graph to the other (which is best for
    long grids, such as anything that repeats in time), and smallest table first.

    Args:
        cardinality: shape (n,).
        scopes: arrays of shape (m, k), variables of the cells.
        limit: largest number of entries of a table.
        total: largest number of entries of all tables together.
    """
    bits = np.log2(np.maximum(cardinality, 2)).tolist()
    n, edges = len(cardinality), _edges(len(cardinality), scopes)
    needed = unavoidable_table(_neighbours(n, edges), list(bits), log2(limit) + 1e-9) if n > _MANY else None
    if needed is not None:
        return TooWide(*needed)
    rules: tuple[Rule, ...] = ("fill", "sweep", "weight")
    trees, failed = [], []
    for rule in rules:
        place = _sweep(n, edges) if rule == "sweep" else []
        order = _greedy(_graph(_neighbours(n, edges), bits, log2(limit) + 1e-9, rule, place))
        if isinstance(order, TooWide):
            failed.append(order)
        else:
            trees.append(_tree(order, cardinality))
        if trees and sum(trees[-1].sizes) <= _EXPENSIVE:
            break
    if not trees:
        return min(failed, key=lambda f: f.log2_size)
    best = min(trees, key=lambda t: sum(t.sizes))
    if total is not None and sum(best.sizes) > total:
        return TooWide(max(map(len, best.scopes)), log2(sum(best.sizes)), in_all=True)
    return best


@dataclass(slots=True)
class _Graph:
    """What is left of a graph while its variables are eliminated.

    Attributes:
        adjacent: the neighbours of each variable.
        bits: log2 cardinality of each variable.
        limit: log2 size of the largest table that may be made; variables whose table would pass it wait.
        rule: what the choice goes by.
        place: of each variable in the sweep.
        weight: for each variable the log2 size of the table that eliminating it makes.
        missing: for each variable how many edges its neighbours miss (followed for "fill" only).
    """

    adjacent: list[set[int]]
    bits: list[float]
    limit: float
    rule: Rule
    place: list[int]
    weight: list[float]
    missing: list[int]


def _graph(adjacent: list[set[int]], bits: list[float], limit: float, rule: Rule, place: list[int]) -> _Graph:
    """The graph before anything is eliminated."""
    weight = [bits[v] + sum(bits[u] for u in near) for v, near in enumerate(adjacent)]
    missing = [len(near) * (len(near) - 1) // 2 for near in adjacent]
    if rule == "fill":
        for v, near in enumerate(adjacent):
            missing[v] -= sum(len(near & adjacent[u]) for u in near) // 2
    return _Graph(adjacent, bits, limit, rule, place, weight, missing)


def _key(graph: _Graph, v: int) -> tuple[float, float, int]:
    """What decides: fewest missing edges, then smallest table; or the place in the sweep; or the table alone."""
    if graph.rule == "sweep":
        return graph.place[v], 0.0, v
    return (graph.missing[v], graph.weight[v], v) if graph.rule == "fill" else (graph.weight[v], 0.0, v)


def _greedy(graph: _Graph) -> list[tuple[int, set[int]]] | TooWide:
    """Variables in order of elimination, each with its neighbours at that time."""
    left = set(range(len(graph.adjacent)))
    heap = [_key(graph, v) for v in left if graph.weight[v] <= graph.limit]
    heapify(heap)
    order: list[tuple[int, set[int]]] = []
    while heap:
        entry = heappop(heap)
        v = entry[2]
        if v in left and graph.weight[v] <= graph.limit and _key(graph, v) == entry:
            left.remove(v)
            order.append((v, graph.adjacent[v]))
            for u in _eliminate(graph, v):
                if graph.weight[u] <= graph.limit:
                    heappush(heap, _key(graph, u))
    if not left:
        return order
    size, smallest = min((graph.weight[v], v) for v in left)
    return TooWide(len(graph.adjacent[smallest]) + 1, size)


def _eliminate(graph: _Graph, v: int) -> set[int]:
    """Joins the neighbours of `v` and takes it out; returns the variables whose key this may have changed."""
    near = graph.adjacent[v]
    changed = set(near)
    for u in near:
        own = graph.adjacent[u]
        own.remove(v)
        graph.weight[u] -= graph.bits[v]
        if graph.rule == "fill":
            graph.missing[u] -= len(own) - len(own & near)
    for a in sorted(near):
        for b in sorted(near - graph.adjacent[a]):
            if b != a:
                changed |= _link(graph, a, b)
    return changed


def _link(graph: _Graph, a: int, b: int) -> set[int]:
    """Adds an edge; returns the variables that now miss one edge less."""
    ours, theirs = graph.adjacent[a], graph.adjacent[b]
    common = ours & theirs if graph.rule == "fill" else set()
    graph.missing[a] += len(ours) - len(common)
    graph.missing[b] += len(theirs) - len(common)
    for c in common:
        graph.missing[c] -= 1
    graph.weight[a] += graph.bits[b]
    graph.weight[b] += graph.bits[a]
    ours.add(b)
    theirs.add(a)
    return common


def _tree(order: list[tuple[int, set[int]]], cardinality: Int32) -> Tree:
    """Cliques from an order."""
    position = np.empty(len(order), np.int64)
    position[[v for v, _ in order]] = np.arange(len(order))
    rank = position.tolist()
    near = {v: sorted(others, key=rank.__getitem__) for v, others in order}
    eliminated = sorted(_absorb([v for v, _ in order], near), key=lambda vs: rank[vs[-1]])
    clique = {v: k for k, vs in enumerate(eliminated) for v in vs}
    scopes = tuple((*vs, *near[vs[-1]]) for vs in eliminated)
    parents = tuple(clique[near[vs[-1]][0]] if near[vs[-1]] else -1 for vs in eliminated)
    sizes = tuple(prod(cardinality[list(s)].tolist()) for s in scopes)
    return Tree(scopes, tuple(map(len, eliminated)), parents, position, sizes)


def _absorb(order: list[int], near: dict[int, list[int]]) -> list[list[int]]:
    """Chains of variables that are eliminated from one table: each one's table contains all of the next one's."""
    chain: dict[int, list[int]] = {}
    chains = []
    for v in order:
        if v not in chain:
            chain[v] = [v]
            chains.append(chain[v])
        following = near[v][0] if near[v] else v
        if following not in chain and len(near[following]) == len(near[v]) - 1:
            chain[v].append(following)
            chain[following] = chain[v]
    return chains
