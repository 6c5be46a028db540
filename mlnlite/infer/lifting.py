"""Answers for classes of like constants: comes in a question, goes out what one of each class answers, and the rest.

A group of formulas falls apart by the constants of its separators; one tuple of each class is then solved, by cells if
it is in the two-variable fragment, else ground by itself. Log Z is a sum over classes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np

from mlnlite.errors import LimitReached, QueryMistake
from mlnlite.ground.assemble import atom_range, first_of_block, known_atoms
from mlnlite.ground.forecast import Limits
from mlnlite.ground.ground import ground
from mlnlite.ground.network import Bool, Float, Int64
from mlnlite.ground.tables import completed
from mlnlite.infer.approach import Approach
from mlnlite.infer.exact.alike import Alike, alike
from mlnlite.infer.exact.cells import LIFTED, WORTH_LIFTING
from mlnlite.infer.exact.liftable import Cells, by_cells, cells_of
from mlnlite.infer.exact.representatives import facts_about, restricted
from mlnlite.infer.exact.separators import Group, Separator, groups_of, separators_of
from mlnlite.infer.marginal.ladder import solve
from mlnlite.infer.n_worlds import log_worlds_of
from mlnlite.infer.query import Question, atom_numbers, locate
from mlnlite.model.change import find
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.model.soft import soft_templates
from mlnlite.results import Marginals

_MOST_TUPLES, _MOST_FRAGMENTS, _MANY = 20_000_000, 1000, 3000
"""Tuples of constants; classes with a fragment each; tuples from which on classes are worth more than grounding."""


@dataclass(slots=True)
class Lifted:
    """What classes of constants answer, filled in group by group, and what is left.

    Attributes:
        atoms: shape (n_atoms,), numbers of those that are asked for.
        probability: shape (n_atoms,), of each, nan where there is no answer.
        log_mean: log of the mean weight, over all worlds of their atoms, of what the groups so far say.
        n_atoms: of their predicates.
        model: with the formulas of no such group.
        evidence: completed, without soft facts, which are formulas now.
    """

    atoms: Int64
    probability: Float
    log_mean: float
    n_atoms: int
    model: Model
    evidence: Evidence

    @property
    def rows(self) -> Bool:
        """Shape (n_atoms,), which atoms are answered."""
        return ~np.isnan(self.probability)


def lifted_answers(
    model: Model, evidence: Evidence, question: Question, *, must: bool, width_limit: int, limits: Limits
) -> Lifted | None:
    """Answers what classes of constants can.

    Args:
        model: with weights.
        evidence: with the closed worlds that were asked for.
        question: what is asked.
        must: say why if any formulas have to be ground as they are, and do it even if grounding would be cheap.
        width_limit: largest number of entries of a table.
        limits: of grounding.

    Returns:
        None if that is nothing.

    Raises:
        QueryMistake: it is not possible.
        LimitReached: it would take too long.
        Contradiction: no world is possible; names hard formulas that exclude each other.
    """
    if evidence.n_databases != 1 or any(np.isnan(t.weights).any() for t in model.templates):
        return None  # grounding says what is wrong
    if must and question.formulas:
        raise QueryMistake("lifted inference answers atoms, nothing else")
    evidence = completed(evidence)
    plain = replace(evidence, soft={})
    model = replace(model, types=evidence.types, templates=(*model.templates, *soft_templates(evidence)))
    found = Lifted(question.atoms, np.full(len(question.atoms), np.nan), 0.0, 0, model, plain)
    for group in groups_of(model.templates, plain):
        _enter(group, found, question, (width_limit, limits), must=must)
    return found if found.n_atoms else None


def _enter(group: Group, found: Lifted, question: Question, limits: tuple[int, Limits], *, must: bool) -> None:
    """Answers what one group says, if that is possible, and takes it out of the model."""
    n_atoms = _n_atoms(group, found.evidence)
    if not must and (n_atoms < WORTH_LIFTING or _in_formulas(group, found.evidence, question)):
        return
    classes = alike(group, _separators(group, found.evidence), found.evidence)
    n_tuples, n_classes = len(classes.of), len(classes.size)
    cells: list[Cells] | str = "it has many small parts"
    if must or (n_atoms >= WORTH_LIFTING * n_tuples and n_classes <= _MOST_FRAGMENTS):
        cells = cells_of(classes, found.model, found.evidence)
    if isinstance(cells, str) and not classes.separators and must:
        raise QueryMistake(f"no lifted inference for this model: {cells}")
    if isinstance(cells, str) and not (must or _is_worth_it(classes)):
        return
    asked = _asked(group, classes, found.evidence, question.atoms)
    try:
        if isinstance(cells, str):
            probability, log_mean = _by_representatives(classes, found, asked, limits)
        else:
            probability, log_mean = by_cells(classes, cells, found.evidence, (asked.number, asked.of))
    except LimitReached:
        if must:
            raise
        return
    found.probability[asked.rows] = probability
    found.log_mean += log_mean
    found.n_atoms += n_atoms
    left = tuple(t for t in found.model.templates if t not in group.templates)
    found.model = replace(found.model, templates=left)


def _is_worth_it(classes: Alike) -> bool:
    """Whether solving one tuple of each class, and again for each share, is less work than solving all tuples."""
    n_solved = (1 + sum(1 for _ in _shares(classes.size))) * len(classes.size)
    return len(classes.of) >= max(_MANY, n_solved)


def _separators(group: Group, evidence: Evidence) -> tuple[Separator, ...]:
    """The separators of a group, as many as do not make too many tuples; none if there is nobody."""
    separators = separators_of(group, evidence.predicates)
    while not 0 < prod(int(evidence.present[s.type][0].sum()) for s in separators) <= _MOST_TUPLES:
        separators = separators[:-1]
    return separators


def _n_atoms(group: Group, evidence: Evidence) -> int:
    """How many ground atoms the open predicates of a group have."""
    n = {name: int(present[0].sum()) for name, present in evidence.present.items()}
    return sum(prod(n[t] for t in evidence.predicates[name].types) for name in group.open)


def _in_formulas(group: Group, evidence: Evidence, question: Question) -> bool:
    """Whether a formula that is asked for has an atom of a group."""
    numbers = np.array(sorted({n for f in question.formulas for n in atom_numbers(f.expression)}), np.int64)
    ranges = [atom_range(evidence.predicates[name], evidence) for name in group.open] if len(numbers) else []
    return any(np.searchsorted(numbers, low) < np.searchsorted(numbers, high) for low, high in ranges)


# --- what is asked of a group


@dataclass(frozen=True, slots=True)
class _Asked:
    """Open atoms of a group that are asked for.

    Attributes:
        rows: shape (n,), which of the atoms of the question.
        number: shape (n,), the atom that each is in the first tuple of its class.
        of: shape (n,), that class.
    """

    rows: Int64
    number: Int64
    of: Int64


def _asked(group: Group, classes: Alike, evidence: Evidence, atoms: Int64) -> _Asked:
    """Those of some atoms that a group answers."""
    parts = []
    for name in sorted(group.open):
        predicate = evidence.predicates[name]
        low, high = atom_range(predicate, evidence)
        rows = np.flatnonzero((atoms >= low) & (atoms < high))
        rows = rows[~find(known_atoms(predicate, evidence), atoms[rows])[1]]
        arguments = evidence.arguments_of(name, atoms[rows]).astype(np.int64)
        here = [evidence.present[t][0][c] for t, c in zip(predicate.types, arguments.T, strict=True)]
        keep = np.all(here, axis=0) if here else np.ones(len(rows), np.bool_)
        of, there = classes.moved(name, arguments[keep])
        parts.append((rows[keep], evidence.atom_number(name, there.astype(np.int32)), of))
    return _Asked(*(np.concatenate([p[i] for p in parts]) for i in range(3)))


# --- representatives


def _by_representatives(
    classes: Alike, found: Lifted, asked: _Asked, limits: tuple[int, Limits]
) -> tuple[Float, float]:
    """Probabilities of what is asked, and the log mean weight, from the first tuples of the classes, ground."""
    templates, owner = restricted(classes, found.evidence.types)
    facts = facts_about(classes, found.evidence)
    network = ground(replace(found.model, templates=templates), facts, query=asked.number, limits=limits[1])

    every, approach = np.arange(network.n_atoms), Approach("exact", limits[0])
    probability = solve(network, every, (), approach).columns.probability[locate(network, asked.number)[0]]
    log_mean = 0.0
    for times, which in _shares(classes.size):
        part = replace(network, weights=np.where(which[owner], network.weights, 0.0))
        log_mean += times * (solve(part, every, (), approach).log_z - log_worlds_of(part))
    return probability, log_mean


def _shares(size: Int64) -> Iterator[tuple[int, Bool]]:
    """Sets of classes, and how often each counts, so that in all each counts as often as it is large."""
    sizes, n_digits = np.unique(size), int(size.max()).bit_length()
    if len(sizes) <= n_digits:
        yield from ((n, size == n) for n in sizes.tolist())
    else:
        yield from ((1 << digit, (size >> digit) % 2 == 1) for digit in range(n_digits))


# --- the answer as a whole


def with_lifted(found: Lifted, rest: Marginals, names: Sequence[str]) -> Marginals:
    """The answer to a question from what classes of constants answer and what the network answers.

    Args:
        found: about the first rows.
        rest: about all other rows, in order.
        names: of all rows.
    """
    lifted = np.zeros(len(names), np.bool_)
    lifted[: len(found.probability)] = found.rows
    others = np.flatnonzero(~lifted)
    own = found.probability[found.rows]

    def column(of_rest: Float | None, of_own: Float | float) -> Float:
        assert of_rest is not None
        values = np.empty(len(names))
        values[others], values[lifted] = of_rest, of_own
        return values

    methods = np.full(len(names), LIFTED, object)
    methods[others] = rest.methods
    exact = lifted.copy()
    exact[others] = rest.exact
    block = np.full(len(names), -1, np.int64)
    block[others] = -1 if rest.block is None else rest.block
    block[lifted] = _blocks(found, int(block.max(initial=-1)) + 1)
    return replace(
        rest,
        names=tuple(names),
        probabilities=column(rest.probabilities, own),
        methods=tuple(methods.tolist()),
        exact=exact,
        error=column(rest.error, 0.0),
        log_z=rest.log_z + found.log_mean,
        statistics=replace(rest.statistics, n_atoms=rest.statistics.n_atoms + found.n_atoms),
        block=block,
        low=column(rest.low, own),
        high=column(rest.high, own),
        r_hat=column(rest.r_hat, np.nan),
        effective_size=column(rest.effective_size, np.nan),
        draws=tuple((others[rows], series) for rows, series in rest.draws),
    )


def _blocks(found: Lifted, start: int) -> Int64:
    """Numbers, from some number on, for the functional blocks of the atoms that are answered; -1 for none."""
    atoms, evidence = found.atoms[found.rows], found.evidence
    first = np.full(len(atoms), -1, np.int64)
    for predicate in evidence.predicates.values():
        if predicate.value is not None:
            low, high = atom_range(predicate, evidence)
            mine = (atoms >= low) & (atoms < high)
            first[mine] = first_of_block(atoms[mine], predicate, evidence)
    _, number = np.unique(first, return_inverse=True)
    return np.where(first < 0, -1, number.ravel() + start)
