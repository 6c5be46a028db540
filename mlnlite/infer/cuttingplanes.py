"""Best worlds by cutting planes: comes in a model with formulas too many to ground, goes out a world with a bound.

Solve without these formulas, ask the engine which of their groundings the world violates, add these, solve again. What
was never generated is never violated, so the last world is best for the whole model. (Riedel, Improving the accuracy
and efficiency of MAP inference for Markov logic, UAI 2008.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Literal

import numpy as np

from mlnlite.engines.plan import Engine
from mlnlite.ground.assemble import Piece, atom_range
from mlnlite.ground.ground import forecasts, ground, prepared
from mlnlite.ground.lazy import violations, world_evidence
from mlnlite.ground.merge import merged_clauses
from mlnlite.ground.network import Bool, Clauses, Int32, Int64, Network
from mlnlite.infer.map import BestWorld, map_of
from mlnlite.infer.rungs import Options
from mlnlite.infer.score import costs, log_weight
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import AtomRef, Equal
from mlnlite.model.model import Model
from mlnlite.model.propositional import cubes, without_quantifiers
from mlnlite.model.templates import Template

LAZY_FROM = 500_000
"""Groundings of a formula that are worth waiting for."""

_CLOSE = 1e-4


@dataclass(frozen=True, slots=True)
class Lazy:
    """A network that lacks most groundings of some templates; they count as true until they are generated.

    Attributes:
        network: what was generated so far.
        templates: indices in its model of the lazy templates.
    """

    network: Network
    templates: tuple[int, ...]

    @property
    def generated(self) -> int:
        """Number of groundings of the lazy templates that were generated."""
        return int(self.network.n_open[np.isin(self.network.template, self.templates)].sum())

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


def map_lazily(lazy: Lazy, options: Options, engine: Engine | None = None) -> tuple[Lazy, BestWorld]:
    """A most probable world of the whole model, and what had to be generated for it.

    Args:
        lazy: a network that lacks groundings.
        options: how to search; on the way worlds are kept that violate nothing hard.
        engine: what runs the queries for violated groundings.

    Raises:
        Contradiction: no world satisfies the hard formulas.
    """
    found: list[tuple[float, BestWorld]] = []
    bound, answer = np.inf, _solved(lazy, options)
    while True:
        more = with_violated(lazy, answer.truth, engine)
        bound = min(bound, answer.log_weight + answer.gap)
        found.append((log_weight(more.network, answer.truth), answer))
        if more is lazy or options.deadline.is_over or _is_close(more, found, bound, options.gap):
            break
        lazy = more
        answer = _solved(lazy, options)
        if not answer.gap <= _CLOSE:  # a search that ends early may as well look for worlds that violate nothing
            other = _solved(lazy, replace(options, method="annealing"))
            lazy = with_violated(lazy, other.truth, engine)
            found.append((log_weight(lazy.network, other.truth), other))
    lazy, found = _with_nothing(lazy, found, engine)
    value, best = max(found, key=lambda f: f[0])
    gap = max(0.0, bound - value)
    status: Literal["optimal", "feasible"] = "optimal" if gap <= _CLOSE else "feasible"
    return more if more.generated > lazy.generated else lazy, replace(
        best, log_weight=value, bound=value + gap, status=status, component_gap=np.array([gap])
    )


def _solved(lazy: Lazy, options: Options) -> BestWorld:
    """A best world of what was generated so far."""
    left = None if np.isinf(options.deadline.left) else max(1.0, options.deadline.left / 2)
    return map_of(lazy.network, method=options.method, time_limit=left, seed=options.seed, gap=options.gap)


def _is_close(lazy: Lazy, found: list[tuple[float, BestWorld]], bound: float, gap: float) -> bool:
    """Whether the best world so far is proved, or close enough to the bound."""
    value, best = max(found, key=lambda f: f[0])
    if not np.isfinite(value):
        return False
    return bound - value <= max(_CLOSE, gap * float(costs(lazy.network, best.truth)[0].sum()))


def _with_nothing(
    lazy: Lazy, found: list[tuple[float, BestWorld]], engine: Engine | None
) -> tuple[Lazy, list[tuple[float, BestWorld]]]:
    """If no world is good for the whole model, the one in which nothing more is true than has to be."""
    if any(np.isfinite(value) for value, _ in found):
        return lazy, found
    nothing = replace(found[-1][1], truth=np.zeros(lazy.network.n_atoms, np.bool_))
    lazy = with_violated(lazy, nothing.truth, engine)
    return lazy, [*found, (log_weight(lazy.network, nothing.truth), nothing)]


def without_lazy(
    model: Model, evidence: Evidence, waiting: Sequence[int], query: Int64 | None = None, engine: Engine | None = None
) -> Lazy:
    """The network of all other templates, with the atoms of the lazy ones.

    Args:
        model: with all templates.
        evidence: one database.
        waiting: indices of the templates that are to wait.
        query: numbers of further atoms that are to be in the network.
        engine: what runs the grounding plans.
    """
    others = tuple(t for i, t in enumerate(model.templates) if i not in waiting)
    expanded, completed, _ = prepared(replace(model, templates=tuple(model.templates[i] for i in waiting)), evidence)
    names = {a.predicate for t in expanded.templates for a in t.formula.atoms}
    ranges = [np.arange(*atom_range(evidence.predicates[n], completed)) for n in sorted(names)]
    asked = np.concatenate([*ranges, np.zeros(0, np.int64) if query is None else query])
    base = ground(replace(model, templates=others), evidence, query=asked, engine=engine)
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
    return Lazy(network, tuple(range(first, first + len(sizes))))


def with_violated(lazy: Lazy, truth: Bool, engine: Engine | None = None) -> Lazy:
    """The network with the groundings that a world violates; the same object if there are none that it lacks."""
    world = world_evidence(lazy.network, truth)
    network = lazy.network
    for template in lazy.templates:
        for piece in violations(lazy.network, world, template, engine=engine):
            network = _with_piece(network, template, piece)
    return lazy if network is lazy.network else replace(lazy, network=network)


def _with_piece(network: Network, template: int, piece: Piece) -> Network:
    """Adds clauses of one shape; literals over known atoms, which are false, are left out."""
    weight = (piece.row + int(np.searchsorted(network.template, template))).astype(np.int32)
    numbers = np.stack(piece.atoms, axis=1)
    index = np.minimum(np.searchsorted(network.atoms, numbers), max(network.n_atoms - 1, 0))
    is_open = network.atoms[index] == numbers
    signs = np.where(np.array(piece.shape.signs), 1, -1)  # type: ignore[union-attr]
    literals = ((index + 1) * signs).astype(np.int32)
    n_open = is_open.sum(axis=1)
    for k in np.unique(n_open[n_open > 0]).tolist():
        rows = np.flatnonzero(n_open == k)
        columns = np.argsort(~is_open[rows], axis=1, kind="stable")[:, :k]
        chosen = np.take_along_axis(literals[rows], columns, 1)
        network = _with_clauses(network, _simple(chosen), weight[rows], piece.count[rows])
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
