"""Planted rules are found again, and nothing is found where there is nothing."""

from __future__ import annotations

import numpy as np
import pytest

import mlnlite as ml
from mlnlite.learn.structure.candidates import Language, candidates, rule_text
from mlnlite.learn.structure.find import find_rules
from mlnlite.learn.structure.modes import modes_of

VOCABULARY = "Ill(p)\nSmokes(p)\nSporty(p)\nCoffee(p)\nRich(p)\nFriends(p, p)\n"
PLANTED = {"Smokes(x) => Ill(x)", "Sporty(x) => Ill(x)", "Friends(x, y) ^ Rich(y) => Ill(x)"}


GIVEN = ["Smokes", "Sporty", "Coffee", "Rich", "Friends"]


def planted_lines(n, seed, strength=1.0):
    """People whose illness depends on smoking, sport, and how many of their friends are rich."""
    random = np.random.default_rng(seed)
    smokes, sporty, coffee, rich = (random.random(n) < p for p in (0.3, 0.4, 0.5, 0.3))
    friends = np.unique(np.column_stack([np.repeat(np.arange(n), 2), random.integers(0, n, 2 * n)]), axis=0)
    n_rich = np.bincount(friends[:, 0], rich[friends[:, 1]], n)
    odds = -1.0 + strength * (1.5 * smokes - 1.2 * sporty + 0.8 * n_rich)
    ill = random.random(n) < 1 / (1 + np.exp(-odds))
    lines = [f"Friends(P{a}, P{b})" for a, b in friends.tolist()]
    for name, truth in {"Smokes": smokes, "Sporty": sporty, "Coffee": coffee, "Rich": rich, "Ill": ill}.items():
        lines += [f"{name}(P{i})" for i in np.flatnonzero(truth).tolist()]
    return ml.model_from_text(VOCABULARY), lines


def planted(n, seed, strength=1.0):
    model, lines = planted_lines(n, seed, strength)
    return model, ml.evidence_from_text("\n".join(lines), model=model)


def without(lines, unknown, n):
    """The facts with a share of the atoms of some predicates marked."""
    random = np.random.default_rng(1)
    for name, share in unknown.items():
        who = random.choice(n, int(share * n), replace=False).tolist()
        hidden = {f"{name}(P{i})" for i in who}
        lines = [line for line in lines if line not in hidden] + [f"?{atom}" for atom in sorted(hidden)]
    return lines


def f1(found, wanted):
    hit = len(found & wanted)
    return 2 * hit / max(1, len(found) + len(wanted))


def test_planted_rules_are_found():
    model, data = planted(1500, 0)
    given = ["Smokes", "Sporty", "Coffee", "Rich", "Friends"]
    found = find_rules(model, data, predict=["Ill"], given=given, resamples=5)
    assert f1({r.text for r in found.rules}, PLANTED) == 1.0
    assert all(r.stability >= 0.6 for r in found.rules)
    assert "Smokes(x) => Ill(x)" in str(found)
    assert len(found.model.templates) == 4


def test_nothing_is_found_in_noise():
    model, data = planted(800, 1, strength=0.0)
    found = find_rules(model, data, predict=["Ill"], given=["Smokes", "Sporty", "Coffee"], resamples=2)
    assert found.rules == ()


def texts_of(text, heads, bodies, most_literals=2, constants=""):
    """The candidates that modes allow, as texts."""
    model = ml.model_from_text(text)
    types = ml.evidence_from_text(constants or "\n", model=model).types
    language = Language(model.predicates, types, *(modes_of(m, model.predicates) for m in (heads, bodies)))
    return [rule_text(rule, model.dialect) for rule in candidates(language, most_literals)]


def test_candidates_are_connected_and_each_once():
    texts = texts_of("S(p)\nF(p, p)\nH(q)\n", ["S"], ["S", "F", "H"])
    assert len(texts) == len(set(texts))
    assert "F(x, y) ^ S(y) => S(x)" in texts or "S(y) ^ F(x, y) => S(x)" in texts
    assert not any("H" in t for t in texts)


def test_modes_say_where_arguments_come_from():
    assert texts_of("S(p)\nF(p, p)\n", ["S"], ["F(+, -)", "S(+)"]) == [
        "F(x, x) => S(x)",
        "F(x, y) => S(x)",
        "F(x, x) ^ F(x, y) => S(x)",
        "F(x, y) ^ F(x, z) => S(x)",
        "F(x, y) ^ F(y, x) => S(x)",
        "F(x, y) ^ F(y, y) => S(x)",
        "F(x, y) ^ F(y, z) => S(x)",
        "F(x, y) ^ S(y) => S(x)",
    ]
    assert texts_of("S(p)\nF(p, p)\n", ["S"], ["F(+, +)", "S(+)"]) == ["F(x, x) => S(x)"]


