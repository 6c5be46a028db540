"""Several most probable worlds: comes in model, evidence and how many, go out answers in order of their weight."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mlnlite.engines.plan import Engine
from mlnlite.errors import QueryMistake
from mlnlite.ground.forecast import Limits
from mlnlite.ground.ground import NO_LIMITS
from mlnlite.ground.network import Network
from mlnlite.infer.answer import ask, closed_and_asked, state_of
from mlnlite.infer.map.kbest import World, best_worlds, diverse_worlds
from mlnlite.infer.map.ladder import BestWorld
from mlnlite.infer.map.rungs import verify
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model
from mlnlite.results import MapState

K_BEST, DIVERSE = "k best", "diverse"


def map_states(  # noqa: PLR0913
    model: Model,
    evidence: Evidence,
    query: str | Sequence[str] | None = None,
    *,
    k: int = 5,
    diverse: float | None = None,
    closed_world: str | Iterable[str] = (),
    time_limit: float | None = None,
    seed: int = 0,
    engine: Engine | None = None,
    limits: Limits = NO_LIMITS,
) -> tuple[MapState, ...]:
    """The k most probable worlds given evidence, or k good ones that differ.

    Args:
        model: a model with weights.
        evidence: one database.
        query: which atoms to show; worlds differ in any atom that is open.
        k: how many; there are fewer if there are not so many worlds.
        diverse: log-weight that a world loses for each variable that is as in a world before it; None for the k best.
        closed_world: as in `marginal`.
        time_limit: [s] for all of them.
        seed: of the search.
        engine: what runs the grounding plans.
        limits: what grounding may take.

    Returns:
        Answers, best first. "optimal" means: no world that is not listed before has a larger log-weight; of different
        worlds only the first one can be.

    Raises:
        QueryMistake: if the query, or a closed world, does not fit the model, or an option means nothing.
        Contradiction: if no world satisfies the evidence and the hard formulas.
    """
    if k < 1:
        raise QueryMistake(f"{k} worlds were asked for", "ask for one at least")
    if diverse is not None and not 0 <= diverse < np.inf:
        raise QueryMistake(f"{diverse} is no log-weight to lose", "give a finite number of 0 or more")
    verify(time_limit=time_limit, seed=seed)
    question, evidence = closed_and_asked(model, evidence, query, closed_world)
    asked = ask(model, evidence, question, engine, limits)
    network, limit = asked.network, time_limit
    if diverse is None:
        worlds = best_worlds(network, k, time_limit=limit, seed=seed)
    else:
        worlds = diverse_worlds(network, k, diverse, time_limit=limit, seed=seed)
    method = K_BEST if diverse is None else DIVERSE
    return tuple(state_of(network, asked.question, _as_best(network, w, method), {}) for w in worlds)


def _as_best(network: Network, world: World, method: str) -> BestWorld:
    """A world with what is known of it."""
    gap = 0.0 if world.proved else np.inf
    status = "optimal" if world.proved else "feasible"
    return BestWorld(
        world.truth, world.log_weight, world.log_weight + gap, "optimal" if world.proved else "feasible",
        np.zeros(network.n_atoms, np.int64), (status,), (method,), np.array([gap]), {method: 1}, 0,
    )  # fmt: skip
