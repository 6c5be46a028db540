"""Variables with few joint states as one: the same sums, and far smaller tables."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings

import mlnlite as ml
from mlnlite.errors import LimitReached
from mlnlite.infer.exact import marginal
from mlnlite.infer.exact.marginal import marginals_of
from mlnlite.infer.exact.order import TooWide
from mlnlite.infer.reduce import parts
from mlnlite.infer.reduce.jointly import jointly
from tests.networks import networks, world_weight, worlds


@settings(max_examples=150, deadline=None)
@given(net=networks())
def test_sums_stay_the_same(net):
    """Every component counts as too wide as it is; what cannot be merged is left."""
    truth = worlds(net)
    weight = np.array([world_weight(net, t) for t in truth])
    plan, merged = marginal.plan, []

    def only_merged(cardinality, scopes, *limits):
        return plan(cardinality, scopes, *limits) if merged else TooWide(30.0, 30, in_all=False)

    def noted(part):
        found = jointly(part)
        merged.extend([found] * (found is not None))
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(marginal, "divide", lambda p: parts.divide(p, 1))
        patch.setattr(marginal, "plan", only_merged)
        patch.setattr(marginal, "jointly", noted)
        try:
            found = marginals_of(net, too_wide="leave")
        except ml.Contradiction:
            assert np.isneginf(weight).all()
            return
    if np.isneginf(weight).all():
        return
    p = np.exp(weight - weight.max())
    expected, known = (p / p.sum()) @ truth, ~np.isnan(found.probability)
    np.testing.assert_allclose(found.probability[known], expected[known], atol=1e-9)


THINGS, LEVELS = 5, 8


def scales():
    """Each of some things has a level, as thresholds; pairs of things have a weight for each pair of thresholds."""
    text = "Above(thing, level)\nlevel = {" + ", ".join(f"L{i}" for i in range(LEVELS)) + "}\n"
    text += "".join(f"Above(x, L{i + 1}) => Above(x, L{i}).\n" for i in range(LEVELS - 1))
    pairs = [(i, j) for i in range(LEVELS) for j in range(LEVELS)]
    text += "".join(f"{_weight(i, j):.3f} Above(x, L{i}) ^ Above(y, L{j}) ^ x != y\n" for i, j in pairs)
    return text + "-0.4 Above(A0, +l)\nthing = {" + ", ".join(f"A{i}" for i in range(THINGS)) + "}\n"


def _weight(i, j):
    return round(0.05 * np.cos(3.0 * i + 5.0 * j), 3)


def test_levels_of_a_scale_are_one_variable(monkeypatch):
    model = ml.model_from_text(scales())
    found = ml.marginal(model, ml.no_evidence(model), "Above", method="exact")
    above = np.arange(LEVELS + 1)[:, None] > np.arange(LEVELS)
    both = above @ np.array([[_weight(i, j) for j in range(LEVELS)] for i in range(LEVELS)]) @ above.T
    log_weight = np.zeros((LEVELS + 1,) * THINGS)
    for a, b in combinations(range(THINGS), 2):
        log_weight += (both + both.T).reshape([LEVELS + 1 if i in (a, b) else 1 for i in range(THINGS)])
    log_weight += -0.4 * np.arange(LEVELS + 1).reshape(-1, *[1] * (THINGS - 1))
    p = np.exp(log_weight - log_weight.max())
    for thing in range(THINGS):
        at = p.sum(axis=tuple(i for i in range(THINGS) if i != thing)) / p.sum()
        for i in range(LEVELS):
            assert found[f"Above(A{thing}, L{i})"] == pytest.approx(at[i + 1 :].sum(), abs=1e-9)
    assert found.statistics.largest_table == (LEVELS + 1) ** THINGS
    monkeypatch.setattr(marginal, "jointly", lambda part: None)
    with pytest.raises(LimitReached):
        ml.marginal(model, ml.no_evidence(model), "Above", method="exact")
