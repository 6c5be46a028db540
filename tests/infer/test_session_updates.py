"""Facts that come and go: a session that is updated is one that is compiled with what it then knows."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.engines.duckdb import DuckDBEngine
from mlnlite.ground.update import updated
from mlnlite.infer.score import counts
from tests import brute
from tests.models import evidence_texts, model_texts

QUERY = ["P", "Q", "R", "F", "G"]


def facts_of(text):
    return {line.removeprefix("!"): not line.startswith("!") for line in text.split()}


def text_of(facts):
    return "\n".join(("" if truth else "!") + atom for atom, truth in facts.items())


def one_line(text):
    return text.replace(", ", ",")


def truth_of(network, world):
    return np.array([world[network.evidence.atom_at(int(a))] for a in network.atoms], bool)


def same_network(model, evidence, network, fresh):
    """Whether both count the same true groundings in worlds, and have the same variables over the fresh one's atoms."""
    assert set(fresh.atoms) <= set(network.atoms)
    assert network.n_groundings.tolist() == fresh.n_groundings.tolist()
    for world in itertools.islice(brute.worlds(model, evidence), 0, 4096, 97):
        assert counts(network, truth_of(network, world)).tolist() == counts(fresh, truth_of(fresh, world)).tolist()
    sizes = {tuple(sorted(network.atoms[network.variable == v])): c for v, c in enumerate(network.cardinality)}
    for v, c in enumerate(fresh.cardinality):
        assert sizes[tuple(sorted(fresh.atoms[fresh.variable == v]))] == c
    for block in (*network.clauses, *network.tables):
        assert (block.count > 0).all()


@st.composite
def stories(draw):
    """A model, closed predicates, and what is known from time to time."""
    closed = draw(st.sets(st.sampled_from("PQRG")))
    known = [facts_of(one_line(draw(evidence_texts())))]
    for _ in range(draw(st.integers(1, 3))):
        now, touched = facts_of(one_line(draw(evidence_texts()))), draw(st.sets(st.sampled_from("PQRFG")))
        step = {a: t for a, t in known[-1].items() if a[0] not in touched}
        known.append(step | {a: t for a, t in now.items() if a[0] in touched})
    return draw(model_texts()), closed, known


@settings(max_examples=100, deadline=None)
@given(stories())
def test_equals_grounding_anew(story):
    text, closed, known = story
    model = ml.model_from_text(text)

    def compiled(facts):
        evidence = ml.closed(ml.evidence_from_text(text_of(facts), model=model), closed)
        try:
            return ml.compile(model, query=QUERY, evidence=evidence)
        except ml.Contradiction:
            return None

    session, facts = compiled(known[0]), known[0]
    for now in known[1:]:
        fresh = compiled(now)
        if session is None:
            session, facts = fresh, now
            continue
        add, withdraw = ({a: t for a, t in x.items() if y.get(a) != t} for x, y in ((now, facts), (facts, now)))
        if fresh is None:
            with pytest.raises(ml.Contradiction):
                session.updated(text_of(add), text_of(withdraw))
            continue
        session, facts = session.updated(text_of(add), text_of(withdraw)), now
        same_network(fresh.network.model, fresh.evidence, session.network, fresh.network)
        try:
            expected = fresh.query().probabilities
        except ml.Contradiction:
            with pytest.raises(ml.Contradiction):
                session.query()
            continue
        assert session.query().probabilities == pytest.approx(expected, abs=1e-9)


WIDE = f"""A(p)
B(p, q)
C(p)
p = {{P0, P1, P2}}
q = {{{", ".join(f"Q{i}" for i in range(16))}}}
0.7 A(x) <=> EXIST y B(x, y)
1.1 count(B(x, y) | y) >= 3
-0.4 B(x, y) ^ C(x)
2 C(x) => A(x)
"""


@pytest.mark.parametrize("engine", [None, DuckDBEngine()])
def test_counts_soft_evidence_and_every_engine(engine):
    model = ml.model_from_text(WIDE)
    soft = "0.8 A(P0)\n0.3 B(P1, Q2)\n"
    rng = np.random.default_rng(3)
    names = [f"B(P{i},Q{j})" for i in range(3) for j in range(16)] + [f"{n}(P{i})" for n in "AC" for i in range(3)]
    names = [n for n in names if n not in soft.replace(", ", ",")]
    known: dict[str, bool] = {}
    network = ml.ground(model, ml.evidence_from_text(soft, model=model))
    for _ in range(6):
        now = {n: bool(rng.random() < 0.4) for n in rng.choice(names, 12, replace=False)}
        evidence = ml.evidence_from_text(soft + text_of(now), model=model)
        changed = ml.evidence_from_text("\n".join({**known, **now}), model=model).facts
        numbers = np.concatenate([evidence.atom_number(n, f.arguments) for n, f in changed.items()])
        network, known = updated(network, evidence, numbers, engine=engine), now
        fresh = ml.ground(model, evidence, engine=engine)
        for _ in range(20):
            truth = rng.random(network.n_atoms) < 0.5
            place = np.searchsorted(network.atoms, fresh.atoms)
            assert network.atoms[place].tolist() == fresh.atoms.tolist()
            assert counts(network, truth).tolist() == counts(fresh, truth[place]).tolist()


