"""The network: what is left of a model once its evidence is known, as arrays. Comes out of `ground`, goes into `infer`.

Indices: `a` runs over unknown atoms, `v` over variables, `w` over weights (the rows of all templates, one after the
other). A literal is a number: `a + 1` for the atom, `-(a + 1)` for its negation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mlnlite.model.evidence import Evidence
from mlnlite.model.model import Model

Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Clauses:
    """Ground formulas that are clauses over the same number of distinct unknown atoms.

    Attributes:
        literals: shape (n, k), each row sorted by atom, no atom twice.
        weight: shape (n,), index of each one's weight.
        count: shape (n,), how many equal groundings it stands for.
        negated: the formula is the *negation* of the clause (a conjunction): it is true where the clause is false.
    """

    literals: Int32
    weight: Int32
    count: Int64
    negated: bool = False


@dataclass(frozen=True, slots=True)
class Tables:
    """Ground formulas that have the same truth table over their unknown atoms.

    Attributes:
        atoms: shape (n, k), distinct atoms of each.
        truth: shape (2,) * k, indexed by the truth values of the atoms in that order.
        weight: shape (n,), index of each one's weight.
        count: shape (n,), how many equal groundings it stands for.
    """

    atoms: Int32
    truth: Bool
    weight: Int32
    count: Int64


@dataclass(frozen=True, slots=True)
class Counts:
    """Ground formulas whose number of true groundings depends on counts only.

    The state of a factor is the sum of the steps of its true literals. Where all steps are 1 it is their number: "at
    most one advisor" over all pairs of 50 candidates is 1,225 clauses, or one function of how many are advisors. In
    `Popular(x) <=> count(Friend(x, y) | y) >= 2` the friends have step 1 and the other atom a step larger than
    their number, so that both can be read off the state.

    Attributes:
        literals: shape (n, m), each row sorted by atom where steps are equal, no atom twice.
        true: shape (sum(steps) + 1,), number of true groundings at each state; the largest is the number of groundings.
        weight: shape (n,), index of each one's weight.
        count: shape (n,), how often each grounding is there.
        steps: shape (m,), positive, what each literal adds to the state.
    """

    literals: Int32
    true: Int64
    weight: Int32
    count: Int64
    steps: Int32

    @property
    def plain(self) -> bool:
        """Whether the state is the number of true literals."""
        return bool((self.steps == 1).all())


@dataclass(frozen=True, slots=True)
class Network:
    """Variables over unknown atoms, and factors.

    The log-weight of a world is `sum_w weights[w] * n_w`, with `n_w` the number of true groundings, those that
    evidence decides (`decided_true[w]`) included; it is minus infinity if a grounding of a hard formula is false.

    Attributes:
        model: where it came from.
        evidence: with all that follows from functional predicates and closed worlds drawn.
        atoms: shape (n_atoms,), number of each unknown atom in `Evidence.atom_number` order, rising.
        variable: shape (n_atoms,), the variable of each atom.
        value: shape (n_atoms,), the value of that variable at which the atom is true (0 is "false" or "none").
        cardinality: shape (n_variables,), number of values of each variable: 2 for a single atom; for a block
            `P(x, y!)` the number of its open atoms, whose values are 0, 1, ...; for `P(x, y?)` one more (0 is none).
        block: shape (n_variables,), whether the variable is a block.
        clauses: clause factors.
        tables: table factors.
        counts: counting factors.
        weights: shape (n_weights,), log weights, `inf` for hard.
        template: shape (n_weights,), index of each weight's template in `model.templates`.
        decided_true: shape (n_weights,), number of groundings that evidence makes true.
        n_groundings: shape (n_weights,), number of all groundings.
    """

    model: Model
    evidence: Evidence
    atoms: Int64
    variable: Int32
    value: Int32
    cardinality: Int32
    block: Bool
    clauses: tuple[Clauses, ...]
    tables: tuple[Tables, ...]
    weights: Float
    template: Int32
    decided_true: Int64
    n_groundings: Int64
    counts: tuple[Counts, ...] = ()

    @property
    def n_atoms(self) -> int:
        """Number of unknown atoms that some factor or question touches."""
        return len(self.atoms)

    @property
    def n_variables(self) -> int:
        """Number of variables."""
        return len(self.cardinality)

    @property
    def n_open(self) -> Int64:
        """For each weight, the number of groundings that evidence leaves open."""
        total = np.zeros(len(self.weights), np.int64)
        for clauses in self.clauses:
            total += np.bincount(clauses.weight, clauses.count, len(total)).astype(np.int64)
        for tables in self.tables:
            total += np.bincount(tables.weight, tables.count, len(total)).astype(np.int64)
        for counts in self.counts:
            largest = int(counts.true.max(initial=0))
            total += largest * np.bincount(counts.weight, counts.count, len(total)).astype(np.int64)
        return total

    @property
    def n_factors(self) -> int:
        """Number of distinct ground formulas that evidence leaves open."""
        n_clauses = sum(len(c.literals) for c in self.clauses)
        return n_clauses + sum(len(t.atoms) for t in self.tables) + sum(len(c.literals) for c in self.counts)
