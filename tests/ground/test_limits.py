"""What would take too much is refused before it starts, and the culprit is named."""

from __future__ import annotations

import pytest

import mlnlite as ml
from mlnlite.ground.forecast import Limits, machine_limits

TEXT = "S(p, p)\nT(p)\np = {%s}\n0.5 T(x)\n1 S(x, y) ^ S(y, z) => S(x, z)\n"


def model_of(n):
    return ml.model_from_text(TEXT % ", ".join(f"P{i}" for i in range(n)))


@pytest.mark.parametrize("limits", [Limits(groundings=10_000), Limits(memory=1_000_000)])
def test_limits_name_the_formula_and_what_helps(limits):
    model = model_of(40)
    with pytest.raises(ml.LimitReached, match=r"(?s)formula 2 needs .*x, y, z range over 40 constants of p") as error:
        ml.ground(model, ml.no_evidence(model), limits=limits)
    assert error.value.diagnostics[0].code == "E410"
    assert error.value.diagnostics[0].span.place.endswith(":5:1")


def test_what_fits_is_ground():
    model = model_of(10)
    network = ml.ground(model, ml.no_evidence(model), limits=Limits(groundings=10_000, memory=500 * 10**6))
    assert network.n_open.sum() == 820


def test_what_no_machine_holds_is_refused_without_being_asked():
    model = model_of(3000)
    assert machine_limits().memory is None or machine_limits().memory > 0
    with pytest.raises(ml.LimitReached, match="formula 2 needs"):
        ml.ground(model, ml.no_evidence(model))