SMOKING = (
    "*Friends(p, p)\nSmokes(p)\nCancer(p)\n1.5 Smokes(x) => Cancer(x)\n0.8 Friends(x, y) ^ Smokes(x) => Smokes(y)\n"
)


def smoking(facts="Friends(Ann, Bob)\nSmokes(Ann)"):
    model = ml.model_from_text(SMOKING + "p = {Ann, Bob, Cy}\n")
    return ml.compile(model, query="Cancer", evidence=ml.evidence_from_text(facts, model=model))


def test_facts_that_last_and_facts_of_a_question():
    session = smoking()
    changed = session.updated(add=[("Friends", "Ann", "Cy")], withdraw="Smokes(Ann)")
    assert changed.query("Smokes(Ann)") == smoking("Friends(Ann, Bob)\nFriends(Ann, Cy)\nSmokes(Ann)").query()
    assert session.query() == smoking().query()
    assert changed.updated(withdraw="Friends(Ann, Cy)", add="Smokes(Ann)").query() == session.query()
    turned = session.updated(withdraw="Smokes(Ann)", add="!Smokes(Ann)")
    assert turned.map_state().log_weight == smoking("Friends(Ann, Bob)\n!Smokes(Ann)").map_state().log_weight
    assert session.updated(add="Smokes(Ann)").query() == session.query()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.updated(withdraw="Smokes(Bob)"), "Smokes.Bob. is no fact of this session"),
        (lambda s: s.updated(withdraw="!Smokes(Ann)"), "Smokes.Ann. is no fact of this session"),
        (lambda s: s.updated(add="!Smokes(Ann)"), "Smokes.Ann. is the opposite of a fact: withdraw that"),
        (lambda s: s.updated(add="Smokes(Dan)"), "Dan is not a constant of the type p in this session"),
        (lambda s: s.updated(add="0.7 Smokes(Bob)"), "the facts of a session are certain"),
        (lambda s: s.updated(add="Smokes(Bob)\n---\nSmokes(Cy)"), "about one world"),
        (lambda s: s.query("Friends(Bob, Cy)"), "Friends.Bob, Cy. is known otherwise in this session"),
        (lambda s: s.query("!Smokes(Ann)"), "Smokes.Ann. is known otherwise in this session"),
    ],
)
def test_facts_that_do_not_fit_are_refused(change, message):
    with pytest.raises(ml.EvidenceMistake, match=message):
        change(smoking())


def test_an_atom_is_certain_or_not():
    with pytest.raises(ml.EvidenceMistake, match=r"a fact about Smokes.* is to be certain"):
        smoking("0.7 Smokes(Bob)").updated(add="Smokes(Bob)")


def test_constants_are_those_of_the_evidence():
    model = ml.model_from_text(SMOKING)
    with pytest.raises(ml.QueryMistake, match="declare them there"):
        ml.compile(model, query="Cancer", evidence=ml.no_evidence(model), constants={"p": ["Ann"]})


def test_contradictions_name_the_formula_and_change_nothing():
    model = ml.model_from_text("S(p)\nC(p)\nF(p, c!)\nc = {C1, C2}\np = {Ann, Bob}\nS(x) => C(x).\n")
    session = ml.compile(model, query="C", evidence=ml.evidence_from_text("!C(Ann)\nF(Ann, C1)", model=model))
    with pytest.raises(ml.Contradiction, match=r"formula 1 false.*Ann"):
        session.updated(add="S(Ann)")
    with pytest.raises(ml.Contradiction, match="true and false"):
        session.updated(add="F(Ann, C2)")
    assert session.updated(add="S(Bob)").query()["C(Bob)"] == 1.0


def test_comparisons_and_atoms_of_no_formula_stay_what_they_are():
    text = "Rain\nWet(p)\nAge(p, n)\nSpare(p)\np = {A, B}\nn = {1, 2, 3}\n"
    model = ml.model_from_text(text + "1.5 Rain => Wet(x)\n0.7 Age(x, a) ^ a < 3 => Wet(x)\n0 Spare(x)\n")

    def compiled(facts):
        return ml.compile(model, query="Wet", evidence=ml.evidence_from_text(facts, model=model))

    session = compiled("!Rain\nAge(A, 1)").updated(withdraw="!Rain", add=[("Rain",), ("Spare", "B")])
    assert session.query().probabilities == pytest.approx(compiled("Rain\nAge(A, 1)").query().probabilities, abs=1e-9)
    session = session.updated(withdraw="Age(A, 1)\nSpare(B)", add="Wet(A)").updated(withdraw="Wet(A)\nRain")
    assert session.query().probabilities == pytest.approx(compiled("").query().probabilities, abs=1e-9)
