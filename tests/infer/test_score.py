"""Log-weights and counts against their definition."""

import numpy as np
import pytest
from hypothesis import given, settings

from mlnlite.errors import QueryMistake
from mlnlite.infer.score import counts, log_weight
from tests.networks import network, networks, world_counts, world_weight, worlds


@settings(max_examples=60, deadline=None)
@given(net=networks(7))
def test_every_world_is_worth_what_the_definition_says(net):
    for truth in worlds(net):
        assert log_weight(net, truth) == pytest.approx(world_weight(net, truth), abs=1e-9)
        np.testing.assert_array_equal(counts(net, truth), world_counts(net, truth))


def test_worlds_that_break_a_block_have_no_weight():
    net = network([("!", 2), ("?", 2)], weights=[])
    assert log_weight(net, np.array([True, False, False, False])) == 0
    assert log_weight(net, np.array([False, False, False, False])) == -np.inf
    assert log_weight(net, np.array([True, True, False, False])) == -np.inf
    assert log_weight(net, np.array([True, False, True, True])) == -np.inf


def test_a_missing_weight_is_named():
    net = network([("", 1)], [([([1], 0, 1)], False)], weights=[np.nan])
    with pytest.raises(QueryMistake, match="formula 1"):
        log_weight(net, np.array([True]))
