"""The entry functions `marginal` and `map_state`: model, evidence and question in, a result out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mlnlite.engines.plan import Engine
from mlnlite.errors import QueryMistake
from mlnlite.ground.forecast import Limits
from mlnlite.ground.ground import NO_LIMITS, ground
from mlnlite.ground.groups import renamed
from mlnlite.ground.network import Network
from mlnlite.infer.approach import Approach, MarginalMethod
from mlnlite.infer.exact.marginal import WIDTH_LIMIT
from mlnlite.infer.lifting import Lifted, lifted_answers, with_lifted
from mlnlite.infer.marginal.ladder import solve
from mlnlite.infer.marginal.results import EVIDENCE, marginals_from
from mlnlite.infer.n_worlds import log_worlds, log_worlds_of
from mlnlite.infer.query import Question, atom_numbers, locate, question_of
from mlnlite.infer.score import cost, counts, n_paid
from mlnlite.model.evidence import Evidence
from mlnlite.model.facts import closed
from mlnlite.model.formulas import AtomRef, Expression
from mlnlite.model.model import Model
from mlnlite.model.propositional import Proposition, simplified
from mlnlite.results import MapState, Marginals, Statistics, Violation

if TYPE_CHECKING:
    from mlnlite.infer.map.cuts.waiting import Lazy
    from mlnlite.infer.map.ladder import BestWorld
    from mlnlite.infer.map.rungs import Method

Int64 = NDArray[np.int64]

LADDER = Approach()


def marginal(  # noqa: PLR0913
    model: Model,
    evidence: Evidence,
    query: str | Sequence[str] | None = None,
    *,
    closed_world: str | Iterable[str] = (),
    method: MarginalMethod = "auto",
    width_limit: int = WIDTH_LIMIT,
    precision: float = 0.005,
    time_limit: float | None = None,
    chains: int = 4,
    seed: int = 0,
    engine: Engine | None = None,
    limits: Limits = NO_LIMITS,
) -> Marginals:
    """Probabilities of atoms and formulas given evidence: exact wherever that is cheap, else with error bars.

    Args:
        model: a model with weights.
        evidence: one database. What it does not say is unknown.
        query: predicate names, atoms (with variables: all groundings), formulas; None for every atom that some
            formula leaves open.
        closed_world: predicates of which everything that is not a fact is false; "all" for all that the query does
            not mention (but functional predicates `!` without a known value stay open).
        method: "auto" (exact where it fits, else sampled), "exact" (or refuse), "lifted", "wmc" (model counting, exact,
            needs the extra `wmc`), "gibbs", "mcsat" or "tempering" for everything, or "bp" (approximate).
        width_limit: largest number of entries of a table in exact inference.
        precision: largest standard error of what is sampled; sampling stops when it is reached.
        time_limit: [s] for sampling, 60 by default; the result then says what is not as precise as asked. Also for
            "wmc", for ever by default.
        chains: how many are sampled, at least 2.
        seed: where the chance of sampling starts.
        engine: what runs the grounding plans; by default chosen by size.
        limits: what grounding may take; by default the machine's memory.

    Raises:
        QueryMistake: if the query, or a closed world, does not fit the model.
        Contradiction: if no world satisfies the evidence and the hard formulas.
        LimitReached: if a formula needs more than the limits of grounding, or an exact answer was asked for and would
            need more than the limit.
    """
    start, must = perf_counter(), method == "lifted"
    approach = Approach("exact" if must else method, width_limit, precision, time_limit, chains, seed)
    question, evidence = closed_and_asked(model, evidence, query, closed_world)
    if question is not None and method in ("auto", "lifted"):
        found = lifted_answers(model, evidence, question, must=must, width_limit=width_limit, limits=limits)
        if found is not None:
            return _with_rest(found, question, approach, (engine, limits), start)
    asked = ask(model, evidence, question, engine, limits)
    return marginals_for(asked.network, asked.question, approach, asked.seconds)


def _with_rest(
    found: Lifted, question: Question, approach: Approach, how: tuple[Engine | None, Limits], start: float
) -> Marginals:
    """What classes of constants answer, and the answer of a network to all else."""
    rest = replace(question, atoms=question.atoms[~found.rows])
    network = ground(found.model, found.evidence, query=rest.all_atoms, engine=how[0], limits=how[1])
    answer = marginals_for(network, rest, approach)
    names = [*_texts(found.evidence, question.atoms), *(f.text for f in question.formulas)]
    whole = with_lifted(found, answer, names)
    return replace(whole, statistics=replace(whole.statistics, seconds={"infer": perf_counter() - start}))


def marginals_for(
    network: Network,
    question: Question,
    approach: Approach = LADDER,
    ground_seconds: float = 0.0,
) -> Marginals:
    """Answers a question about a network; see `marginal`."""
    index, truth = locate(network, question.atoms)
    start = perf_counter()
    places, row = np.unique(index[index >= 0], return_inverse=True)
    expressions = [_over_network(f.expression, network) for f in question.formulas]
    solution = solve(network, places, expressions, approach)
    solution.log_z += log_worlds(network.evidence) - log_worlds_of(network)  # of all open atoms
    source = np.full(len(index) + len(expressions), -1, np.int64)
    source[: len(index)][index >= 0] = row.ravel()
    source[len(index) :] = len(places) + np.arange(len(expressions))
    seconds = {"ground": ground_seconds, "infer": perf_counter() - start}
    names = [*_texts(network.evidence, question.atoms), *(f.text for f in question.formulas)]
    return marginals_from(
        names,
        (source, truth),
        solution,
        Statistics(network.n_atoms, network.n_factors, solution.n_components, solution.largest_table, seconds),
        _blocks(network, index, len(names)),
    )


def map_state(  # noqa: PLR0913
    model: Model,
    evidence: Evidence,
    query: str | Sequence[str] | None = None,
    *,
    closed_world: str | Iterable[str] = (),
    method: Method = "auto",
    time_limit: float | None = None,
    seed: int = 0,
    gap: float = 0.0,
    margins: bool = False,
    why: bool = False,
    explain: str | None = None,
    engine: Engine | None = None,
    limits: Limits = NO_LIMITS,
) -> MapState:
    """A most probable world given evidence, with a bound that proves it or says how much better another could be.

    Args:
        model: a model with weights.
        evidence: one database. What it does not say is unknown.
        query: which atoms to show (the world is most probable as a whole); None for all that are open.
        closed_world: as in `marginal`.
        method: "auto" takes the cheapest that can; or "ve" (elimination), "mincut", "ilp" (HiGHS), "wcsp" (toulbar2),
            "maxsat" (RC2), "annealing", "maxwalksat".
        time_limit: [s] for the search.
        seed: of the search.
        gap: good enough is a world that costs at most this share more than the best one.
        margins: also find for each atom how much worse the best world is in which it is the other way round.
        why: also list the groundings that the world pays for.
        explain: an atom of which to show the best world in which it is the other way round.
        engine: what runs the grounding plans; by default chosen by size.
        limits: what grounding may take; by default the machine's memory.

    Raises:
        QueryMistake: if the query, or a closed world, does not fit the model, or an option means nothing.
        Contradiction: if no world satisfies the evidence and the hard formulas.
        LimitReached: if there is no answer within the limits.
    """
    from mlnlite.infer.map.rungs import verify

    verify(method=method, time_limit=time_limit, seed=seed, gap=gap)
    question, evidence = closed_and_asked(model, evidence, query, closed_world)
    asked = ask(model, evidence, question, engine, limits, waits=True)
    return map_state_for(
        asked.network, asked.question, method=method, time_limit=time_limit, seed=seed, gap=gap, margins=margins,
        why=why, explain=explain, lazy=asked.lazy, ground_seconds=asked.seconds,
    )  # fmt: skip


def map_state_for(  # noqa: PLR0913
    network: Network,
    question: Question,
    *,
    method: Method = "auto",
    time_limit: float | None = None,
    seed: int = 0,
    gap: float = 0.0,
    margins: bool = False,
    why: bool = False,
    explain: str | None = None,
    lazy: Lazy | None = None,
    ground_seconds: float = 0.0,
) -> MapState:
    """Answers a question about the most probable world of a network; see `map_state`."""
    if question.formulas:
        hint = "ask for atoms or predicates; the probability of a formula is a question for `marginal`"
        raise QueryMistake(f"the most probable world has atoms, not formulas: {question.formulas[0].text}", hint)
    from mlnlite.infer.deadline import in_seconds
    from mlnlite.infer.map.ladder import map_of
    from mlnlite.infer.map.rungs import Options

    start = perf_counter()
    if lazy is None:
        best = map_of(network, method=method, time_limit=time_limit, seed=seed, gap=gap)
    else:
        from mlnlite.infer.map.cuts.cuttingplanes import map_lazily

        lazy, best = map_lazily(lazy, Options(method, in_seconds(time_limit), seed, gap))
        network = lazy.network
    seconds = {"ground": ground_seconds, "infer": perf_counter() - start}
    state = state_of(network, question, best, seconds)
    if margins:
        index, _ = locate(network, question.atoms)
        state = replace(state, margins=_margins(network, best.truth, index, time_limit))
    if why or explain is not None:
        from mlnlite.infer.why import alternative, paid_groundings, paid_texts

        texts = paid_texts(network, n_paid(network, counts(network, best.truth)))
        state = replace(state, paid=tuple(paid_groundings(network, best.truth, texts)) if why else ())
        if explain is not None:
            state = replace(state, alternative=alternative(network, best.truth, explain, method, time_limit))
    return state


def state_of(network: Network, question: Question, best: BestWorld, seconds: Mapping[str, float]) -> MapState:
    """A world as an answer to a question."""
    index, truth = locate(network, question.atoms)
    truth[index >= 0] = best.truth[index[index >= 0]]
    methods = [best.component_method[best.component[i]] if i >= 0 else EVIDENCE for i in index.tolist()]
    true = counts(network, best.truth)
    violated = _violations(network, n_paid(network, true))
    return MapState(
        names=tuple(_texts(network.evidence, question.atoms)),
        truth=truth,
        methods=tuple(methods),
        log_weight=best.log_weight,
        bound=best.bound,
        status=best.status,
        cost=cost(network, true),
        open_cost=float(sum(v.cost for v in violated)),
        gap=best.gap,
        violated=violated,
        statistics=Statistics(
            network.n_atoms, network.n_factors, len(best.component_status), best.largest_table, seconds
        ),
        block=_blocks(network, index, len(index)),
    )


def _margins(network: Network, truth: NDArray[np.bool_], index: Int64, time_limit: float | None) -> NDArray[np.float64]:
    """What each row would lose if it were the other way round: infinity for known atoms."""
    from mlnlite.infer.map.maxmarginals import margins_of

    found = margins_of(network, truth, np.unique(index[index >= 0]), time_limit=time_limit)
    margins = np.full(len(index), np.inf)
    margins[index >= 0] = found[index[index >= 0]]
    return margins


# --- from the question to the network and back


@dataclass(frozen=True, slots=True)
class Asked:
    """A question with the network that answers it, and how long grounding took [s]."""

    question: Question
    network: Network
    seconds: float
    lazy: Lazy | None = None


def closed_and_asked(
    model: Model, evidence: Evidence, query: str | Sequence[str] | None, closed_world: str | Iterable[str]
) -> tuple[Question | None, Evidence]:
    """The question that texts mean, None for all open atoms, and the evidence with closed worlds; see `marginal`."""
    if closed_world != "all":
        evidence = _closed(evidence, closed_world)
    question = None if query is None else question_of(query, model, evidence, lasting=False)
    if closed_world == "all":
        asked = frozenset() if question is None else question.predicates
        evidence = closed(evidence, [n for n, p in evidence.predicates.items() if n not in asked and p.marker != "!"])
    return question, evidence


def ask(
    model: Model,
    evidence: Evidence,
    question: Question | None,
    engine: Engine | None,
    limits: Limits = NO_LIMITS,
    *,
    waits: bool = False,
) -> Asked:
    """Grounds what a question is about. `waits`: formulas of very many groundings may wait."""
    start = perf_counter()
    atoms, lazy = None if question is None else question.all_atoms, None
    if waits:
        from mlnlite.infer.map.cuts.waiting import without_lazy, worth_waiting

        waiting = worth_waiting(model, evidence)
        lazy = without_lazy(model, evidence, waiting, atoms, engine, limits) if waiting else None
    network = lazy.network if lazy else ground(model, evidence, query=atoms, engine=engine, limits=limits)
    question = question or Question(network.atoms, (), frozenset())
    return Asked(question, network, perf_counter() - start, lazy)


def _closed(evidence: Evidence, closed_world: str | Iterable[str]) -> Evidence:
    names = [closed_world] if isinstance(closed_world, str) else list(closed_world)
    for name in names:
        predicate = evidence.predicates.get(name)
        if predicate is not None and predicate.marker == "!":
            hint = f"give its value as a fact, or leave {name} open"
            raise QueryMistake(f"{predicate} always has a true value, so its world cannot be closed", hint)
    return closed(evidence, names) if names else evidence


def _texts(evidence: Evidence, numbers: Int64) -> list[str]:
    order = np.argsort(numbers, kind="stable")
    texts = np.empty(len(numbers), object)
    texts[order] = evidence.atom_texts(numbers[order])
    return [str(t) for t in texts]


def _blocks(network: Network, index: Int64, n_rows: int) -> Int64:
    """Variable of each row that is an atom of a block, else -1."""
    block = np.full(n_rows, -1, np.int64)
    rows = np.flatnonzero(index >= 0)
    variable = network.variable[index[rows]]
    block[rows] = np.where(network.block[variable], variable, -1)
    return block


def _over_network(expression: Expression, network: Network) -> Expression:
    """An expression over atom numbers as one over the atoms of the network, known ones put in."""
    numbers = np.array(sorted(set(atom_numbers(expression))), np.int64)
    index, truth = locate(network, numbers)
    known: dict[Proposition, bool] = {
        AtomRef(n): t for n, t, i in zip(numbers.tolist(), truth.tolist(), index.tolist(), strict=True) if i < 0
    }
    places = dict(zip(numbers.tolist(), index.tolist(), strict=True))
    return renamed(simplified(expression, known), places)


def _violations(network: Network, paid: Int64) -> tuple[Violation, ...]:
    """The soft formulas that a world pays for, in groundings that evidence leaves open."""
    from mlnlite.infer.why import paid_texts

    texts = paid_texts(network, paid)
    return tuple(Violation(text, int(paid[w]), float(network.weights[w])) for w, text in texts.items())
