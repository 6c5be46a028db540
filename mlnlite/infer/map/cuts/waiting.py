"""Formulas too many to ground, which wait until a world violates them: comes in a model, goes out a network that grows.

What was never generated is never violated, so a world that is best for what was, and violates nothing else, is best for
the whole model. (Riedel, Improving the accuracy and efficiency of MAP inference for Markov logic, UAI 2008.)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import prod

import numpy as np

from mlnlite.engines.plan import Engine
from mlnlite.ground.assemble import atom_range
from mlnlite.ground.blocks import Piece
from mlnlite.ground.forecast import Limits
from mlnlite.ground.ground import NO_LIMITS, forecasts, ground, prepared
from mlnlite.ground.lazy import violations, world_evidence
from mlnlite.ground.merge import merged_clauses
from mlnlite.ground.network import Bool, Clauses, Int32, Int64, Network
from mlnlite.ground.residual import ClauseShape
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import AtomRef, Equal
from mlnlite.model.model import Model
from mlnlite.model.propositional import cubes, without_quantifiers
from mlnlite.model.templates import Template

LAZY_FROM = 500_000
"""Groundings of a formula that are worth waiting for."""


@dataclass(frozen=True, slots=True)
class Lazy:
    """A network that lacks most groundings of some templates; they count as true until they are generated.

    Attributes:
        network: what was generated so far.
        templates: indices in its model of the lazy templates.
        in_rows: how many of their groundings became rows of programs, which the network need not have.
    """

    network: Network
    templates: tuple[int, ...]
    in_rows: int = 0

    @property
    def generated(self) -> int:
        """Number of groundings of the lazy templates that were generated."""
        return self.in_rows + int(self.network.n_open[np.isin(self.network.template, self.templates)].sum())

    @property
    def total(self) -> int:
        """Number of all their groundings."""
        return int(self.network.n_groundings[np.isin(self.network.template, self.templates)].sum())


def worth_waiting(model: Model, evidence: Evidence, least: int = LAZY_FROM) -> tuple[int, ...]:
    """Templates that are better grounded on demand: clauses, hard or of positive weight, with many groundings.

    Args:
        model: whose.
        evidence: one database.
        least: how many groundings are many.
    """
    if not any(_can_wait(t, evidence) and _size(t, evidence) >= least for t in model.templates):
        return ()
    expected = forecasts(model, evidence)
    return tuple(i for i, f in enumerate(expected) if f.rows >= least and _can_wait(model.templates[i], evidence))


def _can_wait(template: Template, evidence: Evidence) -> bool:
    """Whether every grounding is a clause that worlds are better off satisfying, over three unknown atoms or more.

    (Pairs of atoms that exclude each other become counts, which are worth having from the start.)
    """
    still_open = [a for a in template.formula.atoms if not evidence.predicates[a.predicate].closed]
    constants = {name: np.flatnonzero(p.any(axis=0)).tolist() for name, p in evidence.present.items()}
    if not (template.weights > 0).all() or len(template.formula.free) < 2 or len(still_open) < 3:
        return False
    if any(v.bound for v in template.formula.variables):
        return False
    body = without_quantifiers(template.formula, constants).body
    false = cubes(body, False)
    return len(false) == 1 and all(isinstance(p, AtomRef | Equal) for p in false[0])


def _size(template: Template, evidence: Evidence) -> int:
    """Number of groundings of all rows, known ones included."""
    free = [v for v in template.formula.free if v not in template.keys]
    return prod(int(evidence.present[template.formula.variables[v].type].sum()) for v in free)


def without_lazy(
    model: Model,
    evidence: Evidence,
    waiting: Sequence[int],
    query: Int64 | None = None,
    engine: Engine | None = None,
    limits: Limits = NO_LIMITS,
) -> Lazy:
    """The network of all other templates, with the atoms of the lazy ones.

    Args:
        model: with all templates.
        evidence: one database.
        waiting: indices of the templates that are to wait.
        query: numbers of further atoms that are to be in the network.
        engine: what runs the grounding plans.
        limits: what grounding may take.
    """
    others = tuple(t for i, t in enumerate(model.templates) if i not in waiting)
    expanded, completed, _ = prepared(replace(model, templates=tuple(model.templates[i] for i in waiting)), evidence)
    names = {a.predicate for t in expanded.templates for a in t.formula.atoms}
    ranges = [np.arange(*atom_range(evidence.predicates[n], completed)) for n in sorted(names)]
    asked = np.concatenate([*ranges, np.zeros(0, np.int64) if query is None else query])
    base = ground(replace(model, templates=others), evidence, query=asked, engine=engine, limits=limits)
    first = len(base.model.templates)
    weights = np.concatenate([base.weights, *(t.weights for t in expanded.templates)])
    sizes = [len(t.weights) for t in expanded.templates]
    total = np.repeat(np.array([_size(t, evidence) for t in expanded.templates], np.int64), sizes)
    network = replace(
        base,
        model=replace(base.model, templates=base.model.templates + expanded.templates),
        weights=weights,
        template=np.concatenate([base.template, np.repeat(np.arange(len(sizes), dtype=np.int32) + first, sizes)]),
        decided_true=np.concatenate([base.decided_true, total]),
        n_groundings=np.concatenate([base.n_groundings, total]),
    )
    return _with_known(Lazy(network, tuple(range(first, first + len(sizes)))), engine)


def _with_known(lazy: Lazy, engine: Engine | None) -> Lazy:
    """Counts the groundings that evidence alone violates as false (any world violates them, so do those of no atom)."""
    decided = lazy.network.decided_true.copy()
    for literals, weight, count in _violated(lazy, np.zeros(lazy.network.n_atoms, np.bool_), engine):
        known = (literals == 0).all(axis=1)
        np.subtract.at(decided, weight[known], count[known])
    return replace(lazy, network=replace(lazy.network, decided_true=decided))


def with_violated(lazy: Lazy, truth: Bool, engine: Engine | None = None) -> Lazy:
    """The network with the groundings that a world violates; the same object if there are none that it lacks."""
    network = lazy.network
    for groundings in _violated(lazy, truth, engine):
        network = _with_groundings(network, *groundings)
    return lazy if network is lazy.network else replace(lazy, network=network)


def literals_of_piece(network: Network, template: int, piece: Piece) -> tuple[Int32, Int32, Int64]:
    """Violated groundings as literals over unknown atoms (0 for known ones, which are false), weight index, count."""
    weight = (piece.row + int(np.searchsorted(network.template, template))).astype(np.int32)
    numbers = np.stack(piece.atoms, axis=1)
    index = np.minimum(np.searchsorted(network.atoms, numbers), max(network.n_atoms - 1, 0))
    is_open = network.atoms[index] == numbers if network.n_atoms else np.zeros(numbers.shape, np.bool_)
    assert isinstance(piece.shape, ClauseShape)
    literals = np.where(is_open, (index + 1) * np.where(np.array(piece.shape.signs), 1, -1), 0)
    return literals.astype(np.int32), weight, piece.count


def _violated(lazy: Lazy, truth: Bool, engine: Engine | None) -> Iterator[tuple[Int32, Int32, Int64]]:
    """The groundings that a world violates."""
    world = world_evidence(lazy.network, truth)
    for template in lazy.templates:
        for piece in violations(lazy.network, world, template, engine=engine):
            yield literals_of_piece(lazy.network, template, piece)


def violated_weight(lazy: Lazy, truth: Bool, engine: Engine | None = None) -> float:
    """Weight of the open groundings of lazy templates that a world violates; infinity if one of them is hard."""
    total = 0.0
    for literals, weight, count in _violated(lazy, truth, engine):
        rows = (literals != 0).any(axis=1)
        total += float((lazy.network.weights[weight[rows]] * count[rows]).sum())
    return total


def _with_groundings(network: Network, literals: Int32, weight: Int32, count: Int64) -> Network:
    """Adds clauses, literals of 0 left out."""
    n_open = (literals != 0).sum(axis=1)
    for k in np.unique(n_open[n_open > 0]).tolist():
        rows = np.flatnonzero(n_open == k)
        columns = np.argsort(literals[rows] == 0, axis=1, kind="stable")[:, :k]
        chosen = np.take_along_axis(literals[rows], columns, 1)
        network = _with_clauses(network, _simple(chosen), weight[rows], count[rows])
    return network


def _simple(literals: Int32) -> Int32:
    """The literals, each row sorted by atom."""
    return np.take_along_axis(literals, np.argsort(np.abs(literals), axis=1, kind="stable"), axis=1)


def _with_clauses(network: Network, literals: Int32, weight: Int32, count: Int64) -> Network:
    """Adds the clauses that the network lacks."""
    repeated = np.any(np.abs(literals[:, 1:]) == np.abs(literals[:, :-1]), axis=1)
    for row in np.flatnonzero(repeated).tolist():
        short = np.unique(literals[row : row + 1])[None]
        network = _with_clauses(network, _simple(short), weight[row : row + 1], count[row : row + 1])
    literals, weight, count = literals[~repeated], weight[~repeated], count[~repeated]
    rows, weight, count = merged_clauses(list(literals.T), weight, count)
    k = rows.shape[1]
    same = [c for c in network.clauses if c.literals.shape[1] == k and not c.negated]
    known = {(w, *r) for c in same for r, w in zip(c.literals.tolist(), c.weight.tolist(), strict=True)}
    fresh = [i for i, (r, w) in enumerate(zip(rows.tolist(), weight.tolist(), strict=True)) if (w, *r) not in known]
    if not fresh:
        return network
    blocks = [*same, Clauses(rows[fresh], weight[fresh], count[fresh])]
    joined = Clauses(
        np.concatenate([b.literals for b in blocks]),
        np.concatenate([b.weight for b in blocks]),
        np.concatenate([b.count for b in blocks]),
    )
    decided = network.decided_true.copy()
    np.subtract.at(decided, weight[fresh], count[fresh])
    others = tuple(c for c in network.clauses if c.literals.shape[1] != k or c.negated)
    return replace(network, clauses=(*others, joined), decided_true=decided)
