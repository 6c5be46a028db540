"""The ladder of marginal inference: comes in a network and a question, goes out a number for each atom and formula.

Each component is answered by the cheapest way that is exact; what is too wide for that is sampled.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mlnlite.errors import LimitReached, QueryMistake
from mlnlite.ground.network import Bool, Float, Float32, Int64, Network
from mlnlite.infer.approach import BOUNDED, PATIENCE, SAMPLERS, Approach
from mlnlite.infer.deadline import in_seconds
from mlnlite.infer.exact.formula import formula_probabilities
from mlnlite.infer.exact.marginal import ELIMINATION, AtomProbabilities, Rung, marginals_of
from mlnlite.infer.exact.wmc import MODEL_COUNTING, count_models, is_available, is_mostly_hard, verify_available
from mlnlite.infer.query import atom_numbers
from mlnlite.infer.reduce.components import components_of
from mlnlite.infer.reduce.parts import Part, Summed
from mlnlite.infer.reduce.potentials import potentials_of
from mlnlite.infer.sample.columns import Columns, enter, no_answers
from mlnlite.model.formulas import Expression

_SHARE, _PART, _CHEAP, _FAIR, _FEW, _LEAST = 6, 10, 1 << 18, 1 << 22, 8, 0.001
"""Of the time, for model counting; of the precision, for what is left out; entries of first and second tables; few;
[s] for sampling if no time is left."""


@dataclass(slots=True)
class Solution:
    """Answers about atoms, then formulas, filled in step by step.

    Attributes:
        columns: the numbers.
        methods: how each was found.
        log_z: log partition function, nan if not known.
        n_components: of the network.
        largest_table: number of entries.
        endings: why each sampling stopped.
        traces: of sampling, see `Estimates`.
        draws: of each sampling: rows, and series of shape (n_chains, n_batches, n_rows).
    """

    columns: Columns
    methods: list[str]
    log_z: float = float("nan")
    n_components: int = 0
    largest_table: int = 0
    endings: list[str] = field(default_factory=list)
    traces: dict[str, Float] = field(default_factory=dict)
    draws: list[tuple[Int64, Float32]] = field(default_factory=list)


def solve(network: Network, atoms: Int64, formulas: Sequence[Expression], approach: Approach) -> Solution:
    """Answers a question.

    Args:
        network: what was ground.
        atoms: shape (n_atoms,), indices into `network.atoms`.
        formulas: expressions over such.
        approach: how.

    Raises:
        Contradiction: no world satisfies the hard formulas.
        LimitReached: an exact answer was asked for and is too wide.
        QueryMistake: a weight is not known.
    """
    asked = np.union1d(atoms, np.array(sorted({n for f in formulas for n in atom_numbers(f)}), np.int64)).astype(
        np.int64
    )
    solution = Solution(no_answers(len(atoms) + len(formulas)), [""] * (len(atoms) + len(formulas)))
    if formulas and approach.method == "bp":
        raise QueryMistake("belief propagation answers atoms only", hint="ask for `auto`, or for the atoms")
    if approach.method in SAMPLERS:
        everything = np.ones(network.n_variables, np.bool_)
        solution.n_components = int(components_of(network).max(initial=-1)) + 1
        _enter_sample(network, solution, everything, (atoms, formulas, np.arange(len(solution.methods))), approach)
        return solution
    network, small, found = _exactly(network, None if len(asked) == network.n_atoms else asked, approach)
    solution.log_z, solution.largest_table = found.log_z, found.largest_table
    solution.n_components = found.n_components
    methods = [found.method[a] for a in atoms.tolist()]
    _enter(solution, np.arange(len(atoms)), found.probability[atoms], found.slack[atoms], methods)
    _formulas_exactly(small, solution, found, (len(atoms), formulas), approach)
    if len(found.wide) > 1:
        atoms = _with_twins(network, found, atoms, np.isnan(solution.columns.probability[: len(atoms)]))
    jobs = sorted(_jobs(found, (atoms, formulas), np.flatnonzero(np.isnan(solution.columns.probability))), key=_n_rows)
    deadline = in_seconds(PATIENCE if approach.time_limit is None else approach.time_limit)
    for i, (components, rows) in enumerate(jobs):
        variables = np.zeros(network.n_variables, np.bool_)
        variables[network.variable[np.isin(found.component, components)]] = True
        limited = replace(approach, time_limit=max(deadline.left / (len(jobs) - i), _LEAST))
        _enter_sample(network, solution, variables, (atoms, formulas, rows), limited)
    return solution


def _exactly(network: Network, asked: Int64 | None, approach: Approach) -> tuple[Network, Network, AtomProbabilities]:
    """Elimination; where that is too wide, with pairs that are complete as counts, and what exclude each other merged.

    Returns:
        The network for sampling, that for exact answers, and the answers.
    """
    by_name, limit = _rung_by_name(approach), approach.width_limit
    if by_name is not None:
        found = marginals_of(network, asked, width_limit=1, too_wide="leave", rung=by_name)
        if found.wide:
            raise LimitReached("the time limit was reached", hint="give it more time, or ask for `auto`")
        return network, network, found
    found = marginals_of(network, asked, width_limit=limit, in_all=_CHEAP, too_wide="leave")
    if not found.wide:
        return network, network, found
    from mlnlite.ground.patterns import with_counts

    counted, rung = with_counts(network), _rung_for_wide(network, approach)
    for_sampling = counted
    if len(counted.counts) > len(network.counts) and _are_tangled(counted, found, limit):
        counted = network
    small, merged = _merged(counted, asked, found, approach, (limit, _FAIR))
    if merged is found and found.costly:  # nothing excludes each other, and larger tables may do
        merged = marginals_of(network, asked, width_limit=limit, too_wide="leave")
        if not merged.wide:
            return network, network, merged
    refuses = approach.method == "exact"
    if merged.wide and (refuses or rung is not None or merged.costly or len(counted.counts) > len(network.counts)):
        found = marginals_of(counted, asked, width_limit=limit, too_wide="leave", rung=rung)
        small, merged = _merged(counted, asked, found, approach, (limit, None))
    if refuses and merged.wide:
        marginals_of(counted, asked, width_limit=limit, rung=rung)
    return for_sampling, small, merged


def _are_tangled(counted: Network, found: AtomProbabilities, limit: int) -> bool:
    """Whether what is too wide would remain so with counting factors."""
    from mlnlite.infer.exact.width import is_tangled

    potentials = potentials_of(counted, chained=True)
    variables = np.zeros(len(potentials.cardinality), np.bool_)
    wide = found.wide if len(found.wide) <= _FEW else ()
    for component in wide:
        variables[:] = False
        variables[counted.variable[found.component == component]] = True
        if not is_tangled(potentials, variables, limit):
            return False
    return bool(wide)


def _merged(
    network: Network, asked: Int64 | None, found: AtomProbabilities, approach: Approach, limits: tuple[int, int | None]
) -> tuple[Network, AtomProbabilities]:
    """Components that are too wide once more, with atoms that exclude each other as one variable."""
    from mlnlite.infer.exact.bounded import bounded_marginals

    slack = 0.0 if approach.method == "exact" else approach.precision / _PART
    wide = np.isin(found.component, found.wide)
    again = bounded_marginals(network, asked, wide, slack, limits) if found.wide else None
    return again or (network, found)


def _rung_by_name(approach: Approach) -> Rung | None:
    """What answers all components that are not listed, if a user named it.

    Raises:
        MissingPart: it is not installed.
    """
    if approach.method == "bp":
        from mlnlite.infer.marginal.bp import propagate_beliefs

        return propagate_beliefs
    if approach.method != "wmc":
        return None
    verify_available()
    deadline = in_seconds(approach.time_limit)
    return lambda part, wanted: count_models(part, wanted, deadline)


def _rung_for_wide(network: Network, approach: Approach) -> Rung | None:
    """Model counting of components that are mostly hard, if that is installed; for a sixth of the time."""
    if not (np.isinf(network.weights).any() and is_available()):
        return None
    limit = PATIENCE if approach.time_limit is None else approach.time_limit
    deadline = in_seconds(limit / _SHARE)

    def rung(part: Part, wanted: Bool) -> Summed | None:
        try:
            return count_models(part, wanted, deadline) if is_mostly_hard(part, network.n_variables) else None
        except LimitReached:
            return None

    return rung


def _with_twins(network: Network, found: AtomProbabilities, atoms: Int64, which: Bool) -> Int64:
    """Some of the atoms replaced by those that correspond to them in the first of isomorphic components."""
    from mlnlite.ground.isomorphism import copies

    component = np.zeros(network.n_variables, np.int32)
    component[network.variable] = found.component
    return np.where(which, copies(network, component).twin[atoms], atoms)


def _n_rows(job: tuple[Int64, Int64]) -> int:
    """How much there is to estimate: small ones go first and leave their time to large ones."""
    return len(job[1])


def _enter(solution: Solution, rows: Int64, probability: Float, slack: Float, methods: Sequence[str]) -> None:
    """Writes down answers that are not sampled, with the share of worlds that each may leave out; nan for unknown."""
    solution.columns.probability[rows], solution.columns.exact[rows] = probability, slack == 0
    solution.columns.error[rows], solution.columns.low[rows] = slack, probability * (1 - slack)
    solution.columns.high[rows] = solution.columns.low[rows] + slack
    for row, method in zip(rows.tolist(), methods, strict=True):
        solution.methods[row] = method


def _formulas_exactly(
    network: Network,
    solution: Solution,
    found: AtomProbabilities,
    formulas: tuple[int, Sequence[Expression]],
    approach: Approach,
) -> None:
    """Answers those formulas that touch no component past the limit, as far as that is possible."""
    first, expressions = formulas
    wide = set(found.wide)
    rows = [
        first + i
        for i, f in enumerate(expressions)
        if wide.isdisjoint(found.component[np.array(list(atom_numbers(f)), np.int64)].tolist())
    ]
    if not rows:
        return
    rung = _rung_by_name(approach)
    limit, method = (approach.width_limit, ELIMINATION) if rung is None else (1, MODEL_COUNTING)
    try:
        probability = formula_probabilities(
            network, [expressions[r - first] for r in rows], width_limit=limit, rung=rung
        )
    except LimitReached:
        if approach.method in ("exact", "wmc"):
            raise
        return
    slack = np.array([_slack(found, expressions[r - first]) for r in rows])
    methods = [BOUNDED if s > 0 else method for s in slack.tolist()]
    _enter(solution, np.array(rows, np.int64), probability, slack, methods)


def _slack(found: AtomProbabilities, formula: Expression) -> float:
    """Share of the worlds that an answer about a formula may leave out."""
    atoms = np.array(list(atom_numbers(formula)), np.int64)
    _, first = np.unique(found.component[atoms], return_index=True)
    return float(found.slack[atoms[first]].sum())


def _jobs(
    found: AtomProbabilities, asked: tuple[Int64, Sequence[Expression]], rows: Int64
) -> Iterator[tuple[Int64, Int64]]:
    """What has to be sampled together: components, and the rows that are about them."""
    atoms, formulas = asked
    touched = [
        atoms[r : r + 1] if r < len(atoms) else np.array(list(atom_numbers(formulas[r - len(atoms)])), np.int64)
        for r in rows.tolist()
    ]
    group = np.arange(int(found.component.max(initial=-1)) + 1)
    for row in touched:
        mine = np.unique(group[found.component[row]])
        if len(mine) > 1:
            group[np.isin(group, mine)] = mine[0]
    of_row = np.array([group[found.component[row[0]]] for row in touched], np.int64)
    for g in np.unique(of_row):
        yield np.flatnonzero(group == g), rows[of_row == g]


def _enter_sample(
    network: Network,
    solution: Solution,
    variables: Bool,
    asked: tuple[Int64, Sequence[Expression], Int64],
    approach: Approach,
) -> None:
    """Samples some components and writes down what that says about some rows."""
    from mlnlite.infer.sample.sampling import Effort, sample

    atoms, formulas, rows = asked
    of_atoms, of_formulas = rows[rows < len(atoms)], rows[rows >= len(atoms)]
    about = atoms[of_atoms], [formulas[i - len(atoms)] for i in of_formulas.tolist()]
    effort = Effort(approach.precision, approach.time_limit, approach.chains, approach.seed)
    estimates = sample(network, variables, about, SAMPLERS.get(approach.method), effort)
    enter(solution.columns, rows, estimates.columns)
    for row, method in zip(rows.tolist(), estimates.methods, strict=True):
        solution.methods[row] = method
    solution.endings.append(estimates.ending)
    solution.traces |= {f"{name} ({len(solution.draws) + 1})": trace for name, trace in estimates.traces.items()}
    solution.draws.append((rows, estimates.draws))
