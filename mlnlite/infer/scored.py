"""What a given world is worth, formula by formula. Model, evidence and world in, `Score` out.

The counts come from counting joins on the reference engine, not from a network, so they check what inference says.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlnlite.errors import Diagnostic, EvidenceMistake
from mlnlite.ground.count import count_true
from mlnlite.ground.ground import ground
from mlnlite.ground.network import Network
from mlnlite.model.evidence import Evidence, Facts
from mlnlite.model.model import Model


@dataclass(frozen=True, slots=True)
class FormulaScore:
    """One template in a world.

    Attributes:
        formula: its text.
        weight: of its row, or `nan` where the rows differ.
        n_true: true groundings.
        n_groundings: all of them.
        cost: weight of the false groundings of positive weights and the true ones of negative weights.
        open_cost: the part of it on groundings that evidence leaves open.
    """

    formula: str
    weight: float
    n_true: int
    n_groundings: int
    cost: float
    open_cost: float


@dataclass(frozen=True, slots=True)
class Score:
    """A world's worth.

    Attributes:
        log_weight: sum of weights times true groundings; minus infinity if a hard formula is violated.
        cost: weight of false groundings of positive weights and of true ones of negative weights.
        open_cost: the part of it on groundings that evidence leaves open.
        n_hard_violated: groundings of hard formulas that are false.
        formulas: the same for each template.
    """

    log_weight: float
    cost: float
    open_cost: float
    n_hard_violated: int
    formulas: tuple[FormulaScore, ...]

    def __str__(self) -> str:
        """A table of the formulas that cost something, and the sums."""
        lines = [f"{'cost':>14}  {'open':>14}  {'true':>12}  {'groundings':>12}  formula"]
        for f in sorted(self.formulas, key=lambda f: -f.cost):
            if f.cost:
                head = f"{f.cost:>14.4f}  {f.open_cost:>14.4f}  {f.n_true:>12,}  {f.n_groundings:>12,}"
                lines.append(f"{head}  {f.formula}")
        lines.append(f"{self.cost:>14.4f}  {self.open_cost:>14.4f}  total cost")
        lines.append(f"log-weight {self.log_weight:.6f}, violated hard groundings {self.n_hard_violated:,}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """Plain data."""
        finite = np.isfinite(self.log_weight)
        return {
            "log_weight": self.log_weight if finite else None,
            "cost": self.cost,
            "open_cost": self.open_cost,
            "n_hard_violated": self.n_hard_violated,
            "formulas": [{name: _plain(getattr(f, name)) for name in FormulaScore.__slots__} for f in self.formulas],
        }

    def to_json(self) -> str:
        """JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False)


def _plain(value: object) -> object:
    return None if isinstance(value, float) and not np.isfinite(value) else value


def score(model: Model, evidence: Evidence, world: Evidence) -> Score:
    """What a world is worth given evidence.

    Args:
        model: a model with weights.
        evidence: one database; it says which groundings are open.
        world: one database read with the same model: the true atoms. What neither it nor the evidence says is false.

    Raises:
        EvidenceMistake: if the world contradicts the evidence or has other constants.
        Contradiction: if evidence makes a hard formula false.
    """
    whole = _together(evidence, world)
    network = ground(model, evidence)
    true = count_true(network.model, whole)
    open_true = true - network.decided_true
    weights = network.weights
    hard = np.isposinf(weights)
    soft = np.where(hard, 0.0, weights)
    false = network.n_groundings - true
    cost = np.where(soft > 0, soft * false, -soft * true)
    open_cost = np.where(soft > 0, soft * (network.n_open - open_true), -soft * open_true)
    n_violated = int(false[hard].sum())
    return Score(
        log_weight=-np.inf if n_violated else float(soft @ true),
        cost=float(cost.sum()),
        open_cost=float(open_cost.sum()),
        n_hard_violated=n_violated,
        formulas=_by_template(network, {"true": true, "cost": cost, "open": open_cost}),
    )


def _by_template(network: Network, columns: Mapping[str, NDArray[Any]]) -> tuple[FormulaScore, ...]:
    scores = []
    for i, template in enumerate(network.model.templates):
        mine = network.template == i
        scores.append(
            FormulaScore(
                formula=template.text,
                weight=float(template.weights[0]) if len(set(template.weights.tolist())) == 1 else float("nan"),
                n_true=int(columns["true"][mine].sum()),
                n_groundings=int(network.n_groundings[mine].sum()),
                cost=float(columns["cost"][mine].sum()),
                open_cost=float(columns["open"][mine].sum()),
            )
        )
    return tuple(scores)


def _together(evidence: Evidence, world: Evidence) -> Evidence:
    """The facts of the evidence and those of the world."""
    facts = {}
    for name, t in world.types.items():
        known = evidence.types[name].constants
        if t.constants != known[: len(t.constants)]:
            unknown = [c for c in t.constants if c not in evidence.types[name].index]
            hint = "the world may only use constants of the model and the evidence; read it after them"
            message = f"the world has other constants of the type {name}: {', '.join(unknown[:5]) or 'another order'}"
            raise EvidenceMistake([Diagnostic("E322", message, hint=hint)])
    for name, table in evidence.facts.items():
        of_world = world.facts[name]
        rows = np.concatenate([table.arguments, of_world.arguments])
        truth = np.concatenate([table.truth, of_world.truth])
        order = np.lexsort((*reversed(rows.T), np.zeros(len(rows))))
        rows, truth = rows[order], truth[order]
        again = np.zeros(len(rows), bool)
        again[1:] = (rows[1:] == rows[:-1]).all(axis=1)
        if (again[1:] & (truth[1:] != truth[:-1])).any():
            i = int(np.flatnonzero(again[1:] & (truth[1:] != truth[:-1]))[0])
            atom = evidence.atom_text(int(evidence.atom_number(name, rows[i : i + 1])[0]))
            raise EvidenceMistake([Diagnostic("E323", f"the world contradicts the evidence about {atom}")])
        facts[name] = Facts(np.zeros(int((~again).sum()), np.int32), rows[~again], truth[~again])
    return replace(evidence, facts=facts)
