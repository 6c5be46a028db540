"""Model, databases and objective to the problem that is solved, and how it is solved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.choose import engine_for
from mlnlite.engines.plan import Engine, Run
from mlnlite.errors import LimitReached, QueryMistake
from mlnlite.ground.ground import blamed, row_tables
from mlnlite.ground.tables import tables_of
from mlnlite.infer.deadline import Deadline
from mlnlite.learn.data.choices import listed
from mlnlite.learn.data.counts import entries, joined
from mlnlite.learn.data.merge import Listed, merged
from mlnlite.learn.data.wide import Wide
from mlnlite.learn.learned import How
from mlnlite.learn.objectives.exact import Labels, compiled
from mlnlite.learn.objectives.quantified import counted_entries, ranges_widely, without_weights
from mlnlite.learn.optimise.newton import Optimum
from mlnlite.learn.optimise.problem import Problem, problem_of
from mlnlite.learn.optimise.solve import Solution, solve, solve_hierarchical, start_of
from mlnlite.learn.prior import Hierarchical, Penalty, Prior, penalty_of, prior_of_each
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import closed
from mlnlite.model.model import Model

if TYPE_CHECKING:
    from mlnlite.learn.objectives.margin import Labelled

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Task:
    """What is to be solved.

    Attributes:
        problem: the likelihood.
        labelled: for max-margin learning, the databases, equal ones once.
    """

    problem: Problem
    labelled: tuple[Labelled, ...] = ()


@dataclass(frozen=True, slots=True)
class Search:
    """How to look for the best weights.

    Attributes:
        start: shape (n_weights,), where to start; None for 0.
        seed: of what is drawn.
        deadline: when to stop with the best so far.
    """

    start: Float | None
    seed: int
    deadline: Deadline


def task_of(model: Model, databases: Evidence, how: How, targets: frozenset[str], engine: Engine | None) -> Task:
    """What learning solves; the model is expanded."""
    n_weights = sum(len(t.weights) for t in model.templates)
    tied, worth = tied_of(model, how.tied), worth_of(databases, how.database_weights)
    if how.objective == "pseudo-likelihood":
        parts = pseudo_listed(model, databases, targets, engine)
        return Task(problem_of(model, merged(parts, n_weights, worth=worth), tied=tied))
    unknown = frozenset(how.open_predicates)
    found = compiled(without_weights(model), databases, targets, unknown, how.objective, engine)
    every = merged(found.every, n_weights, worth=worth)
    constant = float((found.constant if worth is None else found.constant * worth).sum())
    every = replace(every, constant=every.constant + constant, n_choices=found.n_choices)
    times = np.ones(databases.n_databases) if worth is None else worth
    wide = tuple(replace(w, times=float(times[w.database])) for w in found.wide)
    problem = problem_of(model, every, merged(found.known, n_weights, worth=worth), _once(wide), tied)
    return Task(problem, _labelled(found.labels, times) if how.objective == "max-margin" else ())


def _once(wide: Sequence[Wide]) -> tuple[Wide, ...]:
    """Equal databases once, counted as often as they are there."""
    found: dict[tuple[int, int], Wide] = {}
    for one in wide:
        key = id(one.every), id(one.known)
        found[key] = replace(one, times=one.times + (found[key].times if key in found else 0.0))
    return tuple(found.values())


def _labelled(labels: Sequence[tuple[Labels, int]], times: Float) -> tuple[Labelled, ...]:
    """The databases of max-margin learning, equal ones once."""
    from mlnlite.learn.objectives.margin import labelled_network  # late: most learning needs no most probable worlds

    found: dict[int, tuple[Labels, int, float]] = {}
    for (one, n), many in zip(labels, times.tolist(), strict=True):
        found[id(one)] = one, n, many + (found[id(one)][2] if id(one) in found else 0.0)
    return tuple(labelled_network(one.network, one.values, n, many) for one, n, many in found.values())


def worth_of(databases: Evidence, weights: Sequence[float] | None) -> Float | None:
    """How much each database counts; None for 1.

    Raises:
        QueryMistake: if there is not one positive number for each.
    """
    if weights is None:
        return None
    worth = np.array(weights, float)
    if len(worth) != databases.n_databases or not (worth > 0).all():
        n = databases.n_databases
        raise QueryMistake(f"there are {n} databases, and as many positive weights are needed, found {list(weights)}")
    return worth


def tied_of(model: Model, groups: Sequence[Sequence[str]]) -> Int64 | None:
    """For each weight the first one that it is tied to; None if there are no groups.

    Args:
        model: expanded.
        groups: names (`formula 2`) or texts of formulas; row by row their weights are the same.

    Raises:
        QueryMistake: if a formula is unknown, or has another number of weights, or is not to be learnt.
    """
    if not groups:
        return None
    sizes = [len(t.weights) for t in model.templates]
    first = np.cumsum([0, *sizes])
    tied = np.arange(first[-1])
    for group in groups:
        members = [_template(model, name) for name in group]
        for m in members:
            if sizes[m] != sizes[members[0]]:
                raise QueryMistake(f"{group[0]} and {model.templates[m].name} have different numbers of weights")
            tied[first[m] : first[m + 1]] = tied[first[members[0]] : first[members[0] + 1]]
    return tied


def _template(model: Model, name: str) -> int:
    for i, template in enumerate(model.templates):
        if name in (template.name, template.text):
            if template.hard or template.fixed:
                raise QueryMistake(f"{name} has a weight that is not learnt, so it cannot be tied")
            return i
    raise QueryMistake(f"there is no formula {name!r} to tie", "say `formula 2`, or the formula as the model writes it")


def pseudo_listed(model: Model, databases: Evidence, targets: frozenset[str], engine: Engine | None) -> list[Listed]:
    """The choices of the pseudo-likelihood one by one; the model is expanded."""
    evidence = closed(databases, databases.predicates)

    def load(some: Evidence) -> Run:
        return (engine or engine_for()).load({**tables_of(some), **row_tables(model)})

    first = np.cumsum([0, *(len(t.weights) for t in model.templates)])
    wide = {i: t for i, t in enumerate(model.templates) if ranges_widely(t, databases)}
    others = {i: t for i, t in enumerate(model.templates) if i not in wide}
    found = entries(others, first, evidence, load, targets)
    for i, template in wide.items():
        with blamed(template):
            more = counted_entries(model, i, databases, targets, engine)
        found = {name: [*parts, *more[name]] for name, parts in found.items()}
    every = {name: joined(parts, int(first[-1])) for name, parts in found.items()}
    return listed(every, evidence, int(first[-1]))


def pseudo_problem(model: Model, databases: Evidence, targets: frozenset[str], engine: Engine | None = None) -> Problem:
    """The pseudo-likelihood; the model is expanded."""
    n_weights = sum(len(t.weights) for t in model.templates)
    return problem_of(model, merged(pseudo_listed(model, databases, targets, engine), n_weights))


# --- solving


def solved(model: Model, task: Task, prior: Prior | None, search: Search) -> Solution:
    """The best weights: by Newton's method, or cutting planes, or sampling where the likelihood is too wide.

    Raises:
        QueryMistake: if the prior does not fit the objective.
    """
    penalty, priors, problem = penalty_of(prior, model.templates), prior_of_each(prior, model.templates), task.problem
    start = start_of(problem) if search.start is None else search.start[problem.free]
    if task.labelled:
        return _widest(task, penalty, search)
    hierarchical = any(isinstance(p, Hierarchical) for p in priors)
    groups = [(p, len(t.weights)) for p, t in zip(priors, model.templates, strict=True)]
    try:
        if hierarchical:
            return solve_hierarchical(problem, penalty, groups, search.deadline, start)
        return solve(problem, penalty, search.deadline, start)
    except LimitReached as reason:
        if hierarchical or penalty.l1.any():
            raise QueryMistake(f"{reason}; it can be sampled", "with a Gaussian or Cauchy prior, or none") from None
    return _sampled(problem, penalty, start, search)


def _sampled(problem: Problem, penalty: Penalty, start: Float, search: Search) -> Solution:
    from mlnlite.learn.objectives.sampled import sampled  # late: most learning draws nothing

    found = sampled(problem, penalty.of(problem.free), start, search.seed, search.deadline)
    optimum = Optimum(found.x, np.nan, found.gradient, found.rounds, found.status, ())
    none = np.zeros(len(found.x), np.int8)
    return Solution(optimum, none, penalty, found.error, "largest gradient entry, sampled,")


def _widest(task: Task, penalty: Penalty, search: Search) -> Solution:
    from mlnlite.learn.objectives.margin import widest

    problem = task.problem
    own = penalty.of(problem.free)
    found = widest(list(task.labelled), own, problem.share, problem.weights, search.seed, search.deadline)
    optimum = Optimum(found.x, -found.slack, found.gap, found.cuts, found.status, ())
    return Solution(optimum, np.zeros(len(found.x), np.int8), penalty, None, "gap to the best")
