"""Answers: value, status, error, statistics."""

from mlnlite.results.map_state import MapState, Violation
from mlnlite.results.marginals import Marginals
from mlnlite.results.rows import Statistics, UnknownRowError

__all__ = ["MapState", "Marginals", "Statistics", "UnknownRowError", "Violation"]
