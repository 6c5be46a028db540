"""Lifted inference: comes in a model without evidence about pairs, go out exact probabilities, without grounding.

All that matters of a world is how many constants are in each group of cells (see `cells`), so the partition function is
a sum over those numbers, in logarithms, and so is everything else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from mlnlite.errors import Contradiction, Diagnostic, LimitReached
from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.infer.exact.cells import Fragment, groups_of
from mlnlite.model.evidence import Evidence

MOST_TERMS = 20_000_000
_NEVER = -1e30
IMPOSSIBLE = _NEVER / 2
"""A log-weight below this is that of no world."""


@dataclass(frozen=True, slots=True)
class Classes:
    """Constants, classed by what is known of them.

    Attributes:
        fragment: of the model.
        of: shape (n_constants,), class of each constant, -1 for those that the database does not have.
        size: shape (n_classes,), how many constants each has.
        cell: shape (n_classes, n_cells), log-weight of each cell, minus infinity where evidence excludes it.
        group: shape (n_cells,), group of each cell.
        own: shape (n_classes, n_groups), log-weight of each group.
        pair: shape (n_groups, n_groups), log-weight of two constants.
    """

    fragment: Fragment
    of: Int64
    size: Int64
    cell: Float
    group: Int64
    own: Float
    pair: Float


def classes_of(fragment: Fragment, evidence: Evidence) -> Classes:
    """Classes the constants by their evidence.

    Raises:
        LimitReached: the sums would have too many terms.
    """
    present = evidence.present[fragment.type][0]
    known = np.full((len(present), len(fragment.unary)), -1, np.int8)
    for i, name in enumerate(fragment.unary):
        facts = evidence.facts[name]
        known[:, i] = 0 if evidence.predicates[name].closed else -1
        known[facts.arguments[:, 0], i] = facts.truth
    signatures, of = np.unique(known[present], axis=0, return_inverse=True)
    fits = fragment.cells[None, :, : len(fragment.unary)] == signatures[:, None, :]
    cell = np.where((fits | (signatures[:, None, :] < 0)).all(axis=2), fragment.own, -np.inf)
    group, pair = groups_of(fragment)
    n = len(pair)
    own = np.stack([np.logaddexp.reduce(np.where(group == g, cell, -np.inf), axis=1) for g in range(n)], axis=1)
    place = np.full(len(present), -1, np.int64)
    place[present] = of.ravel()
    size = np.bincount(of.ravel(), minlength=len(signatures))
    terms = float(prod(range(len(of) + 1, len(of) + n))) / prod(range(1, n)) * (1 if len(size) == 1 else len(of))
    if terms > MOST_TERMS:
        raise LimitReached(f"lifted inference needs a sum of {terms:.1e} terms; the limit is {MOST_TERMS:.0e}")
    return Classes(fragment, place, size, cell, group, own, pair)


def log_sum(classes: Classes, apart: Sequence[tuple[int, int]] = ()) -> float:
    """Log of the summed weights of all worlds.

    Args:
        classes: of the constants.
        apart: class and group of constants (one of the class each) whose cell is in a given group.
    """
    size = classes.size.copy()
    for c, _ in apart:
        size[c] -= 1
    ways = _ways(int(size[0]), classes.own[0])
    for n_more, own in zip(size[1:].tolist(), classes.own[1:], strict=True):
        ways = _convolved(ways, _ways(n_more, own))
    counts = _counts(ways, int(size.sum()))
    fixed = np.zeros(len(classes.pair))
    for _, g in apart:
        fixed[g] += 1
    n = counts + fixed
    pair = np.where(np.isneginf(classes.pair), _NEVER, classes.pair)
    worth = ways[~np.isneginf(ways)] + 0.5 * (((n @ pair) * n).sum(axis=1) - n @ np.diag(pair))
    others = float(np.logaddexp.reduce(worth, initial=-np.inf))
    return others + sum(float(classes.own[c, g]) for c, g in apart)


def _ways(n: int, own: Float) -> Float:
    """Log-weight of each way to spread n constants over groups, by the numbers in all groups but the last."""
    shape = (n + 1,) * (len(own) - 1)
    index = np.indices(shape).reshape(len(shape), (n + 1) ** len(shape))
    last = n - index.sum(axis=0)
    ways = np.full(last.shape, -np.inf)
    counts = np.vstack([index, last])[:, last >= 0]
    worth = np.where(counts > 0, counts * np.where(np.isneginf(own), _NEVER, own)[:, None], 0.0).sum(axis=0)
    factorial = np.concatenate([[0.0], np.cumsum(np.log(np.arange(1, n + 1)))])
    ways[last >= 0] = np.where(worth < IMPOSSIBLE, -np.inf, worth + factorial[n] - factorial[counts].sum(axis=0))
    return ways.reshape(shape)


def _convolved(left: Float, right: Float) -> Float:
    """Sums over all ways to split numbers in two."""
    small, large = sorted((left, right), key=np.size)
    shape = tuple(a + b - 1 for a, b in zip(left.shape, right.shape, strict=True))
    result = np.full(shape, -np.inf)
    for at in np.argwhere(~np.isneginf(small)):
        window = tuple(slice(i, i + k) for i, k in zip(at.tolist(), large.shape, strict=True))
        result[window] = np.logaddexp(result[window], large + small[tuple(at)])
    return result


def _counts(ways: Float, n: int) -> Float:
    """Numbers in all groups of the ways that are possible: shape (n_ways, n_groups)."""
    index = np.argwhere(~np.isneginf(ways)) if ways.ndim else np.zeros((int(not np.isneginf(ways)), 0))
    return np.column_stack([index, n - index.sum(axis=1)]).astype(float)


def lifted_probabilities(classes: Classes, evidence: Evidence, atoms: Int64) -> tuple[Float, float]:
    """Probabilities of atoms, and the log partition function over all atoms of the predicates in formulas.

    Args:
        classes: of the constants.
        evidence: of the atoms.
        atoms: shape (n,), numbers of atoms of these.

    Raises:
        Contradiction: no world is possible.
    """
    fragment = classes.fragment
    log_z = log_sum(classes)
    if log_z < IMPOSSIBLE:
        raise Contradiction([Diagnostic("E405", "no world satisfies the hard formulas together with the evidence")])
    found = np.full(len(atoms), np.nan)
    n = len(evidence.types[fragment.type].constants)
    for name, low in evidence.first_atom().items():
        rows = np.flatnonzero((atoms >= low) & (atoms < low + prod(evidence.sizes(name))))
        if not len(rows):
            continue
        if name in fragment.unary:
            column = fragment.unary.index(name)
            found[rows] = _alone(classes, log_z, fragment.cells[:, column])[classes.of[atoms[rows] - low]]
        else:
            found[rows] = _pairs(classes, log_z, fragment.binary.index(name), np.divmod(atoms[rows] - low, n))
    return found, log_z


def _alone(classes: Classes, log_z: float, truth: Bool) -> Float:
    """Shape (n_classes,): probability that a constant is in a cell where something is true."""
    inside = np.stack(
        [
            np.logaddexp.reduce(np.where((classes.group == g) & truth, classes.cell, -np.inf), axis=1)
            for g in _all_groups(classes)
        ],
        axis=1,
    )
    group = np.array([[log_sum(classes, [(c, g)]) for g in _all_groups(classes)] for c in range(len(classes.size))])
    with np.errstate(invalid="ignore"):
        share = np.where(np.isneginf(classes.own), 0.0, np.exp(inside - classes.own))
    return np.asarray((np.exp(group - log_z) * share).sum(axis=1))


def _all_groups(classes: Classes) -> range:
    """Numbers of the groups."""
    return range(len(classes.pair))


def _pairs(classes: Classes, log_z: float, binary: int, who: tuple[Int64, Int64]) -> Float:
    """Probabilities of `R(x, y)`."""
    fragment, (first, second) = classes.fragment, (classes.of[who[0]], classes.of[who[1]])
    same = who[0] == who[1]
    found = np.full(len(first), np.nan)
    if same.any():
        itself = _alone(classes, log_z, fragment.cells[:, len(fragment.unary) + binary])
        found[same] = itself[first[same]]
    names, which = np.unique(np.stack([first[~same], second[~same]]), axis=1, return_inverse=True)
    if names.size:
        values = [_pair(classes, log_z, binary, (c, d)) for c, d in names.T.tolist()]
        found[~same] = np.array(values)[which.ravel()]
    return found


def _pair(classes: Classes, log_z: float, binary: int, of: tuple[int, int]) -> float:
    """Probability of `R(x, y)` for two different constants of given classes."""
    fragment, total = classes.fragment, 0.0
    true = np.logaddexp.reduce(fragment.pair[:, :, fragment.shared[:, binary, 0]], axis=2)
    for g in _all_groups(classes):
        for h in _all_groups(classes):
            x = np.where(classes.group == g, classes.cell[of[0]], -np.inf)
            y = np.where(classes.group == h, classes.cell[of[1]], -np.inf)
            both = log_sum(classes, [(of[0], g), (of[1], h)])
            if np.isfinite(both) and np.isfinite(classes.pair[g, h]):
                norm = classes.own[of[0], g] + classes.own[of[1], h] + classes.pair[g, h]
                total += float(
                    np.exp(both - log_z + np.logaddexp.reduce((x[:, None] + y[None, :] + true).ravel()) - norm)
                )
    return total
