"""Exact probabilities of ground formulas: comes in a network and expressions over its atoms, go out numbers.

Each part of an expression gets an auxiliary variable that is 1 exactly where that part is true (Tseitin 1968), so a
formula is as wide as its atoms are entangled, not as it is long, and what it asks is a marginal like any other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mlnlite.ground.network import Float, Network
from mlnlite.infer.conflict import contradiction
from mlnlite.infer.exact.marginal import WIDTH_LIMIT, Distributions, Rung, distributions_of, limit_reached
from mlnlite.infer.reduce.conjunctions import Conjunctions
from mlnlite.infer.reduce.potentials import potentials_of
from mlnlite.model.formulas import All, Any, AtomRef, Expression, Iff, Not


@dataclass(frozen=True, slots=True)
class Literal:
    """`variable = value`, or `variable != value`."""

    variable: int
    value: int
    equal: bool = True


@dataclass(slots=True)
class Definitions:
    """Auxiliary variables and what defines them.

    Attributes:
        network: whose atoms the expressions are over.
        forbidden: conjunctions that no world may satisfy.
        n_auxiliary: number of variables after those of the network.
    """

    network: Network
    forbidden: list[tuple[Literal, ...]] = field(default_factory=list)
    n_auxiliary: int = 0


def formula_probability(network: Network, formula: Expression, *, width_limit: int = WIDTH_LIMIT) -> float:
    """Probability of one formula; see `formula_probabilities`."""
    return float(formula_probabilities(network, [formula], width_limit=width_limit)[0])


def formula_probabilities(
    network: Network, formulas: Sequence[Expression], *, width_limit: int = WIDTH_LIMIT, rung: Rung | None = None
) -> Float:
    """Probabilities of formulas, all at once where that is not too wide, else in smaller groups.

    Args:
        network: what was ground.
        formulas: expressions of `AtomRef`, `Not`, `All`, `Any`, `Iff`; an `AtomRef` is an index into `network.atoms`.
        width_limit: largest number of entries of a table.
        rung: what to try with components past the limit.

    Returns:
        Shape (n_formulas,).

    Raises:
        Contradiction: no world satisfies the hard formulas.
        LimitReached: a component is too wide.
        QueryMistake: a weight is not known.
    """
    definitions = Definitions(network)
    literals = [define(definitions, f) for f in formulas]
    extra = _conjunctions(definitions.forbidden)
    potentials = potentials_of(network, extra, definitions.n_auxiliary, chained=True)
    wanted = np.zeros(len(potentials.cardinality), np.bool_)
    wanted[[x.variable for x in literals if isinstance(x, Literal)]] = True
    found = distributions_of(potentials, wanted, wanted, width_limit, rung)
    if np.isneginf(found.constant) or np.isneginf(found.log_z).any():
        raise contradiction(network)
    if found.wide and len(formulas) == 1:
        raise limit_reached(network, found.wide, width_limit)
    probability = np.array([_probability(found, x) for x in literals], float)
    left = np.flatnonzero(np.isnan(probability))
    for part in np.array_split(left, 2):
        if len(part):
            asked = [formulas[i] for i in part]
            probability[part] = formula_probabilities(network, asked, width_limit=width_limit, rung=rung)
    return probability


def _probability(found: Distributions, literal: Literal | bool) -> float:
    """Probability of a literal, nan if its component was too wide."""
    if isinstance(literal, bool):
        return float(literal)
    p = float(found.probability[found.start[literal.variable] + literal.value])
    return p if literal.equal else 1.0 - p


def define(definitions: Definitions, formula: Expression) -> Literal | bool:
    """A literal that is true exactly where the formula is, or the truth value that it has everywhere."""
    match formula:
        case AtomRef(a):
            return Literal(int(definitions.network.variable[a]), int(definitions.network.value[a]))
        case Not(part):
            return negation(define(definitions, part))
        case All(parts):
            return _all(definitions, [define(definitions, p) for p in parts])
        case Any(parts):
            return negation(_all(definitions, [negation(define(definitions, p)) for p in parts]))
        case Iff(left, right):
            return _iff(definitions, define(definitions, left), define(definitions, right))
        case _:
            raise TypeError(f"not a ground formula: {formula}")


def negation(literal: Literal | bool) -> Literal | bool:
    """The opposite."""
    return not literal if isinstance(literal, bool) else replace(literal, equal=not literal.equal)


def _new(definitions: Definitions) -> tuple[Literal, Literal]:
    """A new auxiliary variable: the literals for 1 and for 0."""
    variable = definitions.network.n_variables + definitions.n_auxiliary
    definitions.n_auxiliary += 1
    return Literal(variable, 1), Literal(variable, 0)


def _all(definitions: Definitions, parts: Sequence[Literal | bool]) -> Literal | bool:
    """A literal for a conjunction."""
    literals = list(dict.fromkeys(p for p in parts if isinstance(p, Literal)))
    if any(p is False for p in parts):
        return False
    if len(literals) < 2:
        return literals[0] if literals else True
    yes, no = _new(definitions)
    definitions.forbidden.append((no, *literals))
    definitions.forbidden += [(yes, replace(x, equal=not x.equal)) for x in literals]
    return yes


def _iff(definitions: Definitions, left: Literal | bool, right: Literal | bool) -> Literal | bool:
    """A literal for "both or neither"."""
    if isinstance(left, bool):
        return right if left else negation(right)
    if isinstance(right, bool):
        return left if right else negation(left)
    yes, no = _new(definitions)
    not_left, not_right = replace(left, equal=not left.equal), replace(right, equal=not right.equal)
    definitions.forbidden += [
        (yes, left, not_right),
        (yes, not_left, right),
        (no, left, right),
        (no, not_left, not_right),
    ]
    return yes


def _conjunctions(forbidden: Sequence[tuple[Literal, ...]]) -> list[Conjunctions]:
    """Forbidden conjunctions as arrays, one for each length."""
    arrays = []
    for k in sorted({len(f) for f in forbidden}):
        rows = [f for f in forbidden if len(f) == k]
        variable = np.array([[x.variable for x in row] for row in rows], np.int32)
        value = np.array([[x.value for x in row] for row in rows], np.int32)
        equal = np.array([[x.equal for x in row] for row in rows], np.bool_)
        arrays.append(Conjunctions(variable, value, equal, np.full(len(rows), -np.inf)))
    return arrays
