"""Priors do what they say, and weights that should not be trusted are named with the cure."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

import mlnlite as ml
from mlnlite.learn.prior import Cauchy, Gaussian, Hierarchical, Laplace
from mlnlite.learn.trust.advice import advice, separable
from mlnlite.learn.trust.effects import effects, held_out

MODEL = "S(p)\nC(p)\nG(p, k!)\nk = {K1, K2, K3}\n"
FACTS = "S(A)\nS(B)\nS(D)\nC(A)\nC(B)\nC(E)\nG(A, K1)\nG(B, K1)\nG(D, K1)\nG(E, K2)\nG(H, K2)\nG(I, K3)\n"


def learnt(formulas, facts=FACTS, **options):
    model = ml.model_from_text(MODEL + formulas)
    return ml.learn(model, ml.evidence_from_text(facts, model=model), **options)


def kinds(learned):
    return [a.kind for a in advice(learned)]


def test_gaussian_with_a_mean():
    tight = learnt("S(x)\nC(x)", prior=Gaussian(1e-4, mean=0.7))
    assert tight.weights == pytest.approx([0.7, 0.7], abs=1e-3)


def test_prior_by_formula():
    learned = learnt("S(x)\nC(x)", prior={"formula 1": Gaussian(1e-4, 2.0), "*": None})
    assert learned.weights == pytest.approx([2.0, 0.0], abs=1e-3)
    with pytest.raises(ml.QueryMistake, match="no formula 'formulla 1'"):
        learnt("S(x)", prior={"formulla 1": Gaussian()})


def test_laplace_gives_exact_zeros_all_along_its_path():
    n_zero = []
    for scale in (0.05, 0.3, 1.0, 100.0):
        learned = learnt("S(x)\nS(x) ^ C(x)\nS(x) => G(x, +k)", prior=Laplace(scale))
        assert learned.status == "converged"
        n_zero.append(int((learned.weights == 0).sum()))
    assert n_zero == sorted(n_zero, reverse=True)
    assert n_zero[0] == 5
    assert n_zero[-1] <= 1


def test_laplace_satisfies_the_conditions_of_the_optimum():
    """At the optimum the slope of the likelihood is 1/scale against each weight, and at most that where it is 0."""
    from mlnlite.learn.optimise.problem import log_likelihood

    learned = learnt("S(x)\nS(x) ^ C(x)\nS(x) => G(x, +k)\nC(x)", prior=Laplace(0.8))
    x = learned.weights[learned.problem.free]
    slope = log_likelihood(learned.problem, x)[1]
    assert slope[x != 0] == pytest.approx(np.sign(x[x != 0]) / 0.8, abs=1e-6)
    assert (np.abs(slope[x == 0]) <= 1 / 0.8 + 1e-9).all()


def test_cauchy_shrinks_less_far_out():
    always = "\n".join(f"S(P{i})" for i in range(40))
    gaussian, cauchy = (learnt("S(x)", always, prior=p).weights[0] for p in (Gaussian(1.0), Cauchy(1.0)))
    assert 0 < gaussian < cauchy < 30


def test_hierarchical_rows_share_what_they_have_in_common():
    """Rows seen often keep their weight, rare ones are drawn to the mean, unseen ones get it."""
    lines = []
    for k, (n_true, n) in {"K1": (90, 100), "K2": (60, 100), "K3": (1, 1)}.items():
        lines += [f"G({k}_{i}, {k})" for i in range(n)] + [f"S({k}_{i})" for i in range(n_true)]
    model = ml.model_from_text(MODEL.replace("K3}", "K3, K4}") + "G(x, +k) ^ S(x)")
    data = ml.evidence_from_text("\n".join(lines), model=model)
    free = ml.learn(model, data, predict=["S"], prior=5.0).weights
    shared = ml.learn(model, data, predict=["S"], prior=Hierarchical()).weights
    assert shared[:2] == pytest.approx(free[:2], abs=0.25)
    assert free[2] > 2.2
    assert 0.8 < shared[2] < 2
    assert 0.8 < shared[3] < 2
    assert free[3] == 0


def test_separable():
    assert kinds(learnt("S(x) => C(y)", "S(A)\nC(A)", prior=None)) == ["separable"]
    rows = sparse.csr_array(np.array([[1.0, -1.0], [-1.0, 2.0], [1.0, 0.0]]))
    assert (rows @ separable(rows) >= -1e-9).all()
    assert separable(rows).any()
    assert not separable(sparse.csr_array(np.array([[1.0, 0.0], [-1.0, 0.0]]))).any()


def test_redundant_and_unidentified():
    assert "redundant" in kinds(learnt("S(x)\n!S(x)"))
    (warning,) = [a for a in advice(learnt("S(x)\n!S(x)")) if a.kind == "redundant"]
    assert "S(x)" in warning.text
    assert "!S(x)" in warning.text
    assert "unidentified" in kinds(learnt("G(x, K1)\nG(x, K2)\nG(x, K3)\nS(x)"))
    assert kinds(learnt("S(x)\nC(x)\nS(x) ^ C(x)")) == []


def test_unsupported():
    learned = learnt("S(x) ^ G(x, K3)\nC(x) ^ G(x, +k)", "C(A)\nG(A, K1)\nG(B, K1)", predict=["C"])
    assert "unsupported" in kinds(learned)


def test_effects():
    """The score and ratio statistics of an unneeded formula are small, of a needed one large and alike."""
    facts = "\n".join(
        [*(f"S(P{i})" for i in range(60)), *(f"C(P{i})" for i in range(45)), *(f"C(Q{i})" for i in range(9))]
    )
    facts += "\n" + "\n".join(f"G({p}{i}, K{1 + i % 3})" for p, n in (("P", 60), ("Q", 60)) for i in range(n))
    needed, unneeded = effects(learnt("S(x) ^ C(x)\nC(x) ^ G(x, K1)", facts, predict=["C"], prior=None))
    assert needed.score > 20
    assert needed.p_value < 1e-4
    assert needed.ratio == pytest.approx(needed.score, rel=0.3)
    assert needed.probability == pytest.approx(1 / (1 + np.exp(-needed.weight)))
    assert unneeded.formula == "C(x) ^ G(x, K1)"


def test_held_out():
    model = ml.model_from_text("S(p)\nS(x)")
    learned = ml.learn(model, ml.evidence_from_text("S(A)\np = {A, B, C, D}", model=model), prior=None)
    value = held_out(learned, ml.evidence_from_text("S(E)\np = {E, F}", model=model))
    assert value == pytest.approx((np.log(0.25) + np.log(0.75)) / 2, abs=1e-6)
