"""The cell algorithm for classes of constants: comes in a group with classes, go out probabilities and log means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mlnlite.errors import Contradiction
from mlnlite.ground.assemble import atom_range
from mlnlite.ground.network import Float, Int64
from mlnlite.infer.conflict import contradiction_of
from mlnlite.infer.exact.alike import Alike
from mlnlite.infer.exact.cells import Fragment, fragment_of
from mlnlite.infer.exact.remainder import remainder
from mlnlite.infer.n_worlds import log_worlds
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.model.templates import Template

Cells = tuple[Fragment, Model, Evidence]
"""What is left of a group for the first tuple of a class, as a fragment and as it is."""


def cells_of(classes: Alike, model: Model, evidence: Evidence) -> list[Cells] | str:
    """The cells of each class, or why it has none.

    Args:
        classes: of the constants of a group.
        model: of the group.
        evidence: about one database.
    """
    cells: list[Cells] = []
    for number in range(len(classes.size)):
        left = remainder(classes, number, model, evidence)
        if left is None:
            return "it needs one or two variables and no quantifier"
        fragment = fragment_of(*left)
        if isinstance(fragment, str):
            return fragment
        if classes.group.open - {*fragment.unary, *fragment.binary}:
            return "some formulas have no weight for some constants"
        cells.append((fragment, *left))
    return cells


def by_cells(
    classes: Alike, cells: Sequence[Cells], evidence: Evidence, asked: tuple[Int64, Int64]
) -> tuple[Float, float]:
    """Probabilities of atoms, and the log of the mean weight of what the group says, over all worlds of its atoms.

    Args:
        classes: of the constants of a group.
        cells: of each class.
        evidence: as for `cells_of`.
        asked: shape (n,) each: atoms about the first tuples of classes, and these classes.

    Raises:
        LimitReached: the sums would have too many terms.
        Contradiction: no world is possible; names hard formulas that exclude each other.
    """
    from mlnlite.infer.exact.lifted import classes_of, lifted_probabilities

    (numbers, of), log_mean = asked, 0.0
    probability = np.full(len(numbers), np.nan)
    for number, (fragment, model, left) in enumerate(cells):
        rows = np.flatnonzero(of == number)
        atoms = _without_separators(numbers[rows], classes, evidence, left)
        try:
            probability[rows], log_z = lifted_probabilities(classes_of(fragment, left), left, atoms)
        except Contradiction as error:
            raise contradiction_of(_conflict(model, left)) from error
        log_mean += int(classes.size[number]) * (log_z - log_worlds(left, classes.group.open))
    return probability, log_mean


def _without_separators(numbers: Int64, classes: Alike, evidence: Evidence, left: Evidence) -> Int64:
    """Atoms about the first tuple of a class by their numbers in what is left for it."""
    found = numbers.copy()
    for name in classes.group.open:
        low, high = atom_range(evidence.predicates[name], evidence)
        mine = (numbers >= low) & (numbers < high)
        places = [s.at[name] for s in classes.separators]
        found[mine] = left.atom_number(name, np.delete(evidence.arguments_of(name, numbers[mine]), places, axis=1))
    return found


def _conflict(model: Model, evidence: Evidence) -> list[Template]:
    """Hard formulas that exclude each other: none of them can be left out."""
    keep = [t for t in model.templates if np.isposinf(t.weights).any()]
    for template in list(keep):
        rest = [t for t in keep if t is not template]
        if not _is_possible(replace(model, templates=tuple(rest)), evidence):
            keep = rest
    return keep


def _is_possible(model: Model, evidence: Evidence) -> bool:
    """Whether some world satisfies a model of hard formulas."""
    from mlnlite.infer.exact.lifted import IMPOSSIBLE, classes_of, log_sum

    fragment = fragment_of(model, evidence)
    return isinstance(fragment, str) or bool(log_sum(classes_of(fragment, evidence)) > IMPOSSIBLE)
