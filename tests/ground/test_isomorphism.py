"""Renamed copies of a component are found, near-copies are not, and twins have equal factors around them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.ground.isomorphism import copies
from mlnlite.ground.network import Clauses, Counts, Tables
from mlnlite.infer.reduce.components import labels_of
from mlnlite.infer.score import log_weight
from tests.networks import networks


def scopes(net):
    atoms = [np.abs(c.literals) - 1 for c in (*net.clauses, *net.counts)] + [t.atoms for t in net.tables]
    return [net.variable[a] for a in atoms]


def components(net):
    return labels_of(net.n_variables, scopes(net))


def twice(net, rng):
    """The network and a copy of it with its atoms and its variables in another order; where each atom went."""
    n, m = net.n_atoms, net.n_variables
    shuffled, variables = rng.permutation(n), rng.permutation(m)
    place = np.empty(n, np.int64)
    place[shuffled] = np.arange(n)

    def both(literals):
        moved = (place[np.abs(literals) - 1] + 1 + n) * np.sign(literals)
        return np.concatenate([literals, moved]).astype(np.int32)

    def rows(block):
        return np.concatenate([block.weight] * 2), np.concatenate([block.count] * 2)

    where = np.empty(m, np.int64)
    where[variables] = np.arange(m)
    clauses = tuple(Clauses(both(c.literals), *rows(c), c.negated) for c in net.clauses)
    tables = tuple(Tables(both(t.atoms + 1) - 1, t.truth, *rows(t)) for t in net.tables)
    counts = tuple(Counts(both(c.literals), c.true, *rows(c), c.steps) for c in net.counts)
    doubled = replace(
        net,
        atoms=np.arange(2 * n),
        variable=np.concatenate([net.variable, where[net.variable[shuffled]] + m]).astype(np.int32),
        value=np.concatenate([net.value, net.value[shuffled]]),
        cardinality=np.concatenate([net.cardinality, net.cardinality[variables]]),
        block=np.concatenate([net.block, net.block[variables]]),
        clauses=clauses,
        tables=tables,
        counts=counts,
        decided_true=net.decided_true * 2,
        n_groundings=net.n_groundings * 2,
    )
    return doubled


@settings(max_examples=150, deadline=None)
@given(networks(), st.integers(0, 1000))
def test_a_renamed_copy_is_found(net, seed):
    rng = np.random.default_rng(seed)
    doubled = twice(net, rng)
    label = components(doubled)
    found = copies(doubled, label)
    half = int(label[: net.n_variables].max(initial=-1)) + 1
    assert (found.original[half:] < half).all()
    assert found.count.sum() == len(found.original)
    truth = rng.random(net.n_atoms) < 0.5
    blocks = [np.flatnonzero(net.variable == v) for v in np.flatnonzero(net.block)]
    for members in blocks:
        truth[members] = np.arange(len(members)) == rng.integers(len(members))
    world = np.concatenate([truth, np.zeros(net.n_atoms, bool)])
    mirrored = world[found.twin]
    once = log_weight(net, truth)
    assert log_weight(doubled, mirrored) == pytest.approx(_of_originals(net, found, label, truth, once), abs=1e-9)


def _of_originals(net, found, label, truth, once):
    """Twice the log-weight, if no component of the first half is a copy itself; else of the world that repeats them."""
    own = truth[found.twin[: net.n_atoms]]
    return 2 * (once if (own == truth).all() else log_weight(net, own))


@settings(max_examples=100, deadline=None)
@given(networks(max_atoms=6), st.integers(0, 1000))
def test_a_near_copy_is_not_taken_for_one(net, seed):
    rng = np.random.default_rng(seed)
    doubled = twice(net, rng)
    sizes = [len(c.weight) for c in doubled.clauses]
    if not sum(sizes):
        return
    i = int(rng.choice(np.flatnonzero(sizes)))
    block = doubled.clauses[i]
    row = int(rng.integers(sizes[i] // 2, sizes[i]))
    change = rng.choice(["sign", "count", "weight"])
    literals, count, weight = block.literals.copy(), block.count.copy(), block.weight.copy()
    weights = np.concatenate([doubled.weights, [0.123, np.inf]])
    if change == "sign":
        literals[row, 0] *= -1
    elif change == "count":
        count[row] += 1
    else:
        weight[row] = len(weights) - 1 - (doubled.weights[weight[row]] == np.inf)
    wrong = Clauses(literals, weight, count, block.negated)
    pad = lambda a: np.concatenate([a, [0, 0]])  # noqa: E731
    near = replace(
        doubled,
        clauses=(*doubled.clauses[:i], wrong, *doubled.clauses[i + 1 :]),
        weights=weights,
        decided_true=pad(doubled.decided_true),
        n_groundings=pad(doubled.n_groundings),
    )
    label = components(near)
    found = copies(near, label)
    changed = label[near.variable[abs(literals[row, 0]) - 1]]
    mates = np.flatnonzero((found.original == found.original[changed]) & (np.arange(len(found.original)) != changed))
    for mate in mates:
        assert _signature(near, label, mate) == _signature(near, label, changed)


def _signature(net, label, component):
    """The multiset of weights, counts, lengths and numbers of negations of a component's clauses."""
    found = []
    for c in net.clauses:
        mine = label[net.variable[np.abs(c.literals[:, 0]) - 1]] == component
        negative = (c.literals[mine] < 0).sum(axis=1)
        found += [
            (len(c.literals[0]), c.negated, float(net.weights[w]), int(n), int(k))
            for w, n, k in zip(c.weight[mine], c.count[mine], negative, strict=True)
        ]
    return sorted(found)


def test_friends_who_see_the_same_are_copies():
    model = ml.model_from_text("*F(p, p)\nS(p)\nC(p)\n0.5 S(x) => C(x)\n0.4 F(x, y) ^ S(x) => S(y)\n")
    facts = "F(A, B)\nF(C, D)\nF(E, G)\nF(G, E)\nF(H, H)\nS(I)"
    network = ml.ground(model, ml.evidence_from_text(facts, model=model))
    label = components(network)
    found = copies(network, label)
    names = {network.evidence.atom_text(int(network.atoms[a])): a for a in range(network.n_atoms)}

    def original(name):
        return found.original[label[network.variable[names[name]]]]

    assert original("S(A)") == original("S(C)")
    assert found.twin[names["S(D)"]] == names["S(B)"]
    assert original("S(A)") != original("S(E)")
    assert original("S(H)") != original("C(I)")


def test_cycles_of_equal_length_are_copies_and_others_are_not():
    model = ml.model_from_text("*F(p, p)\nS(p)\n1 F(x, y) ^ S(x) => S(y)\n")
    rings = [["A", "B", "C"], ["D", "E", "G"], ["H", "I", "J", "K"]]
    facts = "\n".join(f"F({a}, {b})" for r in rings for a, b in zip(r, r[1:] + r[:1], strict=True))
    network = ml.ground(model, ml.evidence_from_text(facts, model=model))
    found = copies(network, components(network))
    assert sorted(found.count.tolist()) == [0, 1, 2]
