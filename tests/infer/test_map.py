"""Best worlds against listing all worlds, and one method against another."""

import numpy as np
import pytest
from hypothesis import given, settings

from mlnlite.errors import Contradiction
from mlnlite.infer.map import ladder as map_module
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.reduce import parts, peel
from tests.networks import networks, world_weight, worlds


def best_weight(net):
    return max(world_weight(net, t) for t in worlds(net))


@pytest.mark.parametrize(("small", "fewest"), [(1, 1), (1, 64), (1024, 1), (1024, 64)])
@settings(max_examples=150, deadline=None)
@given(net=networks())
def test_best_world_equals_enumeration(net, small, fewest):
    expected = best_weight(net)
    divide = parts.divide
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(map_module, "divide", lambda p, small_=0, **_: divide(p, small))
        patch.setattr(map_module, "peel", lambda p, maximise: peel.peel(p, maximise=maximise, fewest=fewest))
        if np.isneginf(expected):
            with pytest.raises(Contradiction):
                map_of(net)
            return
        answer = map_of(net)
    assert answer.log_weight == pytest.approx(expected, abs=1e-9)
    assert answer.log_weight == pytest.approx(world_weight(net, answer.truth), abs=1e-9)
    assert answer.bound == pytest.approx(answer.log_weight, abs=1e-6)
    assert answer.status == "optimal"


@pytest.mark.parametrize("method", ["wcsp", "ilp"])
@settings(max_examples=25, deadline=None)
@given(net=networks())
def test_solvers_equal_enumeration(net, method):
    expected = best_weight(net)
    if np.isneginf(expected):
        with pytest.raises(Contradiction):
            map_of(net, method=method)
        return
    answer = map_of(net, method=method)
    assert answer.log_weight == pytest.approx(expected, abs=1e-9)
    assert answer.status == "optimal"
    assert 0 <= answer.gap < 1e-5
