"""What will be asked of weights that are not learnt yet: found wanting before the learning, not after it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mlnlite.errors import LimitReached
from mlnlite.ground.ground import ground
from mlnlite.learn.learned import How, targets_of
from mlnlite.learn.objectives.choose import task_of
from mlnlite.learn.objectives.exact import conditions
from mlnlite.learn.objectives.quantified import without_weights
from mlnlite.learn.optimise.problem import log_likelihood
from mlnlite.learn.trust.clusters import ENOUGH, clustered
from mlnlite.learn.trust.effects import unseen
from mlnlite.learn.trust.path import verify_path
from mlnlite.learn.trust.uncertainty import Method, verify_clusters, verify_method
from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model


def verify(
    model: Model,
    databases: Evidence,
    how: How,
    *,
    method: Method | None = None,
    path: bool = False,
    held_out: Evidence | None = None,
) -> None:
    """Complains of what cannot be said of the weights once they are learnt.

    Args:
        model: whose weights are to be learnt.
        databases: from what.
        how: what is to be learnt.
        method: of the standard errors, None for none.
        path: whether the path of Laplace priors is wanted.
        held_out: other databases whose probability is wanted.

    Raises:
        QueryMistake: if the method does not fit what is learnt, or there are too few clusters; if the path needs a
            likelihood that is too wide to be worked out.
        Contradiction, EvidenceMistake, LimitReached: if other databases have no probability that can be worked out, or
            the bootstrap has no network to draw from.
    """
    expanded = replace(model, templates=tuple(t.expanded(databases.types) for t in model.templates))
    if method is not None:
        verify_method(how, method)
    if method == "sandwich" and databases.n_databases < ENOUGH:
        verify_clusters(clustered(expanded, databases, how)[1])
    if method == "bootstrap":  # draws from this network
        ground(
            without_weights(expanded), conditions(databases, 0, targets_of(model, how), frozenset(how.open_predicates))
        )
    if path:
        verify_path(how, _is_sampled(expanded, databases, how))
    if held_out is not None:
        problem = unseen(model, held_out, how)
        log_likelihood(problem, np.zeros(len(problem.free)))


def _is_sampled(model: Model, databases: Evidence, how: How) -> bool:
    """Whether the likelihood is too wide to be worked out."""
    if how.objective != "likelihood":
        return False
    problem = task_of(model, databases, how, targets_of(model, how), None).problem
    try:
        log_likelihood(problem, np.zeros(len(problem.free)))
    except LimitReached:
        return True
    return False
