"""k best worlds, different ones, and margins, against listing all worlds."""

import numpy as np
import pytest
from hypothesis import given, settings

from mlnlite.errors import Contradiction
from mlnlite.infer.map import kbest, maxmarginals
from mlnlite.infer.map.kbest import best_worlds, diverse_worlds
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.map.maxmarginals import margins_of
from mlnlite.infer.reduce.parts import divide
from tests.networks import network, networks, world_weight, worlds


@pytest.mark.parametrize("small", [1, 1024])
@settings(max_examples=25, deadline=None)
@given(net=networks(max_atoms=9))
def test_the_best_worlds_in_order(small, net):
    weights = sorted((world_weight(net, t) for t in worlds(net)), reverse=True)
    weights = [w for w in weights if np.isfinite(w)][:6]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kbest, "divide", lambda p: divide(p, small))
        if not weights:
            with pytest.raises(Contradiction):
                best_worlds(net, 6)
            return
        found = best_worlds(net, 6)
    np.testing.assert_allclose([w.log_weight for w in found], weights, atol=1e-6)
    assert len({w.truth.tobytes() for w in found}) == len(found)
    assert all(w.proved for w in found)


@pytest.mark.parametrize(("small", "cheap"), [(1024, 1 << 18), (1, 1 << 18), (1, 1)])
@settings(max_examples=25, deadline=None)
@given(net=networks(max_atoms=8))
def test_margins_equal_enumeration(small, cheap, net):
    all_worlds = worlds(net)
    weights = np.array([world_weight(net, t) for t in all_worlds])
    if np.isneginf(weights.max()):
        return
    truth = map_of(net).truth
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(maxmarginals, "divide", lambda p: divide(p, small))
        patch.setattr(maxmarginals, "_CHEAP", cheap)
        margins = margins_of(net, truth)
    for a in range(net.n_atoms):
        other = weights[all_worlds[:, a] != truth[a]].max(initial=-np.inf)
        assert margins[a] == pytest.approx(weights.max() - other, abs=1e-6)


def test_different_worlds_differ():
    pairs = [([-a, a + 1], 0, 1) for a in range(1, 10)] + [([a, -a - 1], 0, 1) for a in range(1, 10)]
    net = network([("", 1)] * 10, [(pairs, False), ([([1], 1, 1)], False)], weights=[1.0, 0.1])
    near, far = best_worlds(net, 2), diverse_worlds(net, 2, 0.5)
    assert near[0].log_weight == far[0].log_weight
    assert (far[0].truth != far[1].truth).sum() == 10
    assert (near[0].truth != near[1].truth).sum() <= (far[0].truth != far[1].truth).sum()