def test_modes_bring_in_several_variables_and_constants():
    assert texts_of("S(p)\nR(p, q, r)\n", ["S(+)"], ["R(+, -, -)"], 1) == ["R(x, y, z) => S(x)"]
    assert texts_of("S(p)\nR(p, q, r)\n", ["S(+)"], ["R"], 1) == []
    constants = 'l = {Low, High}\nm = {near, "far off"}'
    found = texts_of("level(p, l!)\nway(p, m!)", ["way(+, #)"], ["level(+, #)"], 1, constants)
    assert found == [f'level(x, {a}) => way(x, "{b}")' for b in ("near", "far off") for a in ("Low", "High")]


@pytest.mark.parametrize(
    ("mode", "message"),
    [
        ("F(+)", "has 1 arguments"),
        ("F(+, x)", "the argument `x`"),
        ("G(+, -)", "there is no predicate G"),
        ("F(+, -", "is no mode"),
        ("F()", "the argument ``"),
    ],
)
def test_wrong_modes_are_refused(mode, message):
    model = ml.model_from_text("S(p)\nF(p, p)\n")
    with pytest.raises(ml.QueryMistake, match=message):
        modes_of([mode], model.predicates)


@pytest.mark.parametrize("dialect", ["standard", "prac"])
def test_rules_about_constants_are_found(dialect):
    """Of three levels, one goes with a way, in models of either dialect."""
    random = np.random.default_rng(0)
    levels = random.choice(["Low", "Middle", "High"], 300)
    ways = np.where(random.random(300) < np.where(levels == "Low", 0.9, 0.3), "Near", "Far")
    model = ml.model_from_text("level(person, l!)\nway(person, w!)", dialect=dialect)
    text = "\n".join(f"level(P{i}, {a})\nway(P{i}, {b})" for i, (a, b) in enumerate(zip(levels, ways, strict=True)))
    data = ml.evidence_from_text(text, model=model)
    found = find_rules(model, data, predict=["way(+, #)"], given=["level(+, #)"], most_literals=1, resamples=2)
    x = "?x" if dialect == "prac" else "x"
    assert found.n_candidates == 6
    assert found.rules[0].text in {f"level({x}, Low) => way({x}, {way})" for way in ("Near", "Far")}


def test_a_candidate_that_is_a_formula_of_the_model_is_another():
    """The hard formula holds in what is drawn, though a candidate says the same."""
    model = ml.model_from_text("S(p)\nC(p)\nS(x) => C(x).")
    facts = [f"S(P{i})\nC(P{i})" for i in range(20)] + [f"?S(Q{i})\n?C(Q{i})" for i in range(20)]
    data = ml.evidence_from_text("\n".join(facts) + "\np = {R1, R2, R3}", model=model)
    found = find_rules(model, data, predict=["C"], given=["S"], resamples=0)
    assert found.model.templates[0].hard


def test_models_with_rules_fit_the_databases():
    """A rule that names the second constant of its type only."""
    model = ml.model_from_text("G(p, k!)\nS(p)")
    lines = [f"G(P{i}, {('K1', 'K2', 'K3')[i % 3]})" + f"\nS(P{i})" * (i % 3 == 1) for i in range(60)]
    data = ml.evidence_from_text("\n".join(lines), model=model)
    found = find_rules(model, data, predict=["S"], given=["G(+, #)"], resamples=0)
    assert [r.text for r in found.rules] == ["G(x, K2) => S(x)"]
    assert found.model.types["k"].constants == data.types["k"].constants
    learned = ml.learn(found.model, data, predict=["S"])
    assert learned.weights[-1] > 3
    asked = ml.evidence_from_text("G(Z, K2)\nG(Y, K3)", model=learned.model)
    assert ml.marginal(learned.model, asked, ["S"])["S(Z)"] > 0.8


def test_comparisons_are_no_predicates_of_rules():
    model = ml.model_from_text("age(p, int!)\nS(p)\nC(p)\nage(x, a) ^ a > 30 => C(x)")
    people = [f"age(P{i}, {20 + i % 20})" + f"\nS(P{i})\nC(P{i})" * (i % 2) for i in range(60)]
    data = ml.evidence_from_text("\n".join(people), model=model)
    found = find_rules(model, data, predict=["C"], most_literals=1, resamples=0)
    assert "S(x) => C(x)" in {r.text for r in found.rules}


