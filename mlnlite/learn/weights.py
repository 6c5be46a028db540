"""Databases to weights: the entry function `learn`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from time import monotonic
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Engine
from mlnlite.errors import Diagnostic, QueryMistake, did_you_mean
from mlnlite.ground.ground import verify_same_vocabulary
from mlnlite.infer.deadline import in_seconds, interruptible
from mlnlite.learn.data.missing import is_incomplete
from mlnlite.learn.learned import How, LearnedModel, Objective
from mlnlite.learn.objectives.choose import Search, solved, task_of
from mlnlite.learn.optimise.problem import Problem, log_likelihood
from mlnlite.learn.optimise.solve import BOUND, GRADIENT, Solution
from mlnlite.learn.prior import PRIOR_SD, Prior, prior_of, verify_prior
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model


def learn(  # noqa: PLR0913
    model: Model,
    databases: Evidence,
    *,
    objective: Objective | None = None,
    predict: Iterable[str] | None = None,
    open_predicates: Iterable[str] = (),
    prior: Prior | float | None = PRIOR_SD,
    tied: Sequence[Sequence[str]] = (),
    database_weights: Sequence[float] | None = None,
    resume: bool = False,
    seed: int = 0,
    time_limit: float | None = None,
    engine: Engine | None = None,
) -> LearnedModel:
    """Weights that make the databases most likely.

    An atom that is not a fact is false, unless it is marked `?` or open. By default the pseudo-likelihood is maximised
    (Besag 1975; Richardson and Domingos 2006), or where atoms are unknown, the likelihood of what is known.

    Args:
        model: its weights are ignored, except fixed ones and hard formulas.
        databases: the data.
        objective: `pseudo-likelihood`; `likelihood`, of all that is predicted together; `composite`, of pairs of atoms
            that share a formula; `max-margin`: the data are to beat other worlds by the number of atoms that differ.
        predict: predicates that are predicted, the others being conditions (conditional likelihood); by default all.
        open_predicates: predicates whose atoms are unknown where they are not facts; with `likelihood` only.
        prior: of the weights; a number is the standard deviation of a Gaussian with mean 0, None is no prior.
        tied: groups of formulas, by name (`formula 2`) or text, that have the same weights.
        database_weights: shape (n_databases,), how often each database counts; by default once.
        resume: start with the weights that the model has.
        seed: of sampling and of searches.
        time_limit: seconds after which to stop with the best weights so far, as Ctrl-C does.
        engine: what runs the counting joins; by default chosen by size.

    Raises:
        QueryMistake, ModelMistake: if the arguments do not fit, or there is nothing to learn.
        Contradiction, EvidenceMistake: the data violate a hard formula, lack a block's value, or have probabilities.
    """
    deadline, prior, start = in_seconds(time_limit), prior_of(prior), monotonic()
    how = how_of(model, databases, objective, (predict, open_predicates), tied, database_weights)
    verify_prior(prior, model.templates, how.objective)
    model = replace(model, templates=tuple(t.expanded(databases.types) for t in model.templates))
    with interruptible(deadline):
        task = task_of(model, databases, how, predicates_named(model, how.predict, "predict"), engine)
        counted = monotonic()
        solution = solved(model, task, prior, Search(_start(model) if resume else None, seed, deadline))
    learned = _learned(with_constants(model, databases), task.problem, solution)
    seconds = {"count": counted - start, "solve": monotonic() - counted}
    return replace(learned, prior=prior, objective=_title(how), how=how, seconds=seconds)


def how_of(
    model: Model,
    databases: Evidence,
    objective: str | None,
    names: tuple[Iterable[str] | None, Iterable[str]],
    tied: Sequence[Sequence[str]],
    database_weights: Sequence[float] | None,
) -> How:
    """What is to be learnt, as the learnt model remembers it; `names` are those of what is predicted and open."""
    verify_same_vocabulary(model, databases)
    predict = None if names[0] is None else predicates_named(model, names[0], "predict")
    unknown = opened(model, names[1])
    return How(
        _objective(objective, unknown, model, databases, predicates_named(model, predict, "predict")),
        None if predict is None else tuple(sorted(predict)),
        tuple(sorted(unknown)),
        tuple(map(tuple, tied)),
        None if database_weights is None else tuple(database_weights),
    )


def _start(model: Model) -> NDArray[np.float64]:
    """The weights that a model has; 0 where it has none."""
    given = np.concatenate([np.empty(0), *(t.weights for t in model.templates)])
    return np.where(np.isfinite(given), given, 0.0)


def _title(how: How) -> str:
    """`conditional pseudo-log-likelihood`."""
    names = {"composite": "composite log-likelihood", "max-margin": "margin (minus the slack)"}
    name = names.get(how.objective, how.objective.replace("likelihood", "log-likelihood"))
    return name if how.predict is None else f"conditional {name}"


def _objective(
    given: str | None, unknown: frozenset[str], model: Model, databases: Evidence, targets: frozenset[str]
) -> Objective:
    """The objective: by default the cheapest that can take the data.

    Raises:
        QueryMistake: if there is no such objective, or it needs complete data.
    """
    incomplete = is_incomplete(model, databases, targets) or bool(unknown)
    choices: tuple[Objective, ...] = get_args(Objective)
    chosen = next((c for c in choices if c == given), None) if given else choices[incomplete]
    if chosen is None:
        hint = did_you_mean(given or "", choices) or f"there are {', '.join(choices)}"
        raise QueryMistake(f"there is no objective {given}", hint)
    if incomplete and chosen != "likelihood":
        what = ", ".join(sorted(unknown)) if unknown else "marked `?`, or of `P(x, y!)` without a value"
        hint = 'say objective="likelihood" (`--objective likelihood`), and predict only what the model is for'
        raise QueryMistake(f"unknown atoms ({what}) need the likelihood, not the {chosen}", hint)
    return chosen


def with_constants(model: Model, databases: Evidence) -> Model:
    """A model with the types of the learnt one: the databases' constants come in where there is a weight for each."""
    keys = {t.formula.variables[k].type for t in model.templates for k in t.keys}
    return replace(model, types={n: databases.types[n] if n in keys else t for n, t in model.types.items()})


