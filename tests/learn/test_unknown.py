"""Atoms marked `?` are unknown: neither false nor ignored. All against listing every world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mlnlite as ml
from mlnlite.learn.objectives import exact
from mlnlite.learn.optimise.problem import log_likelihood
from mlnlite.model.evidence import Facts
from tests import brute
from tests.learn.test_exact_likelihood import log_sum, problem_of, with_weights

TEXT = "P(a)\nQ(a)\nG(a, c!)\nO(a, c?)\nP(x) => Q(x)\nQ(x) ^ Q(y)\nP(x) ^ G(x, +k)\nO(x, +k) ^ G(x, +k)\n"
EVERY = "a = {A, B}\nc = {C1, C2, C3}\n"
CASES = [
    ("P(A)\nQ(A)\n?Q(B)\nG(A, C1)\nG(B, C2)", ["P", "Q"], {"Q": ["B"]}),
    ("P(A)\nQ(A)\n?P(B)\nG(A, C1)\nG(B, C2)", ["Q"], {"P": ["B"]}),
    ("P(A)\nQ(B)\n?G(A, C1)\n?G(A, C3)\nG(B, C2)", ["Q", "G"], {"G": ["A, C1", "A, C3"]}),
    ("P(A)\nQ(B)\n?G(A, C1)\n?G(A, C2)\nG(B, C2)", ["Q"], {"G": ["A, C1", "A, C2"]}),
    ("P(A)\nQ(B)\nG(A, C1)\nG(B, C2)\nO(A, C1)\n?O(B, C3)", ["O"], {"O": ["B, C3"]}),
    ("P(A)\nQ(B)\nG(A, C1)\nG(B, C2)\n?O(B, C3)\n?Q(A)", ["P", "O"], {"O": ["B, C3"], "Q": ["A"]}),
]


def observed(model, facts, targets, marked):
    """log P(what is known of the targets | what is known of the rest), by listing worlds."""
    lines = [line for line in facts.split("\n") if not line.startswith("?")]
    data = ml.evidence_from_text(EVERY + "\n".join(lines), model=model)
    allowed = {
        (name, tuple(data.types[t].index[c] for t, c in zip(data.predicates[name].types, a.split(", "), strict=True)))
        for name, atoms in marked.items()
        for a in atoms
    }
    known = {k for k, truth in brute.facts(data).items() if truth}

    def weights(open_targets):
        none = {n: Facts(f.database[:0], f.arguments[:0], f.truth[:0]) for n, f in data.facts.items()}
        empty = replace(data, facts=none)
        for world in brute.worlds(model, empty):
            free = allowed | {a for a in world if open_targets and a[0] in targets}
            if all(a in free or truth == (a in known) for a, truth in world.items()):
                yield brute.log_weight(model, data, world)

    return log_sum(weights(open_targets=False)) - log_sum(weights(open_targets=True))


@pytest.mark.parametrize("way", ["list", "eliminate"])
@pytest.mark.parametrize(("facts", "targets", "marked"), CASES)
def test_marked_atoms_are_summed_over(facts, targets, marked, way, monkeypatch):
    if way == "eliminate":
        monkeypatch.setattr(exact, "MOST_WORLDS", 0)
    model, _, problem = problem_of(TEXT, [EVERY + facts], targets)
    x = np.random.default_rng(0).normal(size=len(problem.free))
    value, gradient = log_likelihood(problem, x)
    assert value == pytest.approx(observed(with_weights(model, problem, x), facts, targets, marked), abs=1e-8)
    for i in range(len(x)):
        step = 1e-5 * np.eye(len(x))[i]
        slope = (log_likelihood(problem, x + step)[0] - log_likelihood(problem, x - step)[0]) / 2e-5
        assert gradient[i] == pytest.approx(slope, abs=1e-5)


def test_the_objective_follows_the_data():
    model = ml.model_from_text("P(a)\nG(a, c!)\nP(x) ^ G(x, +k)\nP(x)")
    complete = ml.evidence_from_text("P(A)\nG(A, C1)\nG(B, C2)", model=model)
    assert ml.learn(model, complete).how.objective == "pseudo-likelihood"
    for facts in ("?P(A)\nP(B)\nG(A, C1)\nG(B, C2)", "P(A)\nP(B)\nG(A, C1)"):
        data = ml.evidence_from_text(facts, model=model)
        learned = ml.learn(model, data, predict=["P"])
        assert learned.how.objective == "likelihood"
        assert learned.status == "converged"
        with pytest.raises(ml.QueryMistake, match="need the likelihood"):
            ml.learn(model, data, predict=["P"], objective="pseudo-likelihood")


def test_a_missing_atom_is_not_a_false_one():
    """Three of four known people smoke; of the fifth nothing is known."""
    model = ml.model_from_text("S(p)\nS(x)\np = {A, B, C, D, E}")
    unknown = ml.evidence_from_text("S(A)\nS(B)\nS(C)\n?S(E)", model=model)
    assert ml.learn(model, unknown, prior=None).weights == pytest.approx([np.log(3)], abs=1e-5)
    false = ml.evidence_from_text("S(A)\nS(B)\nS(C)", model=model)
    assert ml.learn(model, false, prior=None).weights == pytest.approx([np.log(1.5)], abs=1e-6)


def test_probabilities_are_refused():
    model = ml.model_from_text("S(p)\nS(x)\n")
    data = ml.evidence_from_text("0.7 S(A)\nS(B)", model=model)
    with pytest.raises(ml.EvidenceMistake, match="has a probability"):
        ml.learn(model, data)


def test_held_out_sums_over_what_is_unknown():
    facts, targets, marked = CASES[5]
    model = ml.model_from_text(TEXT)
    complete = ml.evidence_from_text(EVERY + "P(A)\nQ(B)\nG(A, C1)\nG(B, C2)\nO(A, C1)", model=model)
    learned = ml.learn(model, complete, predict=targets, prior=1.0)
    value = ml.held_out(learned, ml.evidence_from_text(EVERY + facts, model=learned.model))
    assert value * 3 == pytest.approx(observed(learned.model, facts, targets, marked), abs=1e-8)  # P(A), P(B), O(A)


def some_unknown():
    """People, of whom some do not say whether they smoke."""
    model = ml.model_from_text("S(p)\nC(p)\nS(x)\nC(x)\nS(x) ^ C(x)")
    lines = [("S" * (i % 2) + "C" * (i % 5 > 1 + 2 * (i % 2)), i) for i in range(60)]
    facts = [f"{'?' if n == 'S' and i % 7 == 0 else ''}{n}(P{i})" for names, i in lines for n in names]
    facts += [f"?S(P{i})" for i in range(0, 60, 14)]
    people = ", ".join(f"P{i}" for i in range(60))
    return model, ml.evidence_from_text(f"p = {{{people}}}\n" + "\n".join(facts), model=model)


def test_effects_where_atoms_are_unknown():
    """The ratio is that of two models learnt apart; the score has the slope and curvature of the likelihood."""
    model, data = some_unknown()
    learned = ml.learn(model, data, prior=None)
    assert learned.how.objective == "likelihood"
    *_, effect = ml.effects(learned)
    simple = replace(model, templates=model.templates[:2])
    assert effect.ratio == pytest.approx(2 * (learned.value - ml.learn(simple, data, prior=None).value), abs=1e-6)
    at = np.append(ml.learn(simple, data, prior=None).weights, 0.0)

    def slope(x):
        return log_likelihood(learned.problem, x)[1]

    bend = -np.array([(slope(at + 1e-5 * e) - slope(at - 1e-5 * e)) / 2e-5 for e in np.eye(3)])
    left = bend[2, 2] - bend[2, :2] @ np.linalg.solve(bend[:2, :2], bend[:2, 2])
    assert effect.score == pytest.approx(slope(at)[2] ** 2 / left, rel=1e-4)
    assert effect.p_value < 0.05


def test_effects_refuse_what_has_no_likelihood():
    model, _ = some_unknown()
    complete = ml.evidence_from_text("S(A)\nC(A)\nS(B)\np = {A, B, C}", model=model)
    with pytest.raises(ml.QueryMistake, match="max-margin"):
        ml.effects(ml.learn(model, complete, predict=["C"], objective="max-margin"))


def test_databases_that_leave_all_open_are_not_those_that_close_it():
    """Of one it is unknown who smokes, in the other nobody does: the order does not matter."""
    model = ml.model_from_text("S(p)\nC(p)\np = {A}\nS(x) => C(x)\nC(x)\nS(x)")
    learned = [
        ml.learn(model, ml.evidence_from_text("\n---\n".join(worlds), model=model), predict=["C"], prior=1.0)
        for worlds in (["?S(A)\nC(A)", "C(A)"], ["C(A)", "?S(A)\nC(A)"])
    ]
    assert learned[0].weights == pytest.approx(learned[1].weights, abs=1e-9)
