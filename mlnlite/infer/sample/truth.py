"""Truth of formulas in many worlds at once: comes in truth of their atoms, draw by draw, goes out theirs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mlnlite.ground.network import Bool, Int32, Int64
from mlnlite.infer.query import atom_numbers
from mlnlite.infer.sample.factors import Factors
from mlnlite.infer.sample.gibbs import owners
from mlnlite.model.formulas import All, Any, AtomRef, Expression, Iff, Not


@dataclass(frozen=True, slots=True)
class Watched:
    """Atoms to follow.

    Attributes:
        atoms: shape (n, 2), the variable of each and its place in `Factors`.
        column: where each atom of the network stands in there.
    """

    atoms: Int32
    column: dict[int, int]


def watched_by(formulas: Sequence[Expression], factors: Factors, place: Int64) -> Watched:
    """The atoms of some formulas.

    Args:
        formulas: over indices into `Network.atoms`.
        factors: that hold all their atoms.
        place: shape (n_atoms of the network,), place of each atom in `factors`.
    """
    numbers = sorted({n for f in formulas for n in atom_numbers(f)})
    inside = place[np.array(numbers, np.int64)]
    atoms = np.stack([owners(factors)[inside], inside], axis=1) if numbers else np.zeros((0, 2))
    return Watched(atoms.astype(np.int32), {n: i for i, n in enumerate(numbers)})


def truth_values(formulas: Sequence[Expression], watched: Watched, seen: Bool) -> Bool:
    """Truth of each formula in each draw.

    Args:
        formulas: over indices into `Network.atoms`.
        watched: their atoms.
        seen: shape (n_draws, n_watched).

    Returns:
        Shape (n_draws, n_formulas).
    """
    columns = [_truth(f, watched, seen) for f in formulas]
    return np.stack(columns, axis=1) if columns else np.zeros((len(seen), 0), np.bool_)


def _truth(formula: Expression, watched: Watched, seen: Bool) -> Bool:
    """Truth of one formula in each draw."""
    match formula:
        case AtomRef(a):
            return seen[:, watched.column[a]]
        case Not(part):
            return ~_truth(part, watched, seen)
        case All(parts):
            return np.asarray(
                np.all([np.ones(len(seen), np.bool_), *(_truth(p, watched, seen) for p in parts)], axis=0)
            )
        case Any(parts):
            return np.asarray(
                np.any([np.zeros(len(seen), np.bool_), *(_truth(p, watched, seen) for p in parts)], axis=0)
            )
        case Iff(left, right):
            return np.asarray(_truth(left, watched, seen) == _truth(right, watched, seen))
        case _:
            raise TypeError(f"not a ground formula: {formula}")
