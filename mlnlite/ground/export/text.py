"""Ground formulas as a person reads them, each with where it came from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mlnlite.ground.export.factors import clause_factors, table_factors
from mlnlite.ground.network import Network


def text(network: Network) -> str:
    """One line for each open ground formula: its gain, its literals, its template."""
    names = network.evidence.atom_texts(network.atoms)
    lines = [f"// {network.n_atoms:,} unknown atoms, {network.n_factors:,} ground formulas"]
    for factor in clause_factors(network):
        lines.append(f"{_weighted(_clause(factor.literals, names), factor.gain)}  // {origin(network, factor.weight)}")
    for table in table_factors(network):
        rows = [_conjunction(table.atoms, cell, names) for cell in np.argwhere(table.truth).tolist()]
        formula = " v ".join(f"({row})" for row in rows)
        lines.append(f"{_weighted(formula, table.gain)}  // {origin(network, table.weight)}")
    return "\n".join(lines) + "\n"


def origin(network: Network, weight: int) -> str:
    """The template of a weight, and its place."""
    template = network.model.templates[network.template[weight]]
    return f"{template.name} at {template.span.place}" if template.span else template.name


def _weighted(formula: str, gain: float) -> str:
    """The formula with its weight; a hard one, or the negation of a hard one, with a dot."""
    if np.isposinf(gain):
        return f"{formula}."
    return f"!({formula})." if np.isneginf(gain) else f"{gain:.6g} {formula}"


def _clause(literals: Sequence[int], names: Sequence[str]) -> str:
    return " v ".join(("" if x > 0 else "!") + names[abs(x) - 1] for x in literals)


def _conjunction(atoms: Sequence[int], cell: Sequence[int], names: Sequence[str]) -> str:
    return " ^ ".join(("" if value else "!") + names[a] for a, value in zip(atoms, cell, strict=True))
