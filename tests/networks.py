"""Small networks built by hand or at random, and what they mean, by listing all their worlds."""

from __future__ import annotations

from itertools import product

import numpy as np
from hypothesis import strategies as st

from mlnlite.ground.network import Clauses, Counts, Network, Tables
from mlnlite.model.evidence import Evidence
from mlnlite.model.formulas import Any, AtomRef, Formula
from mlnlite.model.model import Model
from mlnlite.model.templates import Template


def network(blocks, clauses=(), tables=(), weights=(), decided_true=None, undecided_false=None, counts=()):
    """A network whose atoms have no meaning.

    blocks: for each variable ("", 1), ("!", number of atoms) or ("?", number of atoms).
    clauses: (list of (literals, weight index, count), negated), literals of equal length.
    tables: (truth, list of (atoms, weight index, count)).
    counts: (true groundings at each state, list of (literals, weight index, count), and steps if they are not 1).
    """
    variable, value, cardinality, is_block = [], [], [], []
    for v, (marker, n) in enumerate(blocks):
        variable += [v] * n
        value += range(n) if marker == "!" else range(1, n + 1)
        cardinality.append(n if marker == "!" else n + 1)
        is_block.append(marker != "")
    n_weights = len(weights)
    clause_blocks = []
    for rows, negated in clauses:
        literals = np.array([sorted(r[0], key=abs) for r in rows], np.int32).reshape(len(rows), -1)
        clause_blocks.append(Clauses(literals, *_columns(rows), negated))
    table_blocks = [
        Tables(np.array([r[0] for r in rows], np.int32).reshape(len(rows), -1), np.array(truth, bool), *_columns(rows))
        for truth, rows in tables
    ]
    count_blocks = [
        Counts(
            np.array([r[0] for r in rows], np.int32), np.array(true, np.int64), *_columns(rows), _steps(rows, *steps)
        )
        for true, rows, *steps in counts
    ]
    decided = np.zeros(n_weights, np.int64) if decided_true is None else np.array(decided_true, np.int64)
    total = decided + (0 if undecided_false is None else np.array(undecided_false, np.int64))
    for b in (*clause_blocks, *table_blocks):
        np.add.at(total, b.weight, b.count)
    for b in count_blocks:
        np.add.at(total, b.weight, b.count * b.true.max())
    templates = tuple(
        Template(
            f"formula {i + 1}", Formula((), (), Any((AtomRef(0),))), (), None, np.array([w], float), text=f"f{i + 1}"
        )
        for i, w in enumerate(weights)
    )
    return Network(
        Model({}, {}, templates), Evidence({}, {}, {}, {}), np.arange(len(variable), dtype=np.int64),
        np.array(variable, np.int32), np.array(value, np.int32), np.array(cardinality, np.int32),
        np.array(is_block, bool), tuple(clause_blocks), tuple(table_blocks), np.array(weights, float),
        np.arange(n_weights, dtype=np.int32), decided, total, tuple(count_blocks),
    )  # fmt: skip


def _columns(rows):
    return np.array([r[1] for r in rows], np.int32), np.array([r[2] for r in rows], np.int64)


def _steps(rows, steps=None):
    return np.ones(len(rows[0][0]), np.int32) if steps is None else np.array(steps, np.int32)


def worlds(net):
    """Truth values of the atoms in every world: shape (n_worlds, n_atoms)."""
    values = np.array(list(product(*map(range, net.cardinality.tolist()))), np.int64).reshape(-1, net.n_variables)
    return values[:, net.variable] == net.value


def world_counts(net, truth):
    """True groundings of each weight, one by one."""
    counts = net.decided_true.copy()
    for c in net.clauses:
        for literals, w, n in zip(c.literals.tolist(), c.weight, c.count, strict=True):
            holds = any(bool(truth[abs(x) - 1]) == (x > 0) for x in literals)
            counts[w] += n * (holds != c.negated)
    for t in net.tables:
        for atoms, w, n in zip(t.atoms.tolist(), t.weight, t.count, strict=True):
            counts[w] += n * bool(t.truth[tuple(int(truth[a]) for a in atoms)])
    for c in net.counts:
        for literals, w, n in zip(c.literals.tolist(), c.weight, c.count, strict=True):
            holds = [bool(truth[abs(x) - 1]) == (x > 0) for x in literals]
            counts[w] += n * c.true[sum(step for step, is_true in zip(c.steps, holds, strict=True) if is_true)]
    return counts


