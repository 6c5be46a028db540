"""Elimination on a clique tree, in logarithms: sums for marginals and log Z, maxima for the best world.

Comes in a component as cells and a plan (`order.plan`), goes out the log of the sum, or the maximum, over all its
worlds, with the distribution of each variable or a best world.
Koller and Friedman, Probabilistic Graphical Models (2009), chapters 9, 10 and 13.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mlnlite.ground.network import Bool, Float, Int32, Int64
from mlnlite.infer.exact.order import Tree
from mlnlite.infer.reduce.conjunctions import Cells
from mlnlite.infer.reduce.fill import Placed, fill

_BATCHED = 4096


def clique_tables(tree: Tree, cardinality: Int32, cells: Sequence[Cells]) -> Iterator[Float]:
    """The table of each clique in turn: each cell belongs to the clique that eliminates one of its variables first.

    Small tables of equal shape are filled together, large ones when their turn comes.
    """
    shapes = [tuple(cardinality[list(scope)].tolist()) for scope in tree.scopes]
    keys = [(shape, -1 if tree.sizes[k] <= _BATCHED else k) for k, shape in enumerate(shapes)]
    batches: dict[tuple[tuple[int, ...], int], list[int]] = {}
    for k, key in enumerate(keys):
        batches.setdefault(key, []).append(k)
    batch, index = np.empty(len(keys), np.int64), np.empty(len(keys), np.int64)
    for b, members in enumerate(batches.values()):
        batch[members], index[members] = b, np.arange(len(members))
    placed = [_sorted_by_batch(p, batch, index, len(batches)) for p in _place(tree, cells)]
    done: dict[int, Float] = {}
    for k, key in enumerate(keys):
        members = batches[key]
        if k == members[0]:
            b = int(batch[k])
            parts = [_pick(here, starts[b], starts[b + 1]) for here, starts in placed]
            done.update(zip(members, fill(len(members), key[0], parts), strict=True))
        yield done.pop(k)


def _pick(cells: Placed, begin: int, end: int) -> Placed:
    """Some of the cells."""
    rows = slice(begin, end)
    return Placed(cells.table[rows], cells.axis[rows], cells.value[rows], cells.amount[rows])


def _place(tree: Tree, cells: Sequence[Cells]) -> list[Placed]:
    """The cells, each in its clique."""
    n = len(tree.position)
    clique = np.empty(n, np.int64)
    for k, (scope, count) in enumerate(zip(tree.scopes, tree.n_eliminated, strict=True)):
        clique[list(scope[:count])] = k
    pairs = [(k * n + v, axis) for k, scope in enumerate(tree.scopes) for axis, v in enumerate(scope)]
    names, axes = np.array(sorted(pairs), np.int64).reshape(-1, 2).T
    placed = []
    for c in cells:
        first = np.take_along_axis(c.scope, tree.position[c.scope].argmin(axis=1)[:, None], axis=1)[:, 0]
        home = clique[first]
        axis = axes[np.searchsorted(names, home[:, None] * n + c.scope)]
        placed.append(Placed(home, axis, c.value.astype(np.int64), c.amount))
    return placed


def _sorted_by_batch(cells: Placed, batch: Int64, index: Int64, n_batches: int) -> tuple[Placed, list[int]]:
    """Cells sorted by batch, their clique replaced by its index in there, and where each batch starts."""
    order = np.argsort(batch[cells.table], kind="stable")
    home = cells.table[order]
    starts = np.searchsorted(batch[home], np.arange(n_batches + 1)).tolist()
    return Placed(index[home], cells.axis[order], cells.value[order], cells.amount[order]), starts


def _sender_shapes(tree: Tree, cardinality: Int32) -> list[tuple[int, ...]]:
    """For each clique the shape that makes its message fit its parent's table."""
    shapes = []
    for scope, count, parent in zip(tree.scopes, tree.n_eliminated, tree.parents, strict=True):
        kept = set(scope[count:])
        target = tree.scopes[parent] if parent >= 0 else ()
        shapes.append(tuple(int(cardinality[v]) if v in kept else 1 for v in target))
    return shapes


def combined(tree: Tree, cardinality: Int32, cells: Sequence[Cells]) -> Iterator[tuple[int, Float, list[Float]]]:
    """Clique by clique: its number, its table with all messages to it, and the list to append its own message to."""
    shapes = _sender_shapes(tree, cardinality)
    inbox: dict[int, list[Float]] = {}
    for k, table in enumerate(clique_tables(tree, cardinality, cells)):
        for message in inbox.pop(k, []):
            table += message
        out: list[Float] = []
        eliminated = int(np.prod(table.shape[: tree.n_eliminated[k]]))
        yield k, table.reshape(eliminated, -1), out
        inbox.setdefault(tree.parents[k], []).append(out[0].reshape(shapes[k]))