def opened(model: Model, names: Iterable[str]) -> frozenset[str]:
    """Predicates to leave open.

    Raises:
        QueryMistake: if there is none of a name, or its declaration closes its world.
    """
    found = predicates_named(model, frozenset(names), "leave open")
    for name in sorted(n for n in found if model.predicates[n].closed):
        hint = "remove the star from its declaration"
        raise QueryMistake(f"{name} cannot be left open: {model.predicates[name]} has a closed world", hint)
    return found


def predicates_named(model: Model, given: Iterable[str] | None, what: str) -> frozenset[str]:
    """The predicates of these names, by default all.

    Raises:
        QueryMistake: if there is none of a name.
    """
    all_names = (n for n, p in model.predicates.items() if p.comparison is None)
    names = frozenset(all_names if given is None else given)
    for name in sorted(names - set(model.predicates)):
        hint = did_you_mean(name, list(model.predicates))
        raise QueryMistake([Diagnostic("E510", f"there is no predicate {name} to {what}", hint=hint)])
    return names


def _learned(model: Model, problem: Problem, solution: Solution) -> LearnedModel:
    optimum, measured = solution.optimum, solution.measure != GRADIENT
    unbounded = np.zeros(len(problem.weights), np.int8)
    shared = np.asarray(np.diff(problem.share.indptr) > 0)
    unbounded[shared] = (problem.share @ solution.unbounded)[shared]
    unsupported = problem.learnable & ~shared
    weights = np.where(unsupported, solution.penalty.mean, problem.all_weights(optimum.x))
    error = np.zeros(len(weights)) if solution.error is None else problem.share @ solution.error
    parts = np.split(weights, np.cumsum([len(t.weights) for t in model.templates])[:-1])
    templates = tuple(replace(t, weights=part) for t, part in zip(model.templates, parts, strict=True))
    return LearnedModel(
        model=replace(model, templates=templates),
        objective="",
        value=optimum.value if measured else log_likelihood(problem, optimum.x)[0],
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
        measure=solution.measure,
        monte_carlo=np.asarray(error),
        how=How(),
        problem=problem,
        penalty=solution.penalty,
    )
