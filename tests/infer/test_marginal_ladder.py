"""What is too wide is sampled, and the result says so."""

import sys
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest

import mlnlite as ml
from mlnlite.infer.exact import marginal
from mlnlite.infer.reduce.parts import divide

TEXT = """Smokes(p)
Friends(p, p)
Cancer(p)
1.5 Smokes(x) => Cancer(x)
1.1 Friends(x, y) => (Smokes(x) <=> Smokes(y))
-0.5 Smokes(x)
-2 Friends(x, y)
"""
QUERY = ["Smokes", "Cancer(P0)", "Smokes(P0) ^ Smokes(P1)"]


@pytest.fixture(scope="module")
def asked():
    model = ml.model_from_text(TEXT)
    facts = "\n".join(f"Cancer(P{i})" for i in range(5))
    return model, ml.evidence_from_text(facts, model=model)


@pytest.fixture(scope="module")
def sampled(asked):
    return ml.marginal(*asked, QUERY, width_limit=8, precision=0.01, seed=3)


def test_wide_components_are_sampled(asked, sampled):
    exact = ml.marginal(*asked, QUERY)
    assert exact.status == "exact"
    assert sampled.status.startswith("sampled, standard errors up to 0.0")
    assert sampled.methods[QUERY.index("Cancer(P0)") + 4] == "evidence"
    off = np.abs(sampled.probabilities - exact.probabilities)
    assert (off <= 5 * sampled.error).all()
    assert (sampled.low <= sampled.probabilities).all()
    assert (sampled.probabilities <= sampled.high).all()
    assert "R-hat" in str(sampled)
    assert {"r_hat", "effective_size", "low", "high"} <= set(sampled.to_dict()["marginals"][0])


def test_exact_refuses(asked):
    with pytest.raises(ml.LimitReached, match="hang together"):
        ml.marginal(*asked, QUERY, width_limit=8, method="exact")


def test_time_limit_is_named(asked):
    result = ml.marginal(*asked, QUERY, width_limit=8, precision=1e-6, time_limit=0.5)
    assert "time limit reached" in result.status
    assert np.isfinite(result.probabilities).all()


def test_no_time_is_left_for_the_second_component():
    others = TEXT.replace("Smokes", "Sings").replace("Friends", "Likes").replace("Cancer", "Fame").replace("1.1", "0.9")
    model = ml.model_from_text(TEXT + others)
    evidence = ml.evidence_from_text("\n".join(f"Cancer(P{i})" for i in range(5)) + "\nFame(P2)\n", model=model)
    result = ml.marginal(model, evidence, ["Smokes", "Sings"], width_limit=8, precision=1e-6, time_limit=1e-6)
    assert "time limit reached" in result.status


def test_traces_name_formulas(sampled):
    assert any(name.startswith("log-weight") for name in sampled.traces)
    assert all(trace.shape[0] == 4 for trace in sampled.traces.values())


@pytest.mark.parametrize("version", ["0.22.0", "1.0.0"])
def test_arviz_of_both_generations(monkeypatch, sampled, version):
    def from_dict(*groups, **more):
        assert bool(groups) == version.startswith("1")
        return {**(groups[0] if groups else more), "coords": more["coords"], "dims": more["dims"]}

    monkeypatch.setitem(sys.modules, "arviz", SimpleNamespace(__version__=version, from_dict=from_dict))
    data = sampled.to_inference_data()
    n_atoms = len(data["coords"]["atom"])
    assert data["posterior"]["probability"].shape[::2] == (4, n_atoms)
    assert data["coords"]["atom"][0] == "Smokes(P0)"


@pytest.mark.skipif(not find_spec("arviz"), reason="the extra arviz is not installed")
@pytest.mark.filterwarnings("ignore")
def test_arviz_itself_reads_the_samples(sampled):
    """Whichever generation is installed: `InferenceData` or `DataTree`."""
    import arviz

    data = sampled.to_inference_data()
    probability = data["posterior"]["probability"]
    assert probability.dims == ("chain", "draw", "atom")
    rows = np.flatnonzero(~sampled.exact)
    assert probability["atom"].values.tolist() == [sampled.names[i] for i in rows]
    np.testing.assert_allclose(probability.mean(("chain", "draw")).values, sampled.probabilities[rows], atol=1e-5)
    assert arviz.summary(data, var_names=["probability"])["r_hat"].astype(float).max() < 1.1


def test_nothing_sampled_nothing_exported(asked):
    with pytest.raises(ml.QueryMistake, match="nothing was sampled"):
        ml.marginal(*asked, "Smokes").to_inference_data()


def test_of_isomorphic_components_one_is_sampled(monkeypatch):
    """Three circles of friends, two of them the same but for their names and the order of these."""
    model = ml.model_from_text("S(p)\nF(p, p)\n1.1 F(x, y) => (S(x) <=> S(y))\n0.5 S(x)\n")
    ring = "F({0}, {1})\nF({1}, {2})\nF({2}, {3})\nF({3}, {0})\nF({0}, {2})\n"
    facts = (
        ring.format("A", "B", "C", "D") + ring.format("Z", "X", "Y", "W") + ring.format("E", "G", "H", "I") + "S(E)\n"
    )
    evidence = ml.evidence_from_text(facts, model=model)
    exact = ml.marginal(model, evidence, "S", closed_world="F")
    monkeypatch.setattr(marginal, "divide", lambda p: divide(p, 1))
    result = ml.marginal(model, evidence, "S", closed_world="F", width_limit=4, precision=0.01)
    assert result.methods.count("Gibbs sampling") == 8
    twins = [(result["S(A)"], result["S(Z)"]), (result["S(B)"], result["S(X)"]), (result["S(C)"], result["S(Y)"])]
    assert all(a == b or {a, b} == {result["S(A)"], result["S(C)"]} for a, b in twins)
    assert (np.abs(result.probabilities - exact.probabilities) < 5 * result.error + 1e-9).all()