def world_weight(net, truth):
    """Log-weight of a world, by its definition."""
    counts = world_counts(net, truth)
    hard = np.isposinf(net.weights)
    if np.any(counts[hard] < net.n_groundings[hard]):
        return -np.inf
    return float(counts[~hard] @ net.weights[~hard])


@st.composite
def networks(draw, max_atoms=10, hard=True, with_counts=True):
    """Random networks with blocks, clauses, conjunctions, tables, counting factors, zero, negative and hard weights."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    blocks, n = [], 0
    target = draw(st.integers(1, max_atoms))
    while n < target:
        marker = str(rng.choice(["", "", "", "!", "?"]))
        size = 1 if not marker else min(int(rng.integers(1, 5)), target - n)
        blocks.append((marker, size))
        n += size
    weights = [round(float(w), 2) for w in rng.normal(0, 1.5, rng.integers(2, 7))] + [0.0]
    if hard:
        weights += [np.inf] * int(rng.integers(0, 3))
    clauses = []
    for _ in range(rng.integers(0, 6)):
        k = min(int(rng.integers(1, 5)), n)
        rows = [_row(rng, n, k, weights, signed=True) for _ in range(rng.integers(1, 4))]
        clauses.append((rows, bool(rng.random() < 0.3)))
    tables = []
    for _ in range(rng.integers(0, 3)):
        k = min(int(rng.integers(1, 4)), n)
        truth = rng.random((2,) * k) < 0.5
        tables.append((truth, [_row(rng, n, k, weights, signed=False) for _ in range(rng.integers(1, 3))]))
    counts = []
    for _ in range(rng.integers(0, 3) if with_counts else 0):
        k = min(int(rng.integers(1, 7)), n)
        steps = rng.choice([np.ones(k, int), np.sort(rng.integers(1, 4, k))])
        n_states = steps.sum() + 1
        true = rng.choice([rng.integers(0, 2, n_states), rng.integers(0, 4, n_states), np.arange(n_states)])
        counts.append((true, [_row(rng, n, k, weights, signed=True) for _ in range(rng.integers(1, 3))], steps))
    decided = rng.integers(0, 3, len(weights))
    return network(blocks, clauses, tables, weights, decided, counts=counts)


@st.composite
def attracting_networks(draw, max_atoms=12):
    """Random networks of formulas over at most two atoms that attract each other once some are negated; some hard."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(2, max_atoms))
    positive = [round(float(w), 2) for w in rng.exponential(1.5, 3)]
    weights, flip = [*positive, *(-w for w in positive), np.inf], rng.random(n) < 0.5
    clauses = []
    for _ in range(rng.integers(1, 3 * n)):
        a, b = rng.choice(n, 2, replace=False)
        signs, negated = rng.random(2) < 0.5, bool(rng.random() < 0.3)
        attracts = (signs[0] ^ flip[a]) != (signs[1] ^ flip[b])  # what is lost where the clause is false
        kind = rng.choice([0, 1, 2, 6] if attracts != negated else [3, 4, 5])
        literals = [int(x + 1) * (1 if sign else -1) for x, sign in zip((a, b), signs, strict=True)]
        kind = kind if not negated else kind % 6
        clauses.append(([(literals, int(kind), int(rng.integers(1, 4)))], negated))
    clauses += [([_row(rng, n, 1, weights, signed=True)], False) for _ in range(rng.integers(0, n + 1))]
    return network([("", 1)] * n, clauses, (), weights)


def _row(rng, n, k, weights, signed):
    atoms = rng.choice(n, k, replace=False)
    literals = [int(a + 1) * int(rng.choice([-1, 1])) for a in atoms] if signed else [int(a) for a in atoms]
    return literals, int(rng.integers(len(weights))), int(rng.integers(1, 4))
