"""Legal and rare: predicates without arguments, closed ones, comparisons, hard formulas that no prediction touches."""

from __future__ import annotations

import pytest

import mlnlite as ml
from mlnlite.learn.objectives import exact
from tests.learn.test_exact_likelihood import check


def read(text, *databases):
    model = ml.model_from_text(text)
    return model, ml.evidence_from_text("\n---\n".join(databases), model=model)


@pytest.mark.parametrize("method", ["sandwich", "information", "bootstrap"])
@pytest.mark.parametrize("objective", ["pseudo-likelihood", "likelihood"])
def test_predicates_without_arguments(method, objective):
    model, data = read("R\nS(p)\np = {A, B}\nR => S(x)\nS(x)", "R\nS(A)", "S(B)", "R\nS(A)\nS(B)")
    learned = ml.learn(model, data, objective=objective)
    assert (ml.uncertainty(learned, data, method=method, repetitions=5).sd > 0).all()


def test_a_predicate_without_arguments_can_be_unknown():
    text = "R\nS(p)\np = {A, B}\nR => S(x)\nS(x)"
    learned = ml.learn(*read(text, "?R\nS(A)", "R\nS(B)"))
    opened = ml.learn(*read(text, "S(A)", "R\nS(B)"), open_predicates=["R"])
    assert learned.status == "converged"
    check(text, ["!S(B)\nS(A)", "R\nS(B)\n!S(A)"], ["R", "S"], ["R"])
    assert learned.value == pytest.approx(opened.value, abs=1e-6)


@pytest.mark.parametrize("way", [4096, 0])
def test_a_closed_predicate_that_is_predicted_is_not_false(monkeypatch, way):
    """The star says what is no fact is false, not that nothing is true."""
    monkeypatch.setattr(exact, "MOST_WORLDS", way)
    text = "S(p)\nC(p)\nS(x) => C(x)\nC(x)"
    databases = ["S(A)\nC(A)\nC(D)", "S(B)"]
    starred, plain = (ml.learn(*read(star + text, *databases), objective="likelihood") for star in ("*", ""))
    assert starred.weights == pytest.approx(plain.weights, abs=1e-6)
    with pytest.raises(ml.QueryMistake, match="closed world"):
        ml.learn(*read("*" + text, *databases), open_predicates=["S"])


def test_errors_of_weights_beside_comparisons():
    text = "age(p, int!)\nS(p)\nage(x, a) ^ a > 30 => S(x)\nS(x)"
    people = [f"age(P{i}, {20 + i})" + f"\nS(P{i})" * (i % 3 == 0) for i in range(24)]
    model, data = read(text, "\n".join(people))
    learned = ml.learn(model, data, predict=["S"])
    found = {m: ml.uncertainty(learned, data, method=m, repetitions=20) for m in ("sandwich", "bootstrap")}
    assert found["sandwich"].n_clusters == 24
    every = ml.learn(model, data)
    assert every.how.predict is None
    assert ml.uncertainty(every, data).n_clusters == 24
    assert (found["bootstrap"].sd > 0.1).all()


def test_the_bootstrap_beside_hard_formulas():
    model, data = read("S(p)\nC(p)\nS(x) => C(x).\nS(x)\nC(x)", "S(A)\nC(A)\nC(B)\np = {A, B, D, E}")
    found = ml.uncertainty(ml.learn(model, data), data, method="bootstrap", repetitions=10)
    assert (found.sd[1:] > 0).all()


@pytest.mark.parametrize(
    ("hard", "facts"),
    [
        ("S(x)", "S(A)\nC(B)"),
        ("S(x) ^ C(x)", "C(A)"),
        ("EXIST y (R(x, y) ^ R(y, x))", "R(A, A)\nR(B, E)\nC(A)\np = {A, B, C, D, E, F}"),
        ("FORALL y !R(x, y)", "R(B, E)\nC(A)\np = {A, B, C, D, E, F}"),
    ],
)
@pytest.mark.parametrize("objective", ["pseudo-likelihood", "likelihood"])
def test_data_violate_a_hard_formula_that_no_prediction_touches(hard, facts, objective):
    model, data = read(f"S(p)\nC(p)\nR(p, p)\n{hard}.\nC(x)", facts)
    with pytest.raises(ml.Contradiction, match="formula 1"):
        ml.learn(model, data, predict=["C"], objective=objective)


def test_data_keep_a_hard_formula_over_many_constants():
    model, data = read("C(p)\nR(p, p)\nEXIST y R(x, y).\nC(x)", "R(A, B)\nR(B, A)\nR(D, D)\nR(E, F)\nR(F, A)\nC(A)")
    assert ml.learn(model, data, predict=["C"]).status == "converged"


def test_evidence_that_was_read_for_another_model_is_refused():
    _, data = read("S(p)\nG(p, k)\nS(x)", "S(A)\nG(A, K1)")
    other = ml.model_from_text("S(p)\nG(p, k)\nk = {K9}\nG(x, +v) ^ S(x)")
    with pytest.raises(ml.QueryMistake, match="read for another model"):
        ml.learn(other, data)


def test_a_predicate_without_arguments_is_evaluated():
    model, data = read("R\nS(p)\np = {A, B}\nR => S(x)\nS(x)", "R\nS(A)", "S(B)", "R\nS(A)\nS(B)")
    (score,) = ml.evaluate(ml.learn(model, data).model, data, predicates=["R"]).scores
    assert score.n == 2
    found = ml.crossvalidate(model, data, predict=["R"], split=ml.Split(n_folds=2))
    assert {row.n for row in found.rows} == {2}


def test_the_curvature_needs_no_clusters():
    facts = "\n".join(f"R(P{i}, P{i + 1})" + f"\nR(P{i + 1}, P{i})" * (i % 3 == 0) for i in range(14))
    model, data = read("R(p, p)\nEXIST y (R(x, y) ^ R(y, x))\nR(x, y)", facts)
    assert (ml.uncertainty(ml.learn(model, data), data, method="information").sd > 0).all()
