"""Databases to rules: candidates along the paths of the data, chosen by score tests, refitted, pruned.

All candidates are counted at once and share one list of choices; adding one costs a gradient, a column of the Hessian
and a refit from the last weights. A rule is added while its score test beats what the Bayesian information criterion
asks for another weight and, corrected for the number of candidates, the false-discovery rate; rules whose Wald
statistic falls below that when others have come are dropped again. (Rao 1948; Schwarz 1978; Benjamini, Hochberg 1995.)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.stats import chi2

from mlnlite.errors import QueryMistake
from mlnlite.learn.data.merge import Choices
from mlnlite.learn.data.missing import is_incomplete
from mlnlite.learn.evaluation.evaluate import target_names
from mlnlite.learn.objectives.choose import pseudo_problem
from mlnlite.learn.optimise import information
from mlnlite.learn.optimise.problem import Problem
from mlnlite.learn.optimise.solve import best
from mlnlite.learn.prior import Penalty
from mlnlite.learn.structure.candidates import Language, candidates, rule_text
from mlnlite.learn.structure.impute import Hidden, completions, hidden, problem_with
from mlnlite.learn.structure.modes import Mode, modes_of
from mlnlite.learn.weights import opened
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import AtomRef
from mlnlite.model.model import Model
from mlnlite.model.read import model_from_text
from mlnlite.model.unparse import model_text
from mlnlite.syntax import tree
from mlnlite.syntax.write import write_formula

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]

PRECISION = 0.04
"""Of the Gaussian prior of each weight during the search: standard deviation 5."""

FALSE_DISCOVERIES = 0.05


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule that was found.

    Attributes:
        text: as a model writes it.
        weight: its weight among the others.
        score: of the score test when it was added.
        p_value: of the same, for one candidate.
        stability: in which share of bootstrap samples it is found.
    """

    text: str
    weight: float
    score: float
    p_value: float
    stability: float


@dataclass(frozen=True, slots=True)
class Structure:
    """Rules that were found.

    Attributes:
        rules: the best first.
        model: the model with the rules.
        n_candidates: how many rules were tried.
    """

    rules: tuple[Rule, ...]
    model: Model
    n_candidates: int

    def __str__(self) -> str:
        """A table."""
        lines = [f"{'score':>9}  {'p':>8}  {'stable':>6}  rule"]
        lines += [f"{r.score:9.1f}  {r.p_value:8.1e}  {100 * r.stability:5.0f}%  {r.text}" for r in self.rules]
        return "\n".join([*lines, f"{len(self.rules)} of {self.n_candidates:,} candidates"])


def find_rules(  # noqa: PLR0913
    model: Model,
    databases: Evidence,
    *,
    predict: Iterable[str],
    given: Iterable[str] | None = None,
    open_predicates: Iterable[str] = (),
    most_literals: int = 2,
    most_rules: int = 20,
    resamples: int = 20,
    seed: int = 0,
) -> Structure:
    """Rules that explain some predicates by others.

    Unknown atoms are drawn from the rules found so far, given what is known, and do not count as examples.

    Args:
        model: the vocabulary, and formulas that are kept.
        databases: the data.
        predict: predicates that rules conclude, by name or as modes such as `method(+, #)`.
        given: predicates that rules may ask about, by name or as modes such as `Friends(+, -)`; by default all. A sign
            says what an argument is: `+` a variable that stands in the head or further left, `-` such a variable or a
            new one, `#` a constant (a rule for each). By name, variables stand everywhere, one new one at most.
        open_predicates: predicates whose atoms are unknown where they are not facts.
        most_literals: of a rule's body.
        most_rules: how many to add.
        resamples: bootstrap samples for the stability of the rules; atoms are drawn, as if independent.
        seed: of the bootstrap, and of what is drawn for unknown atoms.

    Raises:
        QueryMistake: if there is no candidate, or a mode does not fit.
    """
    heads = modes_of(predict, model.predicates)
    every = (name for name, predicate in model.predicates.items() if predicate.comparison is None)
    bodies = modes_of(every if given is None else given, model.predicates)
    model = _with_constants(model, databases, [*heads, *bodies])
    targets = target_names(databases, {mode.predicate: None for mode in heads})
    unknown = opened(model, open_predicates)
    language = Language(model.predicates, databases.types, heads, bodies)
    rules = tuple(rule_text(rule, model.dialect) for rule in candidates(language, most_literals))
    if not rules:
        raise QueryMistake("there is no rule to try", "name more predicates, or allow longer bodies")
    kept = _with_units(model, targets)
    task = _Task(_with_rules(kept, rules), rules, frozenset(targets), most_rules)
    if unknown or is_incomplete(task.every, databases, targets):
        found = _search_incomplete(task, hidden(task.every, databases, unknown), np.random.default_rng(seed))
    else:
        found = _search(task, pseudo_problem(_expanded(task.every, databases), databases, task.targets))
    rated = _rated(found, _stability(task, found.problem, (resamples, seed)))
    return Structure(rated, _with_rules(kept, list(found.rules)), len(rules))


