"""What a world pays for, one by one; the best world with an atom the other way round; several worlds."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings

import mlnlite as ml
from mlnlite.cli import mlnlite as command
from tests import brute
from tests.models import evidence_texts, model_texts

MODEL = """*Friends(person, person)
Smokes(person)
Cancer(person)
person = {Ann, Bob, Cid}
1.2 Friends(x, y) ^ Smokes(x) => Smokes(y)
1.5 Smokes(x) => Cancer(x)
-0.7 Cancer(x)
0.4 Smokes(x)
"""
EVIDENCE = "Friends(Ann, Bob)\nFriends(Bob, Cid)\nSmokes(Ann)\n!Smokes(Cid)\n"


def given_both():
    model = ml.model_from_text(MODEL)
    return model, ml.evidence_from_text(EVIDENCE, model=model)


@settings(max_examples=20, deadline=None)
@given(text=model_texts(plus=True), facts=evidence_texts())
def test_what_is_paid_is_what_the_definition_counts(text, facts):
    model = ml.model_from_text(text)
    try:
        evidence = ml.evidence_from_text(facts, model=model)
        state = ml.map_state(model, evidence, why=True)
    except ml.MlnError:
        return
    counted = {v.formula: v for v in state.violated}
    quantified = [v for f, v in counted.items() if "EXIST" in f or "FORALL" in f]
    if quantified:
        return
    total = sum(g.cost for g in state.paid)
    assert total <= state.cost + 1e-9
    assert total >= state.open_cost - 1e-9


def test_groundings_have_bindings():
    model, evidence = given_both()
    state = ml.map_state(model, evidence, why=True)
    assert sum(g.cost for g in state.paid) == pytest.approx(state.cost)
    every = {(g.formula, g.binding) for g in state.paid}
    assert ("-0.7 Cancer(x)", (("x", "Ann"),)) in every or ("Cancer(x)", (("x", "Ann"),)) in every
    costs = [g.cost for g in state.paid]
    assert costs == sorted(costs, reverse=True)
    assert state.to_dict()["paid"][0]["binding"]
    assert "with x = " in str(state)


@pytest.mark.parametrize("atom", ["Smokes(Bob)", "Cancer(Ann)", "Smokes(Ann)"])
def test_alternatives_equal_enumeration(atom):
    model, evidence = given_both()
    state = ml.map_state(model, evidence, explain=atom)
    found = state.alternative
    predicate, name = atom[:-1].split("(")
    ids = {"Ann": 0, "Bob": 1, "Cid": 2}
    key = (predicate, (ids[name],))
    every = [(brute.log_weight(model, evidence, w), w) for w in brute.worlds(model, evidence)]
    best = max(every, key=lambda e: e[0])
    others = [value for value, w in every if w[key] != best[1][key]]
    if not others:
        assert found.margin == np.inf
        assert "cannot" in str(found)
        return
    assert found.margin == pytest.approx(best[0] - max(others), abs=1e-6)
    assert found.changes[0].removeprefix("!") == atom
    assert sum(g.cost for g in found.pays) - sum(g.cost for g in found.saves) == pytest.approx(found.margin)
    assert found.to_dict()["margin"] == pytest.approx(found.margin)


def test_what_is_to_be_explained_is_one_atom():
    model, evidence = given_both()
    with pytest.raises(ml.QueryMistake):
        ml.map_state(model, evidence, explain="Smokes")


def test_several_worlds_equal_enumeration():
    model, evidence = given_both()
    states = ml.map_states(model, evidence, k=4)
    weights = sorted((brute.log_weight(model, evidence, w) for w in brute.worlds(model, evidence)), reverse=True)
    assert [s.log_weight for s in states] == pytest.approx(weights[:4])
    assert {s.status for s in states} == {"optimal"}
    different = ml.map_states(model, evidence, k=2, diverse=3.0)
    assert different[0].state == states[0].state
    assert sum(different[1].truth != states[0].truth) >= sum(states[1].truth != states[0].truth)
    with pytest.raises(ml.QueryMistake):
        ml.map_states(model, evidence, k=0)


def test_commands(tmp_path):
    (tmp_path / "m.mln").write_text(MODEL)
    (tmp_path / "e.db").write_text(EVIDENCE)
    base = ["query", str(tmp_path / "m.mln"), "-e", str(tmp_path / "e.db"), "--task", "map"]
    run = CliRunner().invoke(command, [*base, "--why", "--explain", "Smokes(Bob)"])
    assert run.exit_code == 0
    assert "the best world loses" in run.output
    assert "with x = " in run.output
    run = CliRunner().invoke(command, [*base, "--k", "3", "--format", "json"])
    assert len(json.loads(run.output)) == 3
    run = CliRunner().invoke(command, [*base, "--k", "2", "--diverse", "1"])
    assert run.output.count("status:") == 2
    wrong = (["--diverse", "1"], ["--k", "2", "--why"], ["--k", "2", "--format", "csv"])
    for options in wrong:
        assert CliRunner().invoke(command, [*base, *options]).exit_code == 2
    marginal = [*base[:4], "-q", "Smokes", "--why"]
    assert CliRunner().invoke(command, marginal).exit_code == 2


def test_rows_of_constants_that_only_the_evidence_has_are_named():
    """The weight of `+c` is that of a constant which the model never heard of."""
    model = ml.model_from_text("Likes(person, colour)\n0.8 Likes(x, +c)\n1.5 !Likes(x, c)")
    evidence = ml.evidence_from_text("Likes(Ann, Red)\n!Likes(Bob, Blue)\n", model=model)
    state = ml.map_state(model, evidence)
    assert [(v.formula, v.n_groundings) for v in state.violated] == [("Likes(x, Red)", 1), ("Likes(x, Blue)", 1)]


def test_satisfied_groundings_are_not_listed():
    n = 30_000  # 900 million groundings, nearly all of them satisfied
    model = ml.model_from_text("*Friends(p, p)\nSmokes(p)\n1 Friends(x, y) ^ Smokes(x) => Smokes(y)\n0.1 !Smokes(x)\n")
    facts = "".join(f"Friends(P{i}, P{i + 1})\n" for i in range(n)) + "Smokes(P0)\n!Smokes(P2)\n"
    state = ml.map_state(model, ml.evidence_from_text(facts, model=model), why=True)
    assert {g.binding for g in state.paid} == {(("x", "P0"), ("y", "P1"))}
