"""Probabilities of formulas against listing all worlds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.errors import Contradiction, LimitReached
from mlnlite.infer.exact.formula import formula_probabilities, formula_probability
from mlnlite.model.formulas import All, Any, AtomRef, Iff, Not
from tests.networks import network, networks, world_weight, worlds


def expressions(n_atoms):
    def deeper(part):
        some = st.lists(part, max_size=4).map(tuple)
        return st.one_of(part.map(Not), some.map(All), some.map(Any), st.builds(Iff, part, part))

    return st.recursive(st.integers(0, n_atoms - 1).map(AtomRef), deeper, max_leaves=8)


def holds(formula, truth):
    match formula:
        case AtomRef(a):
            return bool(truth[a])
        case Not(part):
            return not holds(part, truth)
        case All(parts):
            return all(holds(p, truth) for p in parts)
        case Any(parts):
            return any(holds(p, truth) for p in parts)
        case Iff(left, right):
            return holds(left, truth) == holds(right, truth)


@settings(max_examples=200, deadline=None)
@given(data=st.data(), net=networks(8))
def test_formulas_equal_enumeration(data, net):
    formulas = data.draw(st.lists(expressions(net.n_atoms), min_size=1, max_size=3))
    truth = worlds(net)
    weight = np.exp([world_weight(net, t) for t in truth])
    if weight.sum() == 0:
        return
    expected = [weight @ [holds(f, t) for t in truth] / weight.sum() for f in formulas]
    try:
        np.testing.assert_allclose(formula_probabilities(net, formulas), expected, atol=1e-9)
    except Contradiction:
        pytest.fail("there is a world")


def test_a_wide_formula_over_independent_atoms():
    net = network([("", 1)] * 200, [([([a + 1], 0, 1) for a in range(200)], False)], weights=[2.0])
    p = 1 / (1 + np.exp(-2.0))
    atoms = tuple(AtomRef(a) for a in range(200))
    assert formula_probability(net, All(atoms)) == pytest.approx(p**200, rel=1e-9)
    assert formula_probability(net, Any(tuple(map(Not, atoms)))) == pytest.approx(1 - p**200, rel=1e-9)


def test_formulas_that_are_only_wide_together_are_answered_in_groups():
    n = 12
    net = network([("", 1)] * n, [([([a + 1], 0, 1) for a in range(n)], False)], weights=[0.5])
    pairs = [Iff(AtomRef(a), AtomRef(b)) for a in range(n) for b in range(a)]
    p = 1 / (1 + np.exp(-0.5))
    answer = formula_probabilities(net, pairs, width_limit=32)
    np.testing.assert_allclose(answer, p * p + (1 - p) * (1 - p), atol=1e-12)
    with pytest.raises(LimitReached, match="atoms"):
        formula_probability(net, All(tuple(pairs)), width_limit=4)


def test_facts_are_put_into_quantifiers_first():
    n = 25_000
    model = ml.model_from_text("*Friends(p, p)\nSmokes(p)\n0.5 Smokes(x)\n")
    facts = "".join(f"Friends(P{i}, P{i + 1})\nFriends(P{i}, P{(i + 7) % n})\n" for i in range(n)) + "!Smokes(P8)\n"
    evidence = ml.evidence_from_text(facts, model=model)
    some, every, sure = (
        "EXIST x (Smokes(x) ^ Friends(P1, x))",
        "FORALL x (Friends(P3, x) => Smokes(x))",
        "EXIST x Friends(P1, x)",
    )
    answer = ml.marginal(model, evidence, [some, every, sure])
    one = 1 / (1 + np.exp(-0.5))
    assert answer.probabilities == pytest.approx([one, one**2, 1.0])


def test_a_session_keeps_quantifiers_open_for_facts_to_come():
    model = ml.model_from_text("*Friends(p, p)\nSmokes(p)\np = {Ann, Bob, Cid}\n0.5 Smokes(x)\n")
    session = ml.compile(model, query="EXIST x (Smokes(x) ^ Friends(Ann, x))")
    assert session.query().probabilities == pytest.approx([0.0])
    assert session.updated(add="Friends(Ann, Bob)").query().probabilities == pytest.approx([1 / (1 + np.exp(-0.5))])
