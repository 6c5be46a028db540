"""Why no world is possible: comes in a network, goes out a `Contradiction` naming formulas."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from mlnlite.errors import Contradiction, Diagnostic
from mlnlite.ground.network import Network
from mlnlite.infer.reduce.counting import count_clauses
from mlnlite.infer.reduce.potentials import decided_false
from mlnlite.model.templates import Template


def contradiction(network: Network) -> Contradiction:
    """The error for a network whose hard formulas no world satisfies.

    It names every template of a set of hard formulas that exclude each other and that is as small as leaving out one
    after the other can make it. (Formulas of which evidence alone makes a grounding false are named without search.)
    """
    weights = decided_false(network).tolist()
    templates = sorted({int(network.template[w]) for w in weights or _core(network)})
    return contradiction_of([network.model.templates[t] for t in templates], decided=bool(weights))


def contradiction_of(named: Sequence[Template], *, decided: bool = False) -> Contradiction:
    """The error that names hard formulas.

    Args:
        named: which exclude each other.
        decided: evidence alone makes a grounding of each of them false.
    """
    if decided:
        what = "the evidence makes it false, and it is hard"
    elif len(named) > 1:
        what = f"no world satisfies these {len(named)} hard formulas together with the evidence"
    else:
        what = "no world satisfies this hard formula together with the evidence"
    hint = "correct the evidence, or give one of them a finite weight"
    return Contradiction(
        [Diagnostic("E405", f"{t.name}: {t.text}: {what}", t.span, hint if t is named[-1] else "") for t in named]
        or [Diagnostic("E405", "no world is possible", hint="look for functional predicates without a possible value")]
    )


def _core(network: Network) -> list[int]:
    """Hard weights that exclude each other: the solver's core, less each that can be left out."""
    from pysat.solvers import Solver

    first = network.n_atoms + 1
    with Solver(name="cadical153") as solver:
        for literals in block_clauses(network):
            solver.add_clause(literals)
        for weight, literals in hard_clauses(network, first + len(network.weights)):
            solver.add_clause([-(first + weight), *literals])
        core = np.flatnonzero(np.isposinf(network.weights)) + first
        if solver.solve(assumptions=core.tolist()):
            return []
        keep = sorted(solver.get_core() or [])
        for w in list(keep):
            rest = [x for x in keep if x != w]
            if w in keep and not solver.solve(assumptions=rest):
                keep = sorted(solver.get_core() or [])
    return [int(w) - first for w in keep]


def block_clauses(network: Network) -> Iterator[list[int]]:
    """Clauses that give each block one value."""
    order = np.argsort(network.variable, kind="stable")
    starts = np.searchsorted(network.variable[order], np.arange(network.n_variables + 1))
    for v in np.flatnonzero(network.block).tolist():
        atoms = (order[starts[v] : starts[v + 1]] + 1).tolist()
        if len(atoms) == network.cardinality[v]:
            yield atoms
        yield from ([-a, -b] for a, b in combinations(atoms, 2))


def hard_clauses(network: Network, free: int) -> Iterator[tuple[int, list[int]]]:
    """Clauses of the hard groundings, each with its weight.

    Args:
        network: of the formulas.
        free: number of the first variable that may stand for partial counts; atom a is variable a + 1.
    """
    hard = np.isposinf(network.weights)
    for block in network.clauses:
        rows = hard[block.weight]
        for weight, literals in zip(block.weight[rows].tolist(), block.literals[rows].tolist(), strict=True):
            if block.negated:
                yield from ((weight, [-x]) for x in literals)
            else:
                yield weight, literals
    for table in network.tables:
        rows = hard[table.weight]
        signs = 1 - 2 * np.argwhere(~table.truth)
        for weight, atoms in zip(table.weight[rows].tolist(), table.atoms[rows], strict=True):
            yield from ((weight, literals) for literals in ((atoms + 1) * signs).tolist())
    yield from count_clauses(network, free)