@dataclass(frozen=True, slots=True)
class _Task:
    """What is looked for: a model with all rules, the rules, what they conclude, and how many are wanted at most."""

    every: Model
    rules: tuple[str, ...]
    targets: frozenset[str]
    most_rules: int


def _expanded(model: Model, databases: Evidence) -> Model:
    return replace(model, templates=tuple(t.expanded(databases.types) for t in model.templates))


def _with_constants(model: Model, databases: Evidence, modes: Sequence[Mode]) -> Model:
    """A model that has the constants that rules may name in the order of the databases."""
    of = {m.predicate: model.predicates[m.predicate].types for m in modes}
    named = {t for m in modes for t, sign in zip(of[m.predicate], m.signs, strict=True) if sign == "#"}
    return replace(model, types={n: databases.types[n] if n in named else t for n, t in model.types.items()})


def _with_rules(model: Model, rules: Sequence[str]) -> Model:
    """A model with more formulas."""
    return model_from_text("\n".join([model_text(model), *rules]), dialect=model.dialect)


def _with_units(model: Model, names: Iterable[str]) -> Model:
    """A model in which some formula says how frequent each of the predicates is."""
    return _with_rules(model, [_unit(model, name) for name in names if not _has_unit(model, name)])


def _columns(task: _Task, problem: Problem) -> dict[int, str]:
    """The columns of the problem that are rules; those have the last weights, and some may not matter."""
    first = len(problem.weights) - len(task.rules)
    return {j: task.rules[w - first] for j, w in enumerate(problem.free.tolist()) if w >= first}


def _unit(model: Model, name: str) -> str:
    """The formula that says how frequent a predicate is."""
    predicate = model.predicates[name]
    terms = tuple(tree.Variable(f"x{i}", plus=i == predicate.value) for i in range(predicate.arity))
    return write_formula(tree.Atom(name, terms), model.dialect)


def _has_unit(model: Model, name: str) -> bool:
    """Whether the model has a formula that is a single atom of a predicate."""
    return any(
        isinstance(t.formula.body, AtomRef) and t.formula.atoms[t.formula.body.index].predicate == name
        for t in model.templates
    )


def _stability(task: _Task, problem: Problem, samples: tuple[int, int]) -> dict[str, float]:
    """In which share of bootstrap samples (their number, seed) each rule is found."""
    n, seed = samples
    random, share = np.random.default_rng(seed), dict.fromkeys(task.rules, 0.0)
    for _ in range(n):
        for text in _search(task, _resampled(problem, random)).rules:
            share[text] += 1 / n
    return share


def _resampled(problem: Problem, random: np.random.Generator) -> Problem:
    """The problem with choices drawn again."""
    found = problem.every
    n = int(found.many.sum())
    many = random.multinomial(n, found.many / found.many.sum()).astype(float)
    return replace(problem, every=replace(found, many=many))


# --- the search


@dataclass(frozen=True, slots=True)
class _Found:
    """Rules that were chosen, with their columns and scores; the problem, and the weights of all its columns."""

    rules: dict[str, tuple[int, float]]
    problem: Problem
    x: Float


def _rated(found: _Found, stable: Mapping[str, float]) -> tuple[Rule, ...]:
    """The rules with what is known of them."""
    every = found.rules.items()
    return tuple(Rule(text, float(found.x[j]), s, float(chi2.sf(s, 1)), stable[text]) for text, (j, s) in every)


