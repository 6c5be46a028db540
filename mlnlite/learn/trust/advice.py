"""Learnt weights to warnings: which weights the data cannot tell, or push to infinity, or tell twice."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import linprog

from mlnlite.learn.learned import LearnedModel
from mlnlite.learn.optimise import information
from mlnlite.learn.optimise.problem import one_sided
from mlnlite.model.unparse import row_text

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]

LARGEST_PROGRAM = 200_000
"""Entries of the rows up to which the linear programme is tried."""

LARGEST_BLOCK = 1500
"""Weights that hang together up to which directions without information are looked for."""


@dataclass(frozen=True, slots=True)
class Advice:
    """Something to know of some weights.

    Attributes:
        kind: `separable`, the data push the weights to infinity; `unidentified`, the data do not tell how to share
            between them; `redundant`, the formulas say the same of the data; `unsupported`, no data speak of them.
        weights: indices of the weights.
        text: a sentence, with the cure.
    """

    kind: Literal["separable", "unidentified", "redundant", "unsupported"]
    weights: tuple[int, ...]
    text: str


def advice(learned: LearnedModel, most: int = 20) -> tuple[Advice, ...]:
    """What to be careful of.

    Args:
        learned: what `learn` gave.
        most: warnings of each kind; the last says how many more there are.
    """
    found = [*_unbounded(learned, most), *_jointly_separable(learned), *_directions(learned, most)]
    n = int(learned.unsupported.sum())
    if n:
        text = f"{n:,} weights are not supported by any data; they are what the prior says"
        found.append(Advice("unsupported", tuple(np.flatnonzero(learned.unsupported).tolist()), text))
    return tuple(found)


def formula_of(learned: LearnedModel, weight: int) -> str:
    """The formula of a weight, with the constants of its row."""
    for template in learned.model.templates:
        if weight < len(template.weights):
            return row_text(template, learned.model, weight)
        weight -= len(template.weights)
    raise IndexError(weight)


def _unbounded(learned: LearnedModel, most: int) -> Iterator[Advice]:
    """Weights that no data speak against, each by itself."""
    weights = np.flatnonzero(learned.unbounded)
    cure = (
        "the prior keeps it finite" if learned.prior is not None else "give it a prior, or write it as a hard formula"
    )
    for w in weights[:most].tolist():
        sign = learned.unbounded[w]
        why = "never contradict" if sign > 0 else "never support"
        text = f"the data {why} {formula_of(learned, w)}: its best weight is {'+' if sign > 0 else '-'}infinity; {cure}"
        yield Advice("separable", (w,), text)
    if len(weights) > most:
        text = f"{len(weights) - most:,} more weights have an infinite best value; {cure}"
        yield Advice("separable", tuple(weights[most:].tolist()), text)


def _jointly_separable(learned: LearnedModel) -> Iterator[Advice]:
    """Weights that only together have no finite best value."""
    found = learned.problem.every
    if learned.problem.known is not None or learned.problem.wide or found.rows.nnz > LARGEST_PROGRAM:
        return
    unbounded, left = one_sided(found)
    inner = np.flatnonzero(unbounded == 0)
    rows = sparse.csr_array(found.rows[left][:, inner])
    direction = separable(rows)
    moved = np.flatnonzero(np.abs(direction) > 1e-6)
    if len(moved):
        weights = learned.problem.free[inner[moved]].tolist()
        names = "; ".join(f"{direction[m]:+.2g} {formula_of(learned, w)}" for m, w in zip(moved, weights, strict=True))
        cure = "the best weights are infinite; give a prior, or drop one of the formulas"
        text = f"the data separate along {names}: {cure}"
        yield Advice("separable", tuple(weights), text)


def separable(rows: sparse.csr_array) -> Float:
    """A direction in which no row speaks against and some speaks for, or zeros if there is none.

    A linear programme: `max sum(t)` with `0 <= t <= 1`, `rows @ d >= t` (Albert and Anderson, Biometrika 1984; Konis,
    Linear programming algorithms for detecting separated data, 2007).
    """
    filled = rows[np.flatnonzero(np.diff(rows.indptr))]
    n, k = filled.shape
    if not n or not k:
        return np.zeros(k)
    constraint: Any = sparse.hstack([-filled, sparse.eye_array(n)], format="csr")
    cost = np.concatenate([np.zeros(k), -np.ones(n)])
    bounds = [(-1e3, 1e3)] * k + [(0.0, 1.0)] * n
    found: Any = linprog(cost, A_ub=constraint, b_ub=np.zeros(n), bounds=bounds, method="highs")
    if found.x is None or -found.fun < 1e-6:
        return np.zeros(k)
    return np.asarray(found.x[:k] / max(1e-300, np.abs(found.x[:k]).max()))


def _directions(learned: LearnedModel, most: int) -> Iterator[Advice]:
    """Directions of the weights that change no choice."""
    found = learned.problem.every
    gram = sparse.csr_array(found.rows.T @ found.rows)
    n_found = 0
    for block in information.blocks(gram):
        if not 1 < len(block) <= LARGEST_BLOCK:
            continue
        for direction in _null_space(information.dense(gram, block)):
            if n_found < most:
                yield _direction(learned, block, direction)
            n_found += 1


def _null_space(gram: Float) -> Iterator[Float]:
    """A sparse basis of the null space of a positive matrix, by elimination of its null vectors."""
    value, vector = np.linalg.eigh(gram)
    null = vector[:, value < 1e-10 * max(1.0, float(value[-1]))].T
    for i in range(len(null)):
        pivot = np.unravel_index(np.abs(null[i:]).argmax(), null[i:].shape)
        row, column = int(pivot[0]) + i, int(pivot[1])
        null[[i, row]] = null[[row, i]]
        null[i] /= null[i, column]
        others = np.arange(len(null)) != i
        null[others] -= np.outer(null[others, column], null[i])
    yield from np.where(np.abs(null) < 1e-6, 0.0, null)


def _direction(learned: LearnedModel, block: Int64, direction: Float) -> Advice:
    moved = np.flatnonzero(direction)
    weights = tuple(learned.problem.free[block[moved]].tolist())
    if len(weights) == 2:
        first, second = (formula_of(learned, w) for w in weights)
        text = f"{first} is redundant with {second}: the data see only a combination of the two; drop one"
        return Advice("redundant", weights, text)
    names = "; ".join(f"{direction[m]:+.2g} {formula_of(learned, w)}" for m, w in zip(moved[:8], weights, strict=False))
    more = f" and {len(moved) - 8} more" if len(moved) > 8 else ""
    text = f"the data do not tell {names}{more} apart; only the prior does: drop one, or fix its weight"
    return Advice("unidentified", weights, text)
