"""Known optima of real and generated workloads; what a state costs is worked out anew by the reference engine."""

from pathlib import Path

import numpy as np
import pytest

import mlnlite as ml
from benchmarks import generators
from mlnlite.engines.numpy import NumpyEngine
from mlnlite.ground.lazy import world_evidence
from mlnlite.infer.map.cuts.cuttingplanes import map_lazily
from mlnlite.infer.map.cuts.waiting import with_violated, without_lazy, worth_waiting
from mlnlite.infer.map.ladder import map_of
from mlnlite.infer.map.rungs import Options
from mlnlite.infer.score import cost, counts, n_paid

DATA = Path(__file__).parents[3] / "shared" / "data" / "mln"


def read(folder, program="prog.mln"):
    if not DATA.exists():
        pytest.skip("needs ../shared/data")
    model = ml.read_model(DATA / folder / program)
    return model, ml.read_evidence(DATA / folder / "evidence.db", model=model)


def cost_of(network, truth):
    """The cost of a world."""
    return cost(network, counts(network, truth))


def cost_anew(model, network, truth):
    """The cost of a world by grounding the whole model with that world as evidence: nothing is left open."""
    whole = ml.ground(model, world_evidence(network, truth), engine=NumpyEngine())
    assert whole.n_factors == 0
    return cost_of(whole, np.zeros(whole.n_atoms, np.bool_))


@pytest.mark.parametrize(
    ("folder", "program", "total", "open_cost"),
    [("class", "prog.mln", 25935.14, 5141.24), ("cse", "prog.mln", 382411.361542, 17439.863658)],
)
def test_known_optima_of_real_data(folder, program, total, open_cost):
    model, evidence = read(folder, program)
    network = ml.ground(model, evidence)
    best = map_of(network)
    soft = np.isfinite(network.weights)
    paid = n_paid(network, counts(network, best.truth))
    assert best.status == "optimal"
    assert best.gap < 1e-4
    assert cost_of(network, best.truth) == pytest.approx(total, abs=1e-4)
    assert np.abs(network.weights[soft]) @ paid[soft] == pytest.approx(open_cost, abs=1e-4)
    assert cost_anew(model, network, best.truth) == pytest.approx(total, abs=1e-4)


def test_small_real_data_is_proved():
    for folder, program in (("rc1000", "prog-fixed.mln"), ("smoke", "prog.mln")):
        model, evidence = read(folder, program)
        assert ml.map_state(model, evidence).status == "optimal"


def test_a_faulty_model_names_the_formulas_in_conflict():
    model, evidence = read("rc1000")
    with pytest.raises(ml.Contradiction) as caught:
        ml.map_state(model, evidence)
    assert 1 <= len(caught.value.diagnostics) <= 3


def test_attractive_networks_are_cut():
    model, evidence = generators.smokers(2000)
    network = ml.ground(model, evidence)
    by_cut, by_program = map_of(network), map_of(network, method="ilp")
    assert by_cut.methods["mincut"] == 1
    assert by_cut.gap == 0
    assert by_cut.log_weight == pytest.approx(by_program.log_weight, abs=1e-5)
    assert cost_anew(model, network, by_cut.truth) == pytest.approx(cost_of(network, by_cut.truth))


@pytest.mark.parametrize("method", ["auto", "wcsp"])
@pytest.mark.parametrize("hard", [True, False])
def test_cutting_planes_find_what_the_whole_network_has(hard, method):
    model, evidence = generators.entities(12, 0.1, hard=hard)
    lazy, best = map_lazily(without_lazy(model, evidence, [3]), Options(method))
    whole = map_of(ml.ground(model, evidence))
    assert best.log_weight == pytest.approx(whole.log_weight, abs=1e-5)
    assert best.status == whole.status == "optimal"
    assert with_violated(lazy, best.truth).generated == lazy.generated < lazy.total
    assert cost_anew(model, lazy.network, best.truth) == pytest.approx(cost_of(lazy.network, best.truth))


def test_formulas_of_many_groundings_wait():
    model, evidence = generators.entities(40, 0.05)
    assert worth_waiting(model, evidence) == ()
    assert worth_waiting(model, evidence, least=10_000) == (3,)


def test_states_tell_margins():
    model = ml.model_from_text(
        "1.5 Smokes(x) => Cancer(x)\n-0.5 Cancer(x)\n0.4 Smokes(x)\nSmokes(person)\nCancer(person)"
    )
    evidence = ml.evidence_from_text("Smokes(Ann)", model=model)
    state = ml.map_state(model, evidence, ["Smokes(Ann)", "Cancer(Ann)"], margins=True)
    assert state.margins.tolist() == [np.inf, pytest.approx(1.0)]
    assert "1.0000" in str(state)
    assert state.to_dict()["margins"] == {"Smokes(Ann)": None, "Cancer(Ann)": pytest.approx(1.0)}


def test_a_time_limit_leaves_a_state_and_a_gap():
    model, evidence = generators.items(300, 6)
    state = ml.map_state(model, evidence, method="maxwalksat", time_limit=1, seed=1)
    best = ml.map_state(model, evidence)
    assert best.status == "optimal"
    assert state.cost - state.gap <= best.cost + 1e-6 <= state.cost + 2e-6
