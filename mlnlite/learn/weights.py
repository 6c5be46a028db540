"""Databases to weights: the entry function `learn`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from time import monotonic
from typing import Literal, get_args

import numpy as np

from mlnlite.engines.choose import engine_for
from mlnlite.engines.plan import Engine
from mlnlite.errors import Diagnostic, QueryMistake, did_you_mean
from mlnlite.ground.ground import row_tables
from mlnlite.ground.tables import tables_of
from mlnlite.learn.choices import listed
from mlnlite.learn.counts import entries
from mlnlite.learn.exact import compiled
from mlnlite.learn.learned import How, LearnedModel, Objective
from mlnlite.learn.merge import Listed, merged
from mlnlite.learn.prior import PRIOR_SD, Hierarchical, Prior, penalty_of, prior_of, prior_of_each
from mlnlite.learn.problem import Problem, log_likelihood, problem_of
from mlnlite.learn.solve import BOUND, Solution, solve, solve_hierarchical
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import closed
from mlnlite.model.model import Model
from mlnlite.model.symbols import Type


def learn(
    model: Model,
    databases: Evidence,
    *,
    objective: Objective = "pseudo-likelihood",
    predict: Iterable[str] | None = None,
    open_predicates: Iterable[str] = (),
    prior: Prior | float | None = PRIOR_SD,
    time_limit: float | None = None,
    engine: Engine | None = None,
) -> LearnedModel:
    """Weights that make the databases most likely.

    The databases are complete but for the open predicates: an atom that is not a fact is false. By default each atom,
    or block, is predicted from all others (pseudo-likelihood: Besag 1975; Richardson and Domingos 2006).

    Args:
        model: its weights are ignored, except fixed ones and hard formulas.
        databases: the data.
        objective: `pseudo-likelihood`; `likelihood`, of all that is predicted together, by listing or elimination;
            `composite`, of pairs of atoms that share a formula, given the rest.
        predict: predicates whose atoms are predicted; the others are only conditions (conditional likelihood). By
            default all.
        open_predicates: predicates whose atoms are unknown where they are not facts; with `likelihood` only.
        prior: of the weights; a number is the standard deviation of a Gaussian with mean 0, None is no prior.
        time_limit: seconds after which to stop with the best weights so far.
        engine: what runs the counting joins; by default chosen by size.

    Raises:
        QueryMistake, ModelMistake: if the arguments do not fit, or there is nothing to learn.
        Contradiction: if the data violate a hard formula.
        EvidenceMistake: if a block that must have a value has none.
        LimitReached: if the likelihood is too wide for elimination.
    """
    deadline = None if time_limit is None else monotonic() + time_limit
    prior, start = prior_of(prior), monotonic()
    targets, unknown = _names(model, predict, "predict"), _names(model, frozenset(open_predicates), "leave open")
    _verify(objective, unknown)
    model = replace(model, templates=tuple(t.expanded(databases.types) for t in model.templates))
    found = (
        pseudo_problem(model, databases, targets, engine)
        if objective == "pseudo-likelihood"
        else _exact_problem(model, databases, targets, unknown, objective, engine)
    )
    counted = monotonic()
    solution = _solved(model, found, prior, deadline)
    learned = _learned(replace(model, types=_types(model, databases)), found, solution)
    seconds = {"count": counted - start, "solve": monotonic() - counted}
    how = How(objective, None if predict is None else tuple(sorted(targets)), tuple(sorted(unknown)))
    return replace(learned, prior=prior, objective=_title(objective, predict is not None), how=how, seconds=seconds)


def _title(objective: Objective, conditional: bool) -> str:
    """`conditional pseudo-log-likelihood`."""
    name = "composite log-likelihood" if objective == "composite" else objective.replace("likelihood", "log-likelihood")
    return f"conditional {name}" if conditional else name


def _verify(objective: str, unknown: frozenset[str]) -> None:
    choices = get_args(Objective)
    if objective not in choices:
        hint = did_you_mean(objective, choices) or f"there are {', '.join(choices)}"
        raise QueryMistake(f"there is no objective {objective}", hint)
    if unknown and objective != "likelihood":
        hint = 'say objective="likelihood" (`--objective likelihood`), and predict only what the model is for'
        raise QueryMistake(f"unknown atoms ({', '.join(sorted(unknown))}) need the exact likelihood", hint)


def _types(model: Model, databases: Evidence) -> dict[str, Type]:
    """The types of the learnt model: the constants of the databases come in where there is a weight for each."""
    keys = {t.formula.variables[k].type for t in model.templates for k in t.keys}
    return {name: databases.types[name] if name in keys else t for name, t in model.types.items()}


def _names(model: Model, given: Iterable[str] | None, what: str) -> frozenset[str]:
    all_names = (n for n, p in model.predicates.items() if p.comparison is None)
    names = frozenset(all_names if given is None else given)
    for name in sorted(names - set(model.predicates)):
        hint = did_you_mean(name, list(model.predicates))
        raise QueryMistake([Diagnostic("E510", f"there is no predicate {name} to {what}", hint=hint)])
    return names


# --- problems


def pseudo_listed(model: Model, databases: Evidence, targets: frozenset[str], engine: Engine | None) -> list[Listed]:
    """The choices of the pseudo-likelihood one by one; the model is expanded."""
    evidence = closed(databases, databases.predicates)
    tables = {**tables_of(evidence), **row_tables(model)}
    found = entries(model.templates, evidence, (engine or engine_for(tables)).load(tables), targets)
    return listed(found, evidence, sum(len(t.weights) for t in model.templates))


def pseudo_problem(model: Model, databases: Evidence, targets: frozenset[str], engine: Engine | None = None) -> Problem:
    """The pseudo-likelihood; the model is expanded."""
    n_weights = sum(len(t.weights) for t in model.templates)
    return problem_of(model, merged(pseudo_listed(model, databases, targets, engine), n_weights))


def without_weights(model: Model) -> Model:
    """The model with all weights 0 that are learnt."""
    zero = (t if t.hard or t.fixed else replace(t, weights=np.zeros(len(t.weights))) for t in model.templates)
    return replace(model, templates=tuple(zero))


def _exact_problem(
    model: Model,
    databases: Evidence,
    targets: frozenset[str],
    unknown: frozenset[str],
    objective: Literal["likelihood", "composite"],
    engine: Engine | None,
) -> Problem:
    n_weights = sum(len(t.weights) for t in model.templates)
    found = compiled(without_weights(model), databases, targets, unknown, objective, engine)
    every = merged(found.every, n_weights)
    every = replace(every, constant=every.constant + found.constant, n_choices=found.n_choices)
    return problem_of(model, every, merged(found.known, n_weights), tuple(found.wide))


def _solved(model: Model, problem: Problem, prior: Prior | None, deadline: float | None) -> Solution:
    penalty, priors = penalty_of(prior, model.templates), prior_of_each(prior, model.templates)
    if not any(isinstance(p, Hierarchical) for p in priors):
        return solve(problem, penalty, deadline)
    groups = [(p, len(t.weights)) for p, t in zip(priors, model.templates, strict=True)]
    return solve_hierarchical(problem, penalty, groups, deadline)


def _learned(model: Model, problem: Problem, solution: Solution) -> LearnedModel:
    optimum, unbounded = solution.optimum, np.zeros(len(problem.weights), np.int8)
    unbounded[problem.free] = solution.unbounded
    unsupported = problem.learnable.copy()
    unsupported[problem.free] = False
    weights = np.where(unsupported, solution.penalty.mean, problem.weights)
    weights[problem.free] = optimum.x
    parts = np.split(weights, np.cumsum([len(t.weights) for t in model.templates])[:-1])
    templates = tuple(replace(t, weights=part) for t, part in zip(model.templates, parts, strict=True))
    return LearnedModel(
        model=replace(model, templates=templates),
        objective="",
        value=log_likelihood(problem, optimum.x)[0],
        prior=None,
        bound=BOUND,
        unbounded=unbounded,
        unsupported=unsupported,
        n_choices=problem.every.n_choices,
        status=optimum.status,
        gradient=optimum.gradient,
        iterations=optimum.iterations,
        seconds={},
        history=optimum.history,
        how=How(),
        problem=problem,
        penalty=solution.penalty,
    )
