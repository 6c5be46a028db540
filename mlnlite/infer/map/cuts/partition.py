"""Good partitions for relations that are to be transitive: comes in a network, goes out a world to start from.

Records change places between clusters, and clusters merge, as long as that gains weight (Kernighan and Lin 1970). What
the partition is worth is judged elsewhere: it is a guess for any network, and good where little else is at stake.
"""

from __future__ import annotations

import numpy as np

from mlnlite.ground.network import Bool, Float, Int64, Network
from mlnlite.infer.map.cuts.waiting import Lazy
from mlnlite.infer.reduce.potentials import potentials_of
from mlnlite.model.formulas import AtomRef, Formula, Var
from mlnlite.model.propositional import cubes

_SURE = 1e6
_STARTS = 4


def partitioned(lazy: Lazy, seed: int = 0) -> Bool | None:
    """A world in which each relation with a lazy transitivity is a partition, its other atoms by their own gain.

    Args:
        lazy: a network and its lazy templates.
        seed: of the search.

    Returns:
        Shape (n_atoms,), or None if no lazy template is a transitivity.
    """
    network = lazy.network
    names = {transitive(network.model.templates[t].formula) for t in lazy.templates} - {None}
    if not names:
        return None
    gain = own_gains(network)
    truth = gain > 0
    for name in sorted(n for n in names if n is not None):
        rows, first, second, n = _pairs(network, name)
        weight = np.full((n, n), -_SURE)
        facts = network.evidence.facts[name]
        weight[tuple(facts.arguments[facts.truth].T)] = _SURE
        weight[first, second] = np.clip(gain[rows], -_SURE, _SURE)
        labels = partition(weight + weight.T, np.random.default_rng(seed))
        truth[rows] = labels[first] == labels[second]
    return truth


def transitive(formula: Formula) -> str | None:
    """The predicate of which a formula says `P(x, y) and P(y, z) => P(x, z)`, in whatever order; None if none."""
    false = cubes(formula.body, False)
    atoms = [(formula.atoms[p.index], truth) for p, truth in false[0].items() if isinstance(p, AtomRef)]
    arguments = [(a.arguments, truth) for a, truth in atoms if all(isinstance(t, Var) for t in a.arguments)]
    if len(false) != 1 or len(false[0]) != 3 or len(arguments) != 3 or len({a.predicate for a, _ in atoms}) != 1:
        return None
    links, heads = [set(a) for a, truth in arguments if truth], [set(a) for a, truth in arguments if not truth]
    fits = len(links) == 2 and len(heads[0]) == 2 and links[0] ^ links[1] == heads[0]
    return atoms[0][0].predicate if fits else None


def _pairs(network: Network, name: str) -> tuple[Int64, Int64, Int64, int]:
    """Unknown atoms of a binary predicate, their constants, and how many constants there are."""
    n = network.evidence.sizes(name)[0]
    numbers = network.atoms - network.evidence.first_atom()[name]
    rows = np.flatnonzero((numbers >= 0) & (numbers < n * n))
    return rows, numbers[rows] // n, numbers[rows] % n, n


def own_gains(network: Network) -> Float:
    """What each atom gains by being true, from the formulas that are about it alone; shape (n_atoms,)."""
    potentials = potentials_of(network, max_arity=np.inf)
    gain = np.zeros((len(potentials.cardinality), int(potentials.cardinality.max(initial=2))))
    for c in potentials.cells:
        if c.scope.shape[1] == 1:
            np.add.at(gain, (c.scope[:, 0], c.value[:, 0]), np.maximum(c.amount, -_SURE))
    return np.asarray(gain[network.variable, network.value] - gain[network.variable, 0])


def partition(weight: Float, rng: np.random.Generator) -> Int64:
    """Labels of clusters of large weight inside.

    Args:
        weight: shape (n, n), symmetric, what a pair gains by being in one cluster.
        rng: where chance comes from.
    """
    weight = weight.copy()
    np.fill_diagonal(weight, 0.0)
    n = len(weight)
    starts = [np.arange(n), *(rng.integers(0, n, n) for _ in range(_STARTS - 1))]
    found = [_climbed(weight, start, rng) for start in starts]
    return max(found, key=lambda labels: float(weight[labels[:, None] == labels].sum()))


def _climbed(weight: Float, labels: Int64, rng: np.random.Generator) -> Int64:
    """Moves and merges until neither gains."""
    better = True
    while better:
        better = False
        labels = np.unique(labels, return_inverse=True)[1].astype(np.int64)
        for v in rng.permutation(len(labels)).tolist():
            gains = np.bincount(labels, weight[v], int(labels.max()) + 2)
            best = int(gains.argmax())
            if gains[best] > gains[labels[v]] + 1e-9:
                labels[v], better = best, True
        labels, merged = _merged(weight, labels)
        better |= merged
    return labels


def _merged(weight: Float, labels: Int64) -> tuple[Int64, bool]:
    """The two clusters merged that gain most by it, if any do."""
    member = np.eye(int(labels.max()) + 1)[labels]
    between = member.T @ weight @ member
    np.fill_diagonal(between, -np.inf)
    a, b = np.unravel_index(between.argmax(), between.shape)
    if between[a, b] <= 1e-9:
        return labels, False
    return np.where(labels == b, a, labels), True
