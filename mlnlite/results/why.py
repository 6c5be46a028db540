"""Why a most probable world: the groundings that it pays for, and the best world with one atom the other way round."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from mlnlite.results.table import json_number

_SHOWN = 10


@dataclass(frozen=True, slots=True)
class PaidGrounding:
    """A grounding of a soft formula that a world violates (or fulfils, if the weight is negative).

    Attributes:
        formula: its text.
        binding: variables and constants.
        weight: log weight of the formula.
    """

    formula: str
    binding: tuple[tuple[str, str], ...]
    weight: float

    @property
    def cost(self) -> float:
        """Log-weight that the world loses."""
        return abs(self.weight)

    def __str__(self) -> str:
        """One line."""
        values = ", ".join(f"{name} = {constant}" for name, constant in self.binding)
        return f"{self.cost:.4g} for {self.formula}" + (f" with {values}" if values else "")

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        return {"formula": self.formula, "binding": dict(self.binding), "weight": self.weight}


@dataclass(frozen=True, slots=True)
class Alternative:
    """The best world in which an atom is the other way round.

    Attributes:
        atom: its text.
        margin: log-weight that this world loses against the most probable one; infinity if there is no such world.
        slack: by how much the margin may be smaller; 0 if that world is proved best.
        changes: atoms that are otherwise there, `!` before those that become false; the atom itself is among them.
        pays: groundings that only that world pays for.
        saves: groundings that only the most probable world pays for.
    """

    atom: str
    margin: float
    slack: float
    changes: tuple[str, ...] = ()
    pays: tuple[PaidGrounding, ...] = ()
    saves: tuple[PaidGrounding, ...] = ()

    def __str__(self) -> str:
        """What would be otherwise, and what that costs."""
        if not isfinite(self.margin):
            return f"{self.atom} cannot be the other way round: hard formulas or evidence force it"
        within = f" (at least {self.margin - self.slack:.6f})" if self.slack > 0 else ""
        lines = [f"with {self.changes[0]} the best world loses {self.margin:.6f}{within}"]
        lines += [f"  also changes: {', '.join(self.changes[1:])}"] if len(self.changes) > 1 else []
        for word, groundings in (("pays", self.pays), ("saves", self.saves)):
            lines += [f"  {word} {g}" for g in groundings[:_SHOWN]]
            lines += [f"  {word} {len(groundings) - _SHOWN:,} more"] if len(groundings) > _SHOWN else []
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        return {
            "atom": self.atom,
            "margin": json_number(self.margin),
            "slack": json_number(self.slack),
            "changes": list(self.changes),
            "pays": [g.to_dict() for g in self.pays],
            "saves": [g.to_dict() for g in self.saves],
        }
