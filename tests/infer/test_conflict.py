"""Contradictions name formulas that exclude each other, and no others."""

import numpy as np
import pytest

from mlnlite.errors import Contradiction
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.map.ladder import map_of
from tests.networks import network

HARD = np.inf


@pytest.mark.parametrize(
    "ask", [marginals_of, map_of, lambda net: map_of(net, method="wcsp"), lambda net: map_of(net, method="ilp")]
)
def test_only_the_formulas_in_conflict_are_named(ask):
    implications = [([-1, 2], 0, 1), ([-2, 3], 1, 1), ([-4, 5], 2, 1), ([4, 5], 2, 1)]
    net = network([("", 1)] * 5, [(implications, False), ([([1], 3, 1), ([-3], 4, 1)], False)], weights=[HARD] * 5)
    with pytest.raises(Contradiction) as caught:
        ask(net)
    named = [d.message.partition(":")[0] for d in caught.value.diagnostics]
    assert named == ["formula 1", "formula 2", "formula 4", "formula 5"]
    assert "these 4 hard formulas" in str(caught.value)


def test_hard_conjunctions_and_tables_conflict_too():
    net = network(
        [("", 1)] * 3,
        [([([-1, -2], 0, 1)], True)],
        [([[True, False], [False, True]], [([1, 2], 1, 1)]), ([[True, True], [False, True]], [([0, 2], 2, 1)])],
        weights=[HARD, HARD, HARD],
    )
    assert map_of(net).truth.tolist() == [True, True, True]
    more = network(
        [("", 1)] * 3,
        [([([-1, -2], 0, 1)], True), ([([-3], 2, 1)], False)],
        [([[True, False], [False, True]], [([1, 2], 1, 1)])],
        weights=[HARD, HARD, HARD],
    )
    with pytest.raises(Contradiction, match="these 3 hard formulas"):
        map_of(more)


def test_a_block_without_a_possible_value_is_a_conflict():
    net = network([("!", 2)], [([([-1], 0, 1), ([-2], 0, 1)], False)], weights=[HARD])
    with pytest.raises(Contradiction, match="this hard formula"):
        marginals_of(net)


def test_what_evidence_makes_false_is_named():
    net = network([("", 1)], [([([1], 0, 1)], False)], weights=[0.5, HARD], undecided_false=[0, 1])
    for ask in (marginals_of, map_of):
        with pytest.raises(Contradiction, match="formula 2: f2: the evidence makes it false"):
            ask(net)
