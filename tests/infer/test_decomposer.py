"""Formulas about one constant at a time are solved for one constant of each class: equal to enumeration, grounding."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.infer.exact.alike import alike
from mlnlite.infer.exact.separators import groups_of, separators_of
from mlnlite.infer.lifting import _shares
from tests import brute

DECLARATIONS = """P(a)
Q(a)
R(a, b)
L(a, a)
F(a, c!)
G(a, c?)
*D(a)
*E(b, a)
a = {A1, A2, A3}
b = {B1, B2}
c = {1, 2, 3}
"""
MOST = 300
OPEN = ("P(x)", "Q(x)", "R(x, y)", "R(x, B1)", "L(x, z)", "L(x, A2)", "F(x, u)", "F(x, 2)", "G(x, u)")
KNOWN = ("D(x)", "D(z)", "E(y, x)", "E(B1, A2)", "x = A2", "x != A3", "u > 1")
BOUND = ("EXIST y (R(x, y))", "EXIST z (L(x, z) ^ D(z))", "FORALL u (u > 1 => !G(x, u))", "count(L(x, z) | z) >= 2")
NAMED = ("P(A2)", "R(A1, y)", "Q(A3) ^ G(A3, 1)")
FACTS = {
    "P": ["P(A1)", "!P(A2)", "P(A2)", "!P(A3)", "0.7 P(A3)"],
    "R": ["R(A1, B1)", "!R(A2, B1)", "R(A2, B2)", "0.2 R(A3, B2)", "R(A3, B1)"],
    "L": ["L(A1, A2)", "L(A2, A1)", "!L(A3, A3)", "L(A1, A1)", "!L(A2, A3)", "L(A3, A1)"],
    "F": ["F(A1, 1)", "!F(A2, 2)", "F(A3, 3)", "!F(A2, 1)"],
    "G": ["G(A1, 2)", "!G(A2, 2)", "!G(A3, 1)", "G(A2, 1)"],
    "D": ["D(A1)", "D(A2)", "D(A3)"],
    "E": ["E(B1, A1)", "E(B2, A1)", "E(B1, A2)"],
}


@st.composite
def formulas(draw):
    """All open atoms have x, or the same constant, at the first place."""
    if draw(st.integers(0, 7)) == 0:
        return draw(st.sampled_from(NAMED))
    parts = [draw(st.sampled_from(OPEN))]
    parts += draw(st.lists(st.sampled_from((*OPEN, *KNOWN, *BOUND)), max_size=2))
    if any("u > 1" in p and "FORALL" not in p for p in parts):
        parts.append("F(x, u)")
    signed = [f"{draw(st.sampled_from(['', '!']))}({p})" for p in parts]
    return draw(st.sampled_from([" v ", " ^ "])).join(signed) if len(signed) != 2 else " <=> ".join(signed)


@st.composite
def models(draw):
    lines = [DECLARATIONS]
    for formula in draw(st.lists(formulas(), min_size=1, max_size=4, unique=True)):
        plus = draw(st.sampled_from(["", "", "x", "y"]))
        if plus and "EXIST" not in formula and "count" not in formula:
            formula = formula.replace(f"R({plus},", f"R(+{plus},", 1).replace(f", {plus})", f", +{plus})", 1)
            formula = formula.replace(f"P({plus})", f"P(+{plus})", 1)
        hard = draw(st.integers(0, 4)) == 0 and "+" not in formula
        lines.append(f"({formula})." if hard else f"{draw(st.sampled_from([-1.5, -0.3, 0.4, 2.0]))} {formula}")
    return "\n".join(lines) + "\n"


@st.composite
def facts(draw):
    chosen = [f for name in FACTS for f in draw(st.lists(st.sampled_from(FACTS[name]), max_size=3, unique=True))]
    atoms = [f.split()[-1].lstrip("!") if not f.startswith(("!", "0")) else f.lstrip("!0.27 ") for f in chosen]
    return [f for f, a in zip(chosen, atoms, strict=True) if atoms.count(a) == 1]


@settings(max_examples=60, deadline=None)
@given(models(), facts())
def test_equals_grounding_and_enumeration(text, given_facts):
    model = ml.model_from_text(text)
    try:
        evidence = ml.evidence_from_text("\n".join(given_facts) + "\n", model=model)
    except ml.EvidenceMistake:
        assume(False)
    query = ["P", "Q", "R", "L", "F", "G"]
    try:
        exact = ml.marginal(model, evidence, query, method="exact")
    except ml.Contradiction:
        with pytest.raises(ml.Contradiction):
            ml.marginal(model, evidence, query, method="lifted")
        return
    found = ml.marginal(model, evidence, query, method="lifted")
    assert found.names == exact.names
    assert np.abs(found.probabilities - exact.probabilities).max() < 1e-9
    assert found.log_z == pytest.approx(exact.log_z, abs=1e-9)
    assert set(found.methods) <= {"lifted", "evidence", "closed form"}
    naive = replace(model, templates=tuple(t.expanded(evidence.types) for t in model.templates))
    if not evidence.soft and len(list(islice(brute.worlds(model, evidence), MOST))) < MOST:
        assert found.log_z == pytest.approx(brute.distribution(naive, evidence)[2], abs=1e-9)


CROWD = """Smokes(person)
Cancer(person)
Drinks(person, drink)
Job(person, job!)
Knows(person, person)
Rich(person)
drink = {Tea, Coffee, Wine}
job = {Nurse, Miner, Clerk}
person = {P0, P1}
1.5 Smokes(x) => Cancer(x)
0.4 Drinks(x, Tea) v Drinks(x, Coffee)
-0.5 Drinks(x, +d) ^ Smokes(x)
0.7 Job(x, +j) ^ Smokes(x)
1.0 Cancer(x) => EXIST d Drinks(x, d)
!Cancer(x) v !Drinks(x, Wine).
0.3 Knows(y, x) ^ Rich(y) => Smokes(x)
2 Smokes(P1)
0.6 Cancer(x) ^ x != P0
"""


def crowd(n):
    facts = [f"Smokes(P{i})" for i in range(0, n, 3)] + [f"Job(P{i}, Nurse)" for i in range(0, n, 7)]
    facts += [f"!Drinks(P{i}, Tea)" for i in range(0, n, 5)] + [f"Knows(P7, P{i})" for i in range(0, n, 4)]
    facts += [f"0.9 Cancer(P{i})" for i in range(0, n, 11)] + ["Rich(P7)"]
    return "person = {" + ", ".join(f"P{i}" for i in range(n)) + "}\n" + "\n".join(facts) + "\n"


def test_a_crowd_is_a_few_classes():
    """Facts of every kind, weights and names of single people, hard formulas, quantifiers, functional predicates."""
    model = ml.model_from_text(CROWD)
    evidence = ml.evidence_from_text(crowd(4000), model=model)
    query, closed = ["Smokes", "Cancer", "Job", "Drinks"], ["Knows", "Rich"]
    found = ml.marginal(model, evidence, query, closed_world=closed)
    exact = ml.marginal(model, evidence, query, closed_world=closed, method="exact")
    assert np.abs(found.probabilities - exact.probabilities).max() < 1e-9
    assert found.log_z == pytest.approx(exact.log_z, rel=1e-12)
    assert set(found.methods) == {"lifted", "evidence"}
    assert (np.array(found.methods) == "evidence").tolist() == (np.array(exact.methods) == "evidence").tolist()
    jobs = [i for i, name in enumerate(found.names) if name.startswith("Job(P1,")]
    assert len({int(found.block[i]) for i in jobs}) == 1
    assert found["Job(P1, Nurse)"] + found["Job(P1, Miner)"] + found["Job(P1, Clerk)"] == pytest.approx(1)


def test_what_is_not_about_one_constant_is_ground():
    model = ml.model_from_text(CROWD + "Quiet(drink)\n0.9 Quiet(d) ^ Quiet(e) ^ Quiet(f)\n")
    evidence = ml.evidence_from_text(crowd(4000), model=model)
    query, closed = ["Smokes", "Cancer", "Job", "Drinks", "Quiet", "Quiet(Tea) ^ Quiet(Wine)"], ["Knows", "Rich"]
    found = ml.marginal(model, evidence, query, closed_world=closed)
    exact = ml.marginal(model, evidence, query, closed_world=closed, method="exact")
    assert found.names == exact.names
    assert np.abs(found.probabilities - exact.probabilities).max() < 1e-9
    assert found.log_z == pytest.approx(exact.log_z, rel=1e-12)
    assert [found.methods[found.row(name)] for name in ("Cancer(P1)", "Quiet(Tea)")] == ["lifted", "elimination"]
    with pytest.raises(ml.QueryMistake, match="no lifted inference"):
        ml.marginal(model, evidence, "Cancer", closed_world=closed, method="lifted")


def test_pairs_of_constants():
    """Both variables stand in every atom, so a pair is on its own."""
    text = "P(a, b)\nQ(b, a)\n1.2 P(x, y) => Q(y, x)\n-0.4 P(x, y)\n0.3 Q(y, +x)\n"
    model = ml.model_from_text(text)
    names = [f"{t} = {{{', '.join(f'{t.upper()}{i}' for i in range(60))}}}" for t in "ab"]
    evidence = ml.evidence_from_text("\n".join([*names, "P(A1, B2)", "!Q(B3, A3)", "P(A5, B5)"]) + "\n", model=model)
    found = ml.marginal(model, evidence, ["P", "Q"])
    exact = ml.marginal(model, evidence, ["P", "Q"], method="exact")
    assert set(found.methods) == {"lifted", "evidence"}
    assert np.abs(found.probabilities - exact.probabilities).max() < 1e-12
    assert found.log_z == pytest.approx(exact.log_z)
    group = groups_of(model.templates, evidence)[0]
    separators = separators_of(group, evidence.predicates)
    assert [s.at for s in separators] == [{"P": 0, "Q": 1}, {"P": 1, "Q": 0}]
    assert sorted(alike(group, separators, evidence).size.tolist()) == [1, 2, 3597]


TOWNS = """Smokes(town, person)
Friends(town, person, person)
Rich(town)
0.03 Friends(t, x, y) ^ Smokes(t, x) => Smokes(t, y)
-0.5 Smokes(t, x)
-0.7 Friends(t, x, y)
0.2 Rich(t) ^ Smokes(t, x)
"""


def test_what_is_left_for_one_constant_is_solved_by_cells():
    """The towns are a separator; in a town, people are alike."""
    model = ml.model_from_text(TOWNS)
    small = "town = {A, B, C}\nperson = {P, Q}\nRich(A)\nSmokes(A, P)\nSmokes(B, P)\nSmokes(C, P)\n"
    evidence = ml.evidence_from_text(small, model=model)
    query = ["Smokes", "Friends"]
    exact, found = (ml.marginal(model, evidence, query, method=m, closed_world="Rich") for m in ("exact", "lifted"))
    assert np.abs(found.probabilities - exact.probabilities).max() < 1e-9
    assert found.log_z == pytest.approx(exact.log_z)
    people = "person = {" + ", ".join(f"P{i}" for i in range(200)) + "}\n"
    towns = "town = {" + ", ".join(f"T{i}" for i in range(20)) + "}\n"
    evidence = ml.evidence_from_text(people + towns + "Rich(T1)\nRich(T2)\nSmokes(T3, P1)\n", model=model)
    large = ml.marginal(model, evidence, ["Smokes", "Friends(T1, P1, x)"], closed_world="Rich")
    assert set(large.methods) == {"lifted", "evidence"}
    assert large["Smokes(T4, P0)"] < large["Smokes(T3, P0)"] < large["Smokes(T1, P0)"] == large["Smokes(T2, P9)"]


@pytest.mark.parametrize(
    "formula",
    [
        "1 P(x) ^ Q(y)",  # no variable in both
        "1 P(x) ^ L(x, y) ^ L(y, x)",  # not always at the same place
        "1 P(x) ^ L(x, y) ^ x != y",  # compared with another variable
        "1 P(x) ^ L(x, x) ^ L(x, y)",  # one atom in several groundings
        "1 P(x) ^ L(x, x)",  # some of the atoms of L would belong to nobody
        "1 P(x) => EXIST y Q(y)",
        "1 EXIST x (P(x) ^ Q(x))",  # bound
        "1 F(x, u) ^ S(u)",  # x is a separator, of a predicate that S is not
        "1 S(u) ^ F(x, u) ^ T(u)",  # the values of a block hang together
    ],
)
def test_what_has_no_separator(formula):
    text = "P(a)\nQ(a)\nS(c)\nT(c)\nL(a, a)\nF(a, c!)\n" + formula + "\n"
    model = ml.model_from_text(text)
    evidence = ml.evidence_from_text("a = {A, B}\nc = {C, D}\n", model=model)
    (group,) = groups_of(model.templates, evidence)
    assert separators_of(group, evidence.predicates) == ()


@given(st.lists(st.integers(1, 10**6), min_size=1, max_size=60))
def test_each_class_counts_as_often_as_it_is_large(size):
    size = np.array(size)
    shares = list(_shares(size))
    assert sum(times * which for times, which in shares).tolist() == size.tolist()
    assert len(shares) <= int(size.max()).bit_length()


def test_log_z_counts_atoms_that_evidence_cuts_off():
    """Friends of whom it is known that they smoke have no formula left, and are open all the same."""
    model = ml.model_from_text("S(t)\nR(t, t)\n1 R(x, y) => (S(x) <=> S(y))\n")
    evidence = ml.evidence_from_text("t = {A, B, C}\nS(A)\nS(B)\n", model=model)
    exact, found = (ml.marginal(model, evidence, ["S(C)"], method=m).log_z for m in ("exact", "lifted"))
    every, _, log_z = brute.distribution(replace(model, types=evidence.types), evidence)
    assert len(every) == 2**10
    assert exact == pytest.approx(log_z, abs=1e-12)
    assert found == pytest.approx(log_z, abs=1e-12)
