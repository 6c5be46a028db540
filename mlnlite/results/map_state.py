"""A most probable world: comes in what inference found, with atoms as text; goes out a table, HTML, JSON, a mapping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np

from mlnlite.results.rows import Bool, Float, Int64, Rows, Statistics
from mlnlite.results.table import json_number, order_of_rows
from mlnlite.results.why import Alternative, PaidGrounding

_PAID = 10


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
class MapState(Rows[bool]):
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
        paid: the groundings of soft formulas that the world pays for, dearest first, if somebody asked.
        alternative: the best world in which one atom is the other way round, if somebody asked.
    """

    truth: Bool
    methods: tuple[str, ...]
    log_weight: float
    bound: float
    status: str
    violated: tuple[Violation, ...] = ()
    statistics: Statistics = field(default_factory=Statistics)
    block: Int64 | None = None
    cost: float = float("nan")
    open_cost: float = float("nan")
    gap: float = float("nan")
    margins: Float | None = None
    paid: tuple[PaidGrounding, ...] = ()
    alternative: Alternative | None = None

    def __post_init__(self) -> None:
        """The gap follows from bound and log-weight if it is not given."""
        Rows.__post_init__(self)
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
        return bool(self.truth[self.row(name)])

    def to_text(self, limit: int | None = None) -> str:
        """The true atoms, then the formulas that they violate.

        Args:
            limit: show at most so many rows.
        """
        worst = sorted(self.violated, key=lambda v: -v.cost)
        paid = [f"pays {v.cost:.4g} for {v.formula} ({v.n_groundings:,} x {v.weight:.4g})" for v in worst[:_PAID]]
        rest = worst[_PAID:]
        paid += [f"pays {sum(v.cost for v in rest):.4g} for {len(rest):,} more formulas"] if rest else []
        paid += [f"  {grounding}" for grounding in self.paid[:_PAID]]
        paid += [f"  and {len(self.paid) - _PAID:,} more groundings"] if len(self.paid) > _PAID else []
        paid += [] if self.alternative is None else [str(self.alternative)]
        weight = f"log-weight {self.log_weight:.6f}, bound {self.bound:.6f}, gap {self.gap:.3g}"
        summary = [f"status: {self.status}, {weight}"]
        if isfinite(self.cost):
            open_ = f"{self.open_cost:.6f} of it where evidence leaves a choice"
            summary.insert(0, f"cost: {self.cost:.6f}, {open_}; no world costs less than {self.cost - self.gap:.6f}")
        none = [] if self.truth.any() else [f"none of {len(self.names):,} atoms is true"]
        return self.table(limit, [*none, *paid, *summary, str(self.statistics)])

    def head(self) -> tuple[str, ...]:
        """Names of the columns of the table."""
        return ("true atom", "method") if self.margins is None else ("true atom", "margin", "method")

    def order(self) -> list[int]:
        """The true atoms."""
        return [i for i in order_of_rows(self.names, self.block) if self.truth[i]]

    def cells(self, rows: Sequence[int]) -> list[tuple[str, ...]]:
        """Cells of the table."""
        if self.margins is None:
            return [(self.names[i], self.methods[i]) for i in rows]
        return [(self.names[i], f"{self.margins[i]:.4f}", self.methods[i]) for i in rows]

    def caption(self) -> str:
        """The whole in a line."""
        return f"status: {self.status}, log-weight {self.log_weight:.4f}, gap {self.gap:.3g}"

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
            "paid": [grounding.to_dict() for grounding in self.paid],
            "alternative": None if self.alternative is None else self.alternative.to_dict(),
            "statistics": self.statistics.to_dict(),
        }

    def columns(self) -> dict[str, list[Any]]:
        """All that is known of each atom, by name of the column."""
        margins = {} if self.margins is None else {"margin": self.margins.tolist()}
        return {"name": [*self.names], "truth": self.truth.tolist(), "method": [*self.methods], **margins}
