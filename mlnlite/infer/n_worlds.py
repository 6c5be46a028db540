"""How many worlds there are, whatever formulas say: comes in evidence or a network, goes out a logarithm."""

from __future__ import annotations

from collections.abc import Iterable
from math import prod

import numpy as np

from mlnlite.ground.network import Network
from mlnlite.model.evidence import Evidence
from mlnlite.model.symbols import Predicate


def log_worlds(evidence: Evidence, names: Iterable[str] | None = None) -> float:
    """Log of the number of worlds of the atoms that evidence leaves open.

    Args:
        evidence: about one database, with what follows from functional predicates.
        names: of the predicates whose atoms count; None for all.
    """
    return sum(_log_worlds(evidence.predicates[n], evidence) for n in (evidence.predicates if names is None else names))


def log_worlds_of(network: Network) -> float:
    """Log of the number of worlds of the atoms of a network."""
    return float(np.log(network.cardinality).sum())


def _log_worlds(predicate: Predicate, evidence: Evidence) -> float:
    """Log of the number of worlds of the open atoms of one predicate."""
    if predicate.closed or predicate.comparison is not None:
        return 0.0
    size = [int(evidence.present[t][0].sum()) for t in predicate.types]
    known = evidence.facts[predicate.name].arguments
    if predicate.value is None:
        return float((prod(size) - len(known)) * np.log(2))
    n_values = size[predicate.value]
    _, n_known = np.unique(np.delete(known, predicate.value, axis=1), axis=0, return_counts=True)
    n_open = n_values - n_known[n_known < n_values]
    n_untouched = prod(size) // max(n_values, 1) - len(n_known)
    none = int(predicate.marker == "?")
    untouched = n_untouched * np.log(n_values + none) if n_untouched else 0.0
    return float(np.log(n_open + none).sum() + untouched)
