"""Probabilities: come in what inference found, with atoms as text; goes out a table, HTML, JSON, a frame, a mapping."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.results.arviz import inference_data
from mlnlite.results.rows import Bool, Float, Int64, Rows, Statistics
from mlnlite.results.table import json_number, number_cell, order_of_rows

Float32 = NDArray[np.float32]

_HEAD = ("atom or formula", "probability", "method")


@dataclass(frozen=True, slots=True, eq=False)
class Marginals(Rows[float]):
    """Probabilities of atoms and formulas; a mapping from their text to their probability.

    Attributes:
        names: text of each atom or formula.
        probabilities: shape (n,).
        methods: how each was found: "evidence", "closed form", "elimination", ...
        exact: shape (n,), whether the probability is exact to machine precision.
        error: shape (n,), standard error of each, 0 where exact; for bounded elimination what it can be off at most.
        status: "exact", or what else can be said of the whole.
        log_z: log partition function, nan if it is not known.
        statistics: what it took.
        block: shape (n,), number of the functional block of each atom, -1 for none.
        low: shape (n,), lower end of a 95 % interval (of a certain one if bounded); the probability itself where exact.
        high: shape (n,), its upper end.
        r_hat: shape (n,), rank-normalised split R-hat, nan where not sampled or never seen to change.
        effective_size: shape (n,), effective sample size, nan likewise.
        traces: of sampling, shape (n_chains, n_batches) each: log-weight of the world and true groundings of formulas.
        draws: of each sampling, rows and series of shape (n_chains, n_batches, n_rows): means of batches of draws.
    """

    probabilities: Float
    methods: tuple[str, ...]
    exact: Bool
    error: Float
    status: str = "exact"
    log_z: float = float("nan")
    statistics: Statistics = field(default_factory=Statistics)
    block: Int64 | None = None
    low: Float | None = None
    high: Float | None = None
    r_hat: Float | None = None
    effective_size: Float | None = None
    traces: Mapping[str, Float] = field(default_factory=dict, repr=False)
    draws: tuple[tuple[Int64, Float32], ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        """Prepares look-up by text; what is not given follows from the probabilities being exact."""
        Rows.__post_init__(self)
        nothing = np.full(len(self.names), np.nan)
        default = {"low": self.probabilities, "high": self.probabilities, "r_hat": nothing, "effective_size": nothing}
        for name, values in default.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, values)

    def __getitem__(self, name: str) -> float:
        """Probability of an atom or formula, by its text; spaces do not matter."""
        return float(self.probabilities[self.row(name)])

    def to_text(self, limit: int | None = None) -> str:
        """A table, predicate by predicate and block by block.

        Args:
            limit: show at most so many rows.
        """
        summary = [f"status: {self.status}"] + ([f"log Z = {self.log_z:.6f}"] if isfinite(self.log_z) else [])
        empty = [] if self.names else ["what is asked has no atoms: evidence, or the model, brings constants"]
        return self.table(limit, [*empty, ", ".join(summary), str(self.statistics)])

    def head(self) -> tuple[str, ...]:
        """Names of the columns."""
        return (*_HEAD[:2], "R-hat", "effective size", *_HEAD[2:]) if self.draws else _HEAD

    def order(self) -> list[int]:
        """All rows."""
        return order_of_rows(self.names, self.block)

    def cells(self, rows: Sequence[int]) -> list[tuple[str, ...]]:
        """Cells of the table."""
        found = []
        for i in rows:
            extra = [number_cell(values[i], form) for values, form in self._diagnostics()]
            found.append((self.names[i], self._bar(i), *extra, self.methods[i]))
        return found

    def _diagnostics(self) -> Sequence[tuple[Float, str]]:
        """R-hat and effective sizes, with how to write them, if anything was sampled."""
        if not self.draws or self.r_hat is None or self.effective_size is None:
            return ()
        return (self.r_hat, ".3f"), (self.effective_size, ",.0f")

    def _bar(self, i: int) -> str:
        """A probability with its error, or with its interval where it was never seen to be otherwise."""
        p, error = self.probabilities[i], self.error[i]
        if self.exact[i]:
            return f"{p:.4f}"
        if np.isnan(error):
            return f"about {p:.4f}"
        if self.methods[i].startswith("bounded"):
            return f"{p:.4f} within {error:.1e}"
        if (
            self.draws
            and self.r_hat is not None
            and np.isnan(self.r_hat[i])
            and self.low is not None
            and self.high is not None
        ):
            return f"{p:.4f} in [{self.low[i]:.4f}, {self.high[i]:.4f}]"
        return f"{p:.4f} +- {error:.4f}"

    def caption(self) -> str:
        """The whole in a line."""
        return f"status: {self.status}"

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        columns = self.columns()
        return {
            "status": self.status,
            "log_z": json_number(self.log_z),
            "marginals": [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
            "statistics": self.statistics.to_dict(),
        }

    def columns(self) -> dict[str, list[Any]]:
        """All that is known of each row, by name of the column; intervals and what sampling adds if there are any."""
        given = {} if self.exact.all() else {"low": self.low, "high": self.high}
        if self.draws:
            given |= {"r_hat": self.r_hat, "effective_size": self.effective_size}
        numbers = {
            name: [json_number(x) for x in values.tolist()] for name, values in given.items() if values is not None
        }
        return {
            "name": [*self.names],
            "probability": list(self.probabilities.tolist()),
            "method": list(self.methods),
            "exact": list(self.exact.tolist()),
            "error": list(self.error.tolist()),
            **numbers,
        }

    def to_inference_data(self) -> Any:  # noqa: ANN401
        """What was sampled, for ArviZ: `InferenceData` of its first generation, a `DataTree` of its second.

        The variable `probability` holds, for each batch of draws, the mean probability of each atom given all others.

        Raises:
            QueryMistake: nothing was sampled.
            MissingPart: ArviZ is not installed.
        """
        return inference_data(self.names, self.draws, self.traces)
