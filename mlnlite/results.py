"""Answers: comes in what inference found, with atoms as text; goes out a table, HTML, JSON, a data frame, a mapping."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.arviz import inference_data
from mlnlite.errors import QueryMistake, did_you_mean
from mlnlite.table import SHOWN, data_frame, html_table, json_number, number_cell, order_of_rows, text_table

if TYPE_CHECKING:
    import pandas as pd
Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]
Int64 = NDArray[np.int64]

_PAID = 10


class UnknownRowError(QueryMistake, KeyError):
    """A result was asked for an atom or formula that it does not hold."""

    __str__ = Exception.__str__


@dataclass(frozen=True, slots=True)
class Statistics:
    """What an answer took.

    Attributes:
        n_atoms: unknown atoms of the network.
        n_factors: ground formulas that evidence left open, equal ones once.
        n_components: parts of the network that have nothing to do with each other.
        largest_table: number of entries of the largest table.
        seconds: [s] wall time of each stage, in order.
    """

    n_atoms: int = 0
    n_factors: int = 0
    n_components: int = 0
    largest_table: int = 0
    seconds: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        """One line."""
        sizes = f"{self.n_atoms:,} unknown atoms, {self.n_factors:,} factors, {self.n_components:,} components"
        table = f", largest table {self.largest_table:,}" if self.largest_table else ""
        times = "".join(f"; {stage} {seconds:.3f} s" for stage, seconds in self.seconds.items())
        return sizes + table + times

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        names = ("n_atoms", "n_factors", "n_components", "largest_table")
        return {**{n: int(getattr(self, n)) for n in names}, "seconds": dict(self.seconds)}


@dataclass(frozen=True, slots=True, eq=False)
class Marginals(Mapping[str, float]):
    """Probabilities of atoms and formulas; a mapping from their text to their probability.

    Attributes:
        names: text of each atom or formula.
        probabilities: shape (n,).
        methods: how each was found: "evidence", "closed form", "elimination", ...
        exact: shape (n,), whether the probability is exact to machine precision.
        error: shape (n,), standard error of each, 0 where exact.
        status: "exact", or what else can be said of the whole.
        log_z: log partition function, nan if it is not known.
        statistics: what it took.
        block: shape (n,), number of the functional block of each atom, -1 for none.
        low: shape (n,), lower end of a 95 % interval; the probability itself where exact.
        high: shape (n,), its upper end.
        r_hat: shape (n,), rank-normalised split R-hat, nan where not sampled or never seen to change.
        effective_size: shape (n,), effective sample size, nan likewise.
        traces: of sampling, shape (n_chains, n_batches) each: log-weight of the world and true groundings of formulas.
        draws: of each sampling, rows and series of shape (n_chains, n_batches, n_rows): means of batches of draws.
    """

    names: tuple[str, ...]
    probabilities: Float
    methods: tuple[str, ...]
    exact: Bool
    error: Float
    status: str = "exact"
    log_z: float = float("nan")
    statistics: Statistics = Statistics()
    block: Int64 | None = None
    low: Float | None = None
    high: Float | None = None
    r_hat: Float | None = None
    effective_size: Float | None = None
    traces: Mapping[str, Float] = field(default_factory=dict, repr=False)
    draws: tuple[tuple[Int64, Float32], ...] = field(default=(), repr=False)
    _index: dict[str, int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Prepares look-up by text; what is not given follows from the probabilities being exact."""
        object.__setattr__(self, "_index", _index_of(self.names))
        nothing = np.full(len(self.names), np.nan)
        default = {"low": self.probabilities, "high": self.probabilities, "r_hat": nothing, "effective_size": nothing}
        for name, values in default.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, values)

    def __getitem__(self, name: str) -> float:
        """Probability of an atom or formula, by its text; spaces do not matter."""
        return float(self.probabilities[_find(self._index, self.names, name)])

    def __iter__(self) -> Iterator[str]:
        """The texts."""
        return iter(self.names)

    def __len__(self) -> int:
        """How many."""
        return len(self.names)

    def __str__(self) -> str:
        """A table, of the first rows if there are many."""
        return self.to_text(SHOWN)

    def to_text(self, limit: int | None = None) -> str:
        """A table, predicate by predicate and block by block.

        Args:
            limit: show at most so many rows.
        """
        summary = [f"status: {self.status}"] + ([f"log Z = {self.log_z:.6f}"] if isfinite(self.log_z) else [])
        return text_table(self._head(), self._rows(), limit, [", ".join(summary), str(self.statistics)])

    def _head(self) -> tuple[str, ...]:
        """Names of the columns."""
        return (*_HEAD[:2], "R-hat", "effective size", *_HEAD[2:]) if self.draws else _HEAD

    def _rows(self) -> list[tuple[str, ...]]:
        """Cells of the table."""
        order = order_of_rows(self.names, self.block)
        rows = []
        for i in order:
            extra = [number_cell(values[i], form) for values, form in self._diagnostics()]
            rows.append((self.names[i], self._bar(i), *extra, self.methods[i]))
        return rows

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
        if (
            self.draws
            and self.r_hat is not None
            and np.isnan(self.r_hat[i])
            and self.low is not None
            and self.high is not None
        ):
            return f"{p:.4f} in [{self.low[i]:.4f}, {self.high[i]:.4f}]"
        return f"{p:.4f} +- {error:.4f}"

    def _repr_html_(self) -> str:
        """A table for notebooks."""
        return html_table(self._head(), self._rows(), f"status: {self.status}")

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        columns = self.columns()
        return {
            "status": self.status,
            "log_z": json_number(self.log_z),
            "marginals": [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
            "statistics": self.statistics.to_dict(),
        }

    def to_json(self, indent: int | None = 2) -> str:
        """JSON text."""
        return json.dumps(self.to_dict(), indent=indent)

    def to_frame(self) -> pd.DataFrame:
        """A pandas data frame, one row for each atom or formula.

        Raises:
            MissingPart: pandas is not installed.
        """
        return data_frame(self.columns())

    def columns(self) -> dict[str, list[object]]:
        """All that is known of each row, by name of the column; what sampling adds only if there was any."""
        sampled = {"low": self.low, "high": self.high, "r_hat": self.r_hat, "effective_size": self.effective_size}
        given = sampled if self.draws else {}
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


@dataclass(frozen=True, slots=True)
class Violation:
    """A soft formula that a world pays for.

    Attributes:
        formula: its text.
        n_groundings: how many groundings are false, or true if the weight is negative.
        weight: its log weight.
    """

    formula: str
    n_groundings: int
    weight: float

    @property
    def cost(self) -> float:
        """Log-weight that the world loses."""
        return abs(self.weight) * self.n_groundings


@dataclass(frozen=True, slots=True, eq=False)
class MapState(Mapping[str, bool]):
    """A most probable world, or the best that was found; a mapping from atoms to their truth.

    Attributes:
        names: text of each atom.
        truth: shape (n,).
        methods: how each was found.
        log_weight: of the world.
        bound: no world has a larger log-weight.
        status: "optimal", or "feasible" if a better world may exist.
        violated: the soft formulas that the world pays for.
        statistics: what it took.
        block: shape (n,), number of the functional block of each atom, -1 for none.
        cost: weight of the false groundings of formulas with positive weight, and of the true ones (without sign)
            where it is negative; nan if nobody worked it out.
        open_cost: the part of it on groundings that evidence leaves open.
        gap: how much larger the log-weight of another world (or smaller its cost) could at most be.
        margins: shape (n,), how much log-weight the best world loses in which the atom is the other way round:
            infinity if it cannot be, nan if that is not known; None if nobody asked.
    """

    names: tuple[str, ...]
    truth: Bool
    methods: tuple[str, ...]
    log_weight: float
    bound: float
    status: str
    violated: tuple[Violation, ...] = ()
    statistics: Statistics = Statistics()
    block: Int64 | None = None
    cost: float = float("nan")
    open_cost: float = float("nan")
    gap: float = float("nan")
    margins: Float | None = None
    _index: dict[str, int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Prepares look-up by text."""
        object.__setattr__(self, "_index", _index_of(self.names))
        if not isfinite(self.gap):
            object.__setattr__(self, "gap", self.bound - self.log_weight)

    @property
    def state(self) -> dict[str, bool]:
        """Truth of each atom."""
        return dict(zip(self.names, self.truth.tolist(), strict=True))

    @property
    def true_atoms(self) -> tuple[str, ...]:
        """The atoms that are true."""
        return tuple(self.names[i] for i in np.flatnonzero(self.truth).tolist())

    def __getitem__(self, name: str) -> bool:
        """Truth of an atom, by its text; spaces do not matter."""
        return bool(self.truth[_find(self._index, self.names, name)])

    def __iter__(self) -> Iterator[str]:
        """The atoms."""
        return iter(self.names)

    def __len__(self) -> int:
        """How many atoms."""
        return len(self.names)

    def __str__(self) -> str:
        """The true atoms and what they cost, of the first rows if there are many."""
        return self.to_text(SHOWN)

    def to_text(self, limit: int | None = None) -> str:
        """The true atoms, then the formulas that they violate.

        Args:
            limit: show at most so many rows.
        """
        worst = sorted(self.violated, key=lambda v: -v.cost)
        paid = [f"pays {v.cost:.4g} for {v.formula} ({v.n_groundings:,} x {v.weight:.4g})" for v in worst[:_PAID]]
        rest = worst[_PAID:]
        paid += [f"pays {sum(v.cost for v in rest):.4g} for {len(rest):,} more formulas"] if rest else []
        weight = f"log-weight {self.log_weight:.6f}, bound {self.bound:.6f}, gap {self.gap:.3g}"
        summary = [f"status: {self.status}, {weight}"]
        if isfinite(self.cost):
            open_ = f"{self.open_cost:.6f} of it where evidence leaves a choice"
            summary.insert(0, f"cost: {self.cost:.6f}, {open_}; no world costs less than {self.cost - self.gap:.6f}")
        return text_table(self._head(), self._rows(), limit, [*paid, *summary, str(self.statistics)])

    def _head(self) -> tuple[str, ...]:
        """Names of the columns of the table."""
        return ("true atom", "method") if self.margins is None else ("true atom", "margin", "method")

    def _rows(self) -> list[tuple[str, ...]]:
        """Cells of the table."""
        true = [i for i in order_of_rows(self.names, self.block) if self.truth[i]]
        if self.margins is None:
            return [(self.names[i], self.methods[i]) for i in true]
        return [(self.names[i], f"{self.margins[i]:.4f}", self.methods[i]) for i in true]

    def _repr_html_(self) -> str:
        """A table for notebooks."""
        caption = f"status: {self.status}, log-weight {self.log_weight:.4f}, gap {self.gap:.3g}"
        return html_table(("true atom", "method"), self._rows(), caption)

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        numbers = None if self.margins is None else map(json_number, self.margins.tolist())
        margins = None if numbers is None else dict(zip(self.names, numbers, strict=True))
        paid = [{"formula": v.formula, "n_groundings": v.n_groundings, "weight": v.weight} for v in self.violated]
        return {
            "status": self.status,
            "log_weight": json_number(self.log_weight),
            "bound": json_number(self.bound),
            "gap": json_number(self.gap),
            "cost": json_number(self.cost),
            "open_cost": json_number(self.open_cost),
            "true_atoms": list(self.true_atoms),
            "state": self.state,
            "margins": margins,
            "violated": paid,
            "statistics": self.statistics.to_dict(),
        }

    def to_json(self, indent: int | None = 2) -> str:
        """JSON text."""
        return json.dumps(self.to_dict(), indent=indent)

    def to_frame(self) -> pd.DataFrame:
        """A pandas data frame, one row for each atom.

        Raises:
            MissingPart: pandas is not installed.
        """
        columns: dict[str, object] = {"name": self.names, "truth": self.truth, "method": self.methods}
        return data_frame(columns if self.margins is None else {**columns, "margin": self.margins})


_HEAD = ("atom or formula", "probability", "method")


def _index_of(names: Sequence[str]) -> dict[str, int]:
    """Row of each text, with and without its spaces; a text itself goes before what another one is without spaces."""
    squeezed = {"".join(name.split()): i for i, name in enumerate(names)}
    return squeezed | {name: i for i, name in enumerate(names)}


def _find(index: Mapping[str, int], names: Sequence[str], name: str) -> int:
    """Row of a text."""
    row = index.get(name, index.get("".join(name.split())))
    if row is None:
        raise UnknownRowError(f"the result holds no {name}", hint=did_you_mean(name, names))
    return row
