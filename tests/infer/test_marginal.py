"""Exact marginals against listing all worlds."""

import numpy as np
import pytest
from hypothesis import given, settings

from mlnlite.errors import Contradiction
from mlnlite.infer.exact import marginal
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.reduce import conjunctions, parts, peel
from tests.networks import networks, world_weight, worlds


def enumerate_worlds(net):
    truth = worlds(net)
    weight = np.array([world_weight(net, t) for t in truth])
    if np.all(np.isneginf(weight)):
        return -np.inf, None
    peak = weight.max()
    p = np.exp(weight - peak)
    return peak + np.log(p.sum()), (p / p.sum()) @ truth


@pytest.mark.parametrize(("small", "fewest"), [(1, 1), (1, 64), (1024, 1), (1024, 64)])
@settings(max_examples=150, deadline=None)
@given(net=networks())
def test_marginals_equal_enumeration(net, small, fewest):
    log_z, expected = enumerate_worlds(net)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(marginal, "divide", lambda p: parts.divide(p, small))
        patch.setattr(marginal, "peel", lambda p, maximise: peel.peel(p, maximise=maximise, fewest=fewest))
        if expected is None:
            with pytest.raises(Contradiction):
                marginals_of(net)
            return
        answer = marginals_of(net)
    assert answer.log_z == pytest.approx(log_z, abs=1e-9)
    np.testing.assert_allclose(answer.probability, expected, atol=1e-9)
    assert answer.exact.all()


@settings(max_examples=100, deadline=None)
@given(net=networks(8))
def test_chains_of_auxiliary_variables_change_nothing(net):
    log_z, expected = enumerate_worlds(net)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(conjunctions, "MAX_ARITY", 2)
        if expected is None:
            with pytest.raises(Contradiction):
                marginals_of(net)
            return
        answer, best = marginals_of(net), map_of(net)
    assert answer.log_z == pytest.approx(log_z, abs=1e-9)
    np.testing.assert_allclose(answer.probability, expected, atol=1e-9)
    assert best.log_weight == pytest.approx(max(world_weight(net, t) for t in worlds(net)), abs=1e-9)