def test_no_candidate_is_refused():
    model = ml.model_from_text("S(p)\nH(q)\n")
    data = ml.evidence_from_text("S(A)\nH(B)", model=model)
    with pytest.raises(ml.QueryMistake, match="no rule to try"):
        find_rules(model, data, predict=["S"], given=["H"])


@pytest.mark.parametrize("unknown", [{"Ill": 0.3}, {"Ill": 0.2, "Smokes": 0.3}, {"Rich": 0.3}])
def test_planted_rules_are_found_where_labels_are_missing(unknown):
    model, lines = planted_lines(1000, 0)
    data = ml.evidence_from_text("\n".join(without(lines, unknown, 1000)), model=model)
    found = find_rules(model, data, predict=["Ill"], given=GIVEN, resamples=2)
    assert f1({r.text for r in found.rules}, PLANTED) == 1.0
    weights = {r.text: r.weight for r in found.rules}
    assert weights["Smokes(x) => Ill(x)"] == pytest.approx(1.5, abs=0.6)


def test_nothing_is_found_in_noise_where_labels_are_missing():
    model, lines = planted_lines(600, 1, strength=0.0)
    data = ml.evidence_from_text("\n".join(without(lines, {"Ill": 0.3, "Smokes": 0.3}, 600)), model=model)
    assert find_rules(model, data, predict=["Ill"], given=GIVEN[:3], resamples=2).rules == ()


def test_unknown_atoms_do_not_count_as_examples():
    """People of whom nothing is known but that they smoke change nothing; taken for healthy, they would."""
    model = ml.model_from_text("S(p)\nC(p)\n")
    known = [f"S(P{i})" for i in range(60)] + [f"C(P{i})" for i in range(45)] + [f"C(Q{i})" for i in range(15)]
    people = ", ".join(f"{name}{i}" for name in "PQ" for i in range(60))
    data = ml.evidence_from_text("\n".join([f"p = {{{people}}}", *known]), model=model)
    more = [f"S(R{i})\n?C(R{i})" for i in range(60)]
    marked = ml.evidence_from_text("\n".join([f"p = {{{people}}}", *known, *more]), model=model)
    false = [
        f"!C({name}{i})" for name, start in (("P", 45), ("Q", 15)) for i in range(60) if (name == "P") <= (i >= 45)
    ]
    false = [line for line in false if line[1:] not in known]
    opened = ml.evidence_from_text("\n".join([*known, *false, *(f"S(R{i})" for i in range(60))]), model=model)
    (rule,) = find_rules(model, data, predict=["C"], given=["S"], resamples=0).rules
    for other, options in ((marked, {}), (opened, {"open_predicates": ["C"]})):
        (again,) = find_rules(model, other, predict=["C"], given=["S"], resamples=0, **options).rules
        assert (again.text, again.weight) == (rule.text, pytest.approx(rule.weight, abs=1e-6))
        assert again.score == pytest.approx(rule.score, abs=1e-6)


def test_unknown_values_of_blocks_are_drawn_and_not_examples():
    model = ml.model_from_text("level(person, degree!)\nway(person, how!)")
    low = [("Low", "High")[i % 2] for i in range(120)]
    how = [("Near", "Far")[(i + (i % 10 == 9)) % 2] for i in range(120)]
    facts = [f"level(P{i}, {low[i]})" for i in range(120) if i % 6] + [
        f"way(P{i}, {how[i]})" for i in range(120) if i % 7
    ]
    facts += [f"?way(P{i}, Near)\n?way(P{i}, Far)" for i in range(0, 120, 7)]
    data = ml.evidence_from_text("\n".join(facts), model=model)
    found = find_rules(model, data, predict=["way(+, #)"], given=["level(+, #)"], most_literals=1, resamples=0)
    signs = {"level(x, Low) => way(x, Near)": 1, "level(x, High) => way(x, Near)": -1}
    signs |= {"level(x, Low) => way(x, Far)": -1, "level(x, High) => way(x, Far)": 1}
    assert signs[found.rules[0].text] * found.rules[0].weight > 2


def test_a_predicate_to_leave_open_must_be_there():
    model = ml.model_from_text("S(p)\nC(p)\n")
    data = ml.evidence_from_text("S(A)\nC(B)", model=model)
    with pytest.raises(ml.QueryMistake, match="no predicate D to leave open"):
        find_rules(model, data, predict=["C"], open_predicates=["D"])