def log_sum(tree: Tree, cardinality: Int32, cells: Sequence[Cells], wanted: Bool) -> tuple[float, dict[int, Float]]:
    """Log of the sum of the weights of all worlds, and the distribution of each wanted variable.

    Args:
        tree: the plan.
        cardinality: shape (n,).
        cells: of the component.
        wanted: shape (n,), whose distribution to work out; the way down the tree goes only where it has to.

    Returns:
        The log partition function, minus infinity (and no distributions) if no world is possible.
    """
    keep = _on_the_way(tree, wanted)
    conditional: dict[int, Float] = {}
    total = 0.0
    for k, table, out in combined(tree, cardinality, cells):
        peak = table.max(axis=0)
        peak[np.isneginf(peak)] = 0.0
        table -= peak
        weight = np.exp(table, out=table)
        mass = weight.sum(axis=0)
        with np.errstate(divide="ignore"):
            out.append(peak + np.log(mass))
        if keep[k]:
            weight /= np.where(mass > 0, mass, 1.0)
            conditional[k] = weight
        if tree.parents[k] < 0:
            total += float(out[0][0])
    return total, _downward(tree, cardinality, conditional, wanted) if np.isfinite(total) else {}


def _on_the_way(tree: Tree, wanted: Bool) -> list[bool]:
    """Which cliques eliminate a wanted variable, or have one below them that does."""
    needed = [bool(wanted[list(s[:n])].any()) for s, n in zip(tree.scopes, tree.n_eliminated, strict=True)]
    for k, parent in enumerate(tree.parents):
        if needed[k] and parent >= 0:
            needed[parent] = True
    return needed


def _downward(tree: Tree, cardinality: Int32, conditional: dict[int, Float], wanted: Bool) -> dict[int, Float]:
    """Distributions of the wanted variables, from `P(eliminated | kept)` of each clique, roots first."""
    kept: dict[int, Float] = {}
    children: dict[int, list[int]] = {}
    found: dict[int, Float] = {}
    for k, parent in enumerate(tree.parents):
        if k in conditional:
            children.setdefault(parent, []).append(k)
    for k in sorted(conditional, reverse=True):
        scope, count = tree.scopes[k], tree.n_eliminated[k]
        belief = conditional.pop(k)
        if k in kept:
            belief *= kept.pop(k).ravel()
        shaped = belief.reshape(cardinality[list(scope)])
        found |= _each(shaped.reshape(*shaped.shape[:count], -1).sum(axis=-1), scope[:count], wanted)
        for child in children.get(k, []):
            kept[child] = _marginal(shaped, scope, tree.scopes[child][tree.n_eliminated[child] :])
    return found


def _marginal(belief: Float, scope: tuple[int, ...], onto: tuple[int, ...]) -> Float:
    """Sum over all variables of the scope but some, which stand in the same order in both."""
    keep = set(onto)
    return np.asarray(belief.sum(axis=tuple(i for i, v in enumerate(scope) if v not in keep)))


def _each(belief: Float, scope: tuple[int, ...], wanted: Bool) -> dict[int, Float]:
    """Distribution of each wanted variable of a scope, halving the scope so that the table is read only twice."""
    if not wanted[list(scope)].any():
        return {}
    if len(scope) == 1:
        return {scope[0]: belief}
    half = len(scope) // 2
    shapes = belief.shape[:half], belief.shape[half:]
    flat = belief.reshape(int(np.prod(shapes[0])), -1)
    left, right = flat.sum(axis=1).reshape(shapes[0]), flat.sum(axis=0).reshape(shapes[1])
    return _each(left, scope[:half], wanted) | _each(right, scope[half:], wanted)


def best_world(tree: Tree, cardinality: Int32, cells: Sequence[Cells]) -> tuple[float, Int64]:
    """The largest log-weight of a world, and a world that has it.

    Returns:
        Minus infinity and any world if none is possible.
    """
    tables: list[Float] = []
    total = 0.0
    for k, table, out in combined(tree, cardinality, cells):
        tables.append(table)
        out.append(table.max(axis=0))
        if tree.parents[k] < 0:
            total += float(out[0][0])
    world = np.zeros(len(cardinality), np.int64)
    for k in reversed(range(len(tables))):
        scope, count = tree.scopes[k], tree.n_eliminated[k]
        shape = cardinality[list(scope)].tolist()
        kept = np.ravel_multi_index(tuple(world[list(scope[count:])]), shape[count:]) if scope[count:] else 0
        best = int(tables.pop()[:, kept].argmax())
        world[list(scope[:count])] = np.unravel_index(best, shape[:count])
    return total, world