def _search_incomplete(task: _Task, unknown: Hidden, random: np.random.Generator) -> _Found:
    """Rule by rule: what is unknown is drawn from a model with the rules found so far."""
    every = _expanded(task.every, unknown.databases)
    templates = _expanded(_with_units(task.every, sorted(unknown.names)), unknown.databases).templates
    first, end = len(every.templates) - len(task.rules), len(every.templates)
    scores: dict[str, float] = {}
    for _ in range(task.most_rules):
        chosen = tuple(t for t in templates[first:end] if t.text in scores)
        model = replace(every, templates=(*templates[:first], *chosen, *templates[end:]))
        drawn = completions(unknown, model, task.targets, random)
        step = replace(task, most_rules=len(scores) + 1)
        found = _search(step, problem_with(unknown, every, drawn, task.targets), scores)
        new = found.rules.keys() - scores.keys()
        scores = {text: score for text, (_, score) in found.rules.items()}
        if not new:
            break
    return found


def _search(task: _Task, problem: Problem, start: Mapping[str, float] = MappingProxyType({})) -> _Found:
    """Adds rules to those to start with (and their scores)."""
    n, tried = problem.every.rows.shape[1], _columns(task, problem)
    fixed = [j for j in range(n) if j not in tried]
    needed = max(float(np.log(max(2.0, problem.every.many.sum()))), _threshold(len(tried)))
    chosen = {j: start[text] for j, text in tried.items() if text in start}
    x = _fitted(problem, [*fixed, *chosen], np.zeros(n))
    while len(chosen) < task.most_rules:
        scores = _scores(problem.every, x, [*fixed, *chosen])
        scores[[*fixed, *chosen]] = 0.0
        column = int(scores.argmax())
        if scores[column] <= needed:
            break
        chosen[column] = float(scores[column])
        x = _fitted(problem, [*fixed, *chosen], x)
        weak = _weak(problem.every, x, fixed, chosen, needed)
        if column in weak:
            del chosen[column]
            x = _fitted(problem, [*fixed, *chosen], x)
            break
        if weak:
            chosen = {j: s for j, s in chosen.items() if j not in weak}
            x = _fitted(problem, [*fixed, *chosen], x)
    return _Found({tried[j]: (j, score) for j, score in chosen.items()}, problem, x)


def _threshold(n_candidates: int) -> float:
    """Chi-squared value that the best of this many candidates passes by chance with the rate allowed."""
    return float(chi2.isf(FALSE_DISCOVERIES / max(1, n_candidates), 1))


def _fitted(problem: Problem, columns: Sequence[int], start: Float) -> Float:
    """The best weights of some columns, the others 0."""
    chosen = np.array(sorted(columns), np.int64)
    x = np.zeros(len(start))
    if not len(chosen):
        return x
    rows = sparse.csr_array(problem.every.rows[:, chosen])
    part = replace(problem, every=replace(problem.every, rows=rows), free=problem.free[chosen])
    none = np.zeros(len(chosen))
    x[chosen] = best(part, Penalty(none, none + PRECISION, none, none), start[chosen], None).x
    return x


def _scores(found: Choices, x: Float, active: Sequence[int]) -> Float:
    """Score statistic of each column, the active ones being at their best."""
    at = np.array(sorted(active), np.int64)
    slope = np.asarray(found.many @ information.expected_rows(found, x))
    diagonal, coupled = information.columns(found, x, at)
    inverse = np.linalg.pinv(coupled[at] + PRECISION * np.eye(len(at)), hermitian=True)
    left = diagonal - np.einsum("ij,jk,ik->i", coupled, inverse, coupled)
    usable = left > 1e-6 * np.maximum(diagonal, 1.0)
    return np.asarray(np.where(usable, slope**2 / np.where(usable, left, 1.0), 0.0))


def _weak(found: Choices, x: Float, fixed: Sequence[int], chosen: dict[int, float], needed: float) -> set[int]:
    """Chosen columns whose Wald statistic is too small."""
    at = np.array(sorted([*fixed, *chosen]), np.int64)
    part = replace(found, rows=sparse.csr_array(found.rows[:, at]))
    bend = np.asarray(information.hessian(part, x[at]).todense(), float)
    variance = np.linalg.pinv(bend + PRECISION * np.eye(len(at)), hermitian=True).diagonal()
    wald = dict(zip(at.tolist(), (x[at] ** 2 / np.maximum(variance, 1e-300)).tolist(), strict=True))
    return {j for j in chosen if wald[j] < needed}
