"""Elimination orders and clique trees: in comes who shares a cell with whom, out comes a plan with its cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from itertools import combinations
from math import prod
from typing import Literal

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from mlnlite.ground.network import Int32, Int64

Rule = Literal["fill", "weight", "sweep"]
_EXPENSIVE = 1 << 18


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
        variables: number of variables of the smallest table that would go past it.
        log2_size: its log2 number of entries.
    """

    variables: int
    log2_size: float


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
    graph = csr_matrix((np.ones(len(edges[0]), np.int8), edges), shape=(n, n))
    place = np.empty(n, np.int64)
    place[reverse_cuthill_mckee(graph + graph.T, symmetric_mode=True)] = np.arange(n)
    return place.tolist()


def plan(cardinality: Int32, scopes: Sequence[Int32], limit: int) -> Tree | TooWide:
    """A clique tree by greedy elimination: fewest fill edges first.

    Where that is expensive, the cheapest of it, a sweep from one end of the graph to the other (which is best for
    long grids, such as anything that repeats in time), and smallest table first.

    Args:
        cardinality: shape (n,).
        scopes: arrays of shape (m, k), variables of the cells.
        limit: largest number of entries of a table.
    """
    bits = np.log2(np.maximum(cardinality, 2)).tolist()
    n, edges = len(cardinality), _edges(len(cardinality), scopes)
    rules: tuple[Rule, ...] = ("fill", "sweep", "weight")
    trees, failed = [], []
    for rule in rules:
        place = _sweep(n, edges) if rule == "sweep" else []
        order = _greedy(_Graph(_neighbours(n, edges), bits, float(np.log2(limit)) + 1e-9, rule, place, {}))
        if isinstance(order, TooWide):
            failed.append(order)
        else:
            trees.append(_tree(order, cardinality))
        if trees and sum(trees[-1].sizes) <= _EXPENSIVE:
            break
    return min(trees, key=lambda t: sum(t.sizes)) if trees else min(failed, key=lambda f: f.log2_size)


@dataclass(slots=True)
class _Graph:
    """What is left of a graph while its variables are eliminated.

    Attributes:
        adjacent: the neighbours of each variable.
        bits: log2 cardinality of each variable.
        limit: log2 size of the largest table that may be made.
        rule: what the choice goes by.
        place: of each variable in the sweep.
        missing: for each variable whose table is within the limit, the edges missing between its neighbours.
    """

    adjacent: list[set[int]]
    bits: list[float]
    limit: float
    rule: Rule
    place: list[int]
    missing: dict[int, int]


def _weight(graph: _Graph, v: int) -> float:
    """Log2 size of the table that eliminating `v` makes."""
    return graph.bits[v] + sum(graph.bits[u] for u in graph.adjacent[v])


def _measure(graph: _Graph, v: int) -> None:
    """Counts the missing edges between neighbours of `v`, if it may be eliminated at all."""
    graph.missing.pop(v, None)
    if _weight(graph, v) <= graph.limit:
        near = graph.adjacent[v]
        present = sum(len(near & graph.adjacent[u]) for u in near) if graph.rule == "fill" else 0
        graph.missing[v] = (len(near) * (len(near) - 1) - present) // 2


def _key(graph: _Graph, v: int) -> tuple[float, float, int]:
    """What decides: fewest missing edges, then smallest table; or the place in the sweep; or the table alone."""
    weight = _weight(graph, v)
    if graph.rule == "sweep":
        return graph.place[v], 0.0, v
    return (graph.missing[v], weight, v) if graph.rule == "fill" else (weight, 0.0, v)


def _greedy(graph: _Graph) -> list[tuple[int, set[int]]] | TooWide:
    """Variables in order of elimination, each with its neighbours at that time."""
    for v in range(len(graph.adjacent)):
        _measure(graph, v)
    heap = [_key(graph, v) for v in graph.missing]
    heapify(heap)
    order: list[tuple[int, set[int]]] = []
    while heap:
        entry = heappop(heap)
        v = entry[2]
        if v in graph.missing and _key(graph, v) == entry:
            order.append((v, graph.adjacent[v]))
            for u in _eliminate(graph, v):
                heappush(heap, _key(graph, u))
    left = set(range(len(graph.adjacent))).difference(v for v, _ in order)
    if not left:
        return order
    size, smallest = min((_weight(graph, v), v) for v in left)
    return TooWide(len(graph.adjacent[smallest]) + 1, size)


def _eliminate(graph: _Graph, v: int) -> set[int]:
    """Joins the neighbours of `v` and takes it out; returns the candidates whose key this may have changed."""
    near = graph.adjacent[v]
    changed = set(near)
    if graph.missing.pop(v) and graph.rule == "fill":
        for a, b in combinations(sorted(near), 2):
            if b not in graph.adjacent[a]:
                changed |= _link(graph, a, b)
    for u in near:
        graph.adjacent[u] |= near
        graph.adjacent[u] -= {u, v}
    for u in near:
        _measure(graph, u)
    return changed & graph.missing.keys()


def _link(graph: _Graph, a: int, b: int) -> set[int]:
    """Adds an edge; returns the candidates that now miss one edge less."""
    common = graph.adjacent[a] & graph.adjacent[b] & graph.missing.keys()
    graph.adjacent[a].add(b)
    graph.adjacent[b].add(a)
    for c in common:
        graph.missing[c] -= 1
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
