"""Max-margin weights: the world in the data is to beat every other by as much as it differs. Networks in, weights out.

The least of `sum_w (w - m)^2 / (2 sd^2) + sum_databases max_x (loss(x, y) + w n(x) - w n(y))`, with labels y, where the
loss is the number of predicted atoms and blocks that differ (Taskar, Guestrin and Koller 2004; for Markov
logic Huynh and Mooney 2009). Cutting planes with one slack (Joachims, Finley and Yu 2009): the most violating worlds
are most probable worlds of the network with one more weight, the loss, so that the ladder for these answers, with its
bound; the dual over the cuts is a small quadratic programme.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mlnlite.errors import Contradiction, MlnError
from mlnlite.ground.network import Clauses, Network
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.score import counts, log_weight, truth_of
from mlnlite.learn.optimise.newton import stopped_by
from mlnlite.learn.prior import Penalty

Float = NDArray[np.float64]
Int64 = NDArray[np.int64]

MOST_CUTS = 500
TOLERANCE = 1e-6
"""Share of the objective that the best weights may be missed by."""


@dataclass(frozen=True, slots=True)
class Labelled:
    """One database.

    Attributes:
        network: in which everything predicted is unknown, with the loss as last weight.
        counts: shape (n_weights,), true groundings in the data.
        untouched: number of predicted atoms and blocks that no formula touches: any value will do for them.
        times: how much the database counts.
    """

    network: Network
    counts: Int64
    untouched: int
    times: float


@dataclass(frozen=True, slots=True)
class Cut:
    """`slack >= loss - w change` for all weights.

    Attributes:
        loss: of the worlds that make it, and what fixed weights give them more than the data.
        change: shape (n_free,), counts in the data less those in the worlds.
    """

    loss: float
    change: Float


@dataclass(frozen=True, slots=True)
class Margin:
    """Weights with the largest margin.

    Attributes:
        x: the free weights.
        slack: what the databases lack.
        gap: what the objective could at most be lower.
        cuts: how many cutting planes were needed.
        status: `converged`, or what stopped the search.
    """

    x: Float
    slack: float
    gap: float
    cuts: int
    status: str


def labelled_network(network: Network, values: Int64, n_choices: int, times: float) -> Labelled:
    """A database for `widest`.

    Args:
        network: in which everything predicted is unknown.
        values: shape (n_variables,), the value of each variable in the data.
        n_choices: number of atoms and blocks that are predicted.
        times: how much the database counts.

    Raises:
        Contradiction: if the data violate a hard formula.
    """
    truth = truth_of(network, values)
    if np.isneginf(log_weight(network, truth)):
        raise Contradiction("the data violate a hard formula", "give it a weight, or mend the data")
    weight = len(network.weights)
    right = values[network.variable] == network.value
    loss = [_clauses(-(np.flatnonzero(right) + 1)[:, None], weight)]
    none = np.setdiff1d(np.arange(network.n_variables), network.variable[right])
    sizes = np.bincount(network.variable, minlength=network.n_variables)
    for size in np.unique(sizes[none]).tolist():
        members = np.flatnonzero(np.isin(network.variable, none[sizes[none] == size]))
        order = np.argsort(network.variable[members], kind="stable")
        loss.append(_clauses(np.sort(members[order].reshape(-1, size) + 1, axis=1), weight))
    more = replace(
        network,
        clauses=(*network.clauses, *loss),
        weights=np.append(network.weights, 1.0),
        template=np.append(network.template, network.template[-1:]),
        decided_true=np.append(network.decided_true, 0),
        n_groundings=np.append(network.n_groundings, network.n_variables),
    )
    return Labelled(more, counts(network, truth), n_choices - network.n_variables, times)


def _clauses(literals: NDArray[np.int64], weight: int) -> Clauses:
    n = len(literals)
    return Clauses(literals.astype(np.int32), np.full(n, weight, np.int32), np.ones(n, np.int64))


def widest(
    databases: list[Labelled], penalty: Penalty, share: sparse.csr_array, base: Float, seed: int, deadline: Deadline
) -> Margin:
    """The weights with the largest margin.

    Args:
        databases: their networks.
        penalty: of the free weights: a Gaussian prior for each.
        share: shape (n_weights, n_free), see `Problem`.
        base: shape (n_weights,), weights that are not free; 0 for the others.
        seed: for searches.
        deadline: when to stop with the best so far.
    """
    cuts = [Cut(0.0, np.zeros(share.shape[1]))]
    best, slack, lowest, status = penalty.mean, np.inf, -np.inf, "limit of cuts"
    upper = np.inf
    while len(cuts) < MOST_CUTS:
        x, lowest = _best_under(cuts, penalty)
        found, most = _most_violating(databases, base, x, share, seed)
        value = penalty.smooth(x)[0] + most
        if value < upper:
            best, slack, upper = x, most, value
        if upper - lowest <= TOLERANCE * max(1.0, abs(upper)):
            status = "converged"
        elif found.loss - found.change @ x <= _slack(cuts, x) + 1e-9:
            status = "worlds that violate most were not proved"
        elif deadline.is_over:
            status = stopped_by(deadline)
        else:
            cuts.append(found)
            continue
        break
    return Margin(best, slack, upper - lowest, len(cuts), status)


def _slack(cuts: list[Cut], x: Float) -> float:
    return max(cut.loss - float(cut.change @ x) for cut in cuts)


def _most_violating(
    databases: list[Labelled], base: Float, x: Float, share: sparse.csr_array, seed: int
) -> tuple[Cut, float]:
    """The worlds that violate most at some weights, as one cut, and a bound on how much any do."""
    weights = np.append(base + share @ x, 1.0)
    soft, fixed = np.isfinite(weights[:-1]), np.where(np.isfinite(base), base, 0.0)
    loss, change, bound = 0.0, np.zeros(share.shape[1]), 0.0
    for one in databases:
        world = map_of(replace(one.network, weights=weights), seed=seed)
        found = counts(one.network, world.truth)
        loss += one.times * float(found[-1] + one.untouched + fixed @ (found[:-1] - one.counts))
        change += one.times * (share.T @ (one.counts - found[:-1]))
        bound += one.times * (world.bound + one.untouched - float(weights[:-1][soft] @ one.counts[soft]))
    return Cut(loss, change), bound


def _best_under(cuts: list[Cut], penalty: Penalty) -> tuple[Float, float]:
    """The best weights if the cuts were all constraints, and the value there: least of the dual over the cuts."""
    change = np.array([cut.change for cut in cuts])
    gain = np.array([cut.loss for cut in cuts]) - change @ penalty.mean
    scaled = change / np.sqrt(penalty.precision)
    share = _simplex(scaled @ scaled.T, gain)
    x = penalty.mean + (share @ change) / penalty.precision
    return x, float(share @ gain - 0.5 * ((share @ scaled) ** 2).sum())


def _simplex(gram: Float, gain: Float) -> Float:
    """The `a >= 0` that sum to 1 with the largest `a gain - a gram a / 2`."""
    import highspy

    n = len(gain)
    model = highspy.HighsModel()
    model.lp_.num_col_, model.lp_.num_row_ = n, 1
    model.lp_.col_cost_, model.lp_.col_lower_ = -gain, np.zeros(n)
    model.lp_.col_upper_ = np.full(n, highspy.kHighsInf)
    model.lp_.row_lower_ = model.lp_.row_upper_ = np.ones(1)
    model.lp_.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    model.lp_.a_matrix_.start_ = np.array([0, n])
    model.lp_.a_matrix_.index_, model.lp_.a_matrix_.value_ = np.arange(n), np.ones(n)
    lower = [np.arange(i, n) for i in range(n)]
    model.hessian_.dim_, model.hessian_.format_ = n, highspy.HessianFormat.kTriangular
    model.hessian_.start_ = np.cumsum([0, *(len(c) for c in lower)])
    model.hessian_.index_ = np.concatenate(lower)
    model.hessian_.value_ = np.concatenate([gram[i, c] for i, c in enumerate(lower)])
    solver = highspy.Highs()  # type: ignore[no-untyped-call]
    solver.setOptionValue("output_flag", False)
    solver.passModel(model)
    solver.run()
    if solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
        raise MlnError("the quadratic programme of max-margin learning was not solved", "give a narrower prior")
    share = np.maximum(np.array(solver.getSolution().col_value), 0.0)
    return np.asarray(share / share.sum())
