"""Exact marginals by weighted model counting (Ganak): comes in a component, go out distributions and log Z.

Sharma, Roy, Soos and Meel, GANAK: a scalable probabilistic exact model counter (IJCAI 2019); Chavira and Darwiche, On
probabilistic inference by weighted model counting (2008). It pays where hard formulas leave few worlds.
"""

from __future__ import annotations

from importlib.util import find_spec
from itertools import combinations
from typing import Any

import numpy as np

from mlnlite.errors import LimitReached, MissingPart
from mlnlite.ground.network import Bool, Int64
from mlnlite.infer.deadline import Deadline
from mlnlite.infer.reduce.parts import Part, Summed
from mlnlite.infer.workers.ask import workers

MODEL_COUNTING = "model counting"
_HARD_SHARE = 0.5


def is_available() -> bool:
    """Whether Ganak is installed."""
    return find_spec("pyganak") is not None


def verify_available() -> None:
    """Refuses if it is not.

    Raises:
        MissingPart: naming the extra.
    """
    if not is_available():
        raise MissingPart("the model counter Ganak is not installed", hint="pip install 'mlnlite[wmc]'")


def is_mostly_hard(part: Part, n_variables: int) -> bool:
    """Whether counting models is worth a try: most cells over several variables are forbidden.

    Args:
        part: a component.
        n_variables: of the network; what defines auxiliary ones after these is hard in any network.
    """
    several = [
        c.amount[(part.variables[c.scope] < n_variables).all(axis=1)] for c in part.cells if c.scope.shape[1] > 1
    ]
    amounts = np.concatenate([np.zeros(0), *several])
    return bool(np.isneginf(amounts).sum() > _HARD_SHARE * len(amounts))


def count_models(part: Part, wanted: Bool, deadline: Deadline) -> Summed | None:
    """Sums over all worlds of a component.

    Args:
        part: the component.
        wanted: shape (n,), whose distribution to work out: one count for each value but one.
        deadline: when to give up.

    Returns:
        None if time is up.

    Raises:
        LimitReached: the sum is too small for a floating-point number.
    """
    problem, constant, literal = _problem(part)
    asked = [(v, k) for v in np.flatnonzero(wanted).tolist() for k in range(1, int(part.cardinality[v]))]
    problem["literals"] = [_literal(part, literal, v, k) for v, k in asked]
    with workers() as ask:
        reply = ask("_ganak_worker", problem, deadline)
    if reply is None:
        return None
    total = float(reply["total"])
    if total == 0.0 and _has_model(problem):
        raise LimitReached("the weight of all worlds is too small for the model counter", hint="ask for `auto`")
    if total == 0.0:
        return Summed(-np.inf, {}, MODEL_COUNTING)
    found = {v: np.zeros(int(part.cardinality[v])) for v in np.flatnonzero(wanted).tolist()}
    for (v, k), weight in zip(asked, reply["each"], strict=True):
        found[v][k] = weight / total
    for distribution in found.values():
        distribution[0] = max(0.0, 1.0 - distribution.sum())
    return Summed(constant + float(np.log(total)), found, MODEL_COUNTING)


def _literal(part: Part, first: Int64, variable: int, value: int) -> int:
    """The literal that says `variable = value`: a variable of two values is one literal, others have one for each."""
    if part.cardinality[variable] == 2:
        return int(first[variable]) * (1 if value else -1)
    return int(first[variable]) + value


def _problem(part: Part) -> tuple[dict[str, Any], float, Int64]:
    """A component as the worker reads it, what its weights have to be multiplied by (log), and the first literals.

    The weights of what a variable may be add up to 1, so that no sum is larger than that. A cell over several variables
    that changes the weight is a new variable, true exactly where the cell is.
    """
    from scipy.special import expit

    size = np.where(part.cardinality == 2, 1, part.cardinality).astype(np.int64)
    first = np.cumsum(size) - size + 1
    own = [np.zeros(k) for k in part.cardinality.tolist()]
    clauses: list[list[int]] = []
    weights: list[tuple[int, float]] = []
    constant, n_variables = 0.0, int(size.sum())
    for c in part.cells:
        for scope, value, amount in zip(c.scope.tolist(), c.value.tolist(), c.amount.tolist(), strict=True):
            literals = [_literal(part, first, v, k) for v, k in zip(scope, value, strict=True)]
            if len(scope) == 1:
                own[scope[0]][value[0]] += amount
            elif amount == -np.inf:
                clauses.append([-x for x in literals])
            elif amount:
                n_variables += 1
                clauses += [[-n_variables, x] for x in literals] + [[n_variables, *(-x for x in literals)]]
                weights += [(n_variables, float(expit(amount))), (-n_variables, float(expit(-amount)))]
                constant += float(np.logaddexp(amount, 0.0))
    for v, gain in enumerate(own):
        literals = [_literal(part, first, v, k) for k in range(len(gain))]
        if len(gain) > 2:
            clauses += [literals, *([-a, -b] for a, b in combinations(literals, 2))]
        log_sum = float(np.logaddexp.reduce(gain))
        if log_sum == -np.inf:
            clauses.append([])
            continue
        constant += log_sum
        weights += list(zip(literals, np.exp(gain - log_sum).tolist(), strict=True))
        weights += [(-x, 1.0) for x in literals] if len(gain) > 2 else []
        clauses += [[-x] for x, amount in zip(literals, gain.tolist(), strict=True) if amount == -np.inf]
    return {"n_variables": n_variables, "clauses": clauses, "weights": weights}, constant, first


def _has_model(problem: dict[str, Any]) -> bool:
    """Whether the clauses can be satisfied."""
    from pysat.solvers import Solver

    if [] in problem["clauses"]:
        return False
    with Solver(name="cadical153", bootstrap_with=problem["clauses"]) as solver:
        return bool(solver.solve())
