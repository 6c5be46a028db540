"""Scores are what their definitions say, on models whose probabilities are known."""

from math import log

import pytest

import mlnlite as ml

COIN = "P(thing)\nlog(0.8/0.2) P(x)"
DIE = "Side(die, side!)\nlog(0.5) Side(x, A)\nlog(0.3) Side(x, B)\nlog(0.2) Side(x, C)"


def score(model, facts, name, **options):
    model = ml.model_from_text(model)
    (found,) = ml.evaluate(model, ml.evidence_from_text(facts, model=model), predicates=[name], **options).scores
    return found


def test_negative_facts_say_which_atoms_have_labels():
    found = score(COIN, "P(A)\nP(B)\n!P(C)\nthing = {D}", "P")
    assert (found.unit, found.n, found.accuracy, found.majority) == ("atoms", 3, 2 / 3, 2 / 3)
    assert found.balanced_accuracy == 0.5
    assert found.log_loss == pytest.approx(-(2 * log(0.8) + log(0.2)) / 3)
    assert found.brier == pytest.approx((2 * 0.2**2 + 0.8**2) / 3)


def test_without_negative_facts_a_database_is_complete():
    found = score(COIN, "P(A)\nP(B)\nthing = {C, D}", "P")
    assert (found.n, found.accuracy, found.majority) == (4, 0.5, 0.5)


def test_a_database_without_labels_does_not_count():
    model = ml.model_from_text("Q(thing)\n" + COIN)
    evidence = ml.evidence_from_text("P(A)\n---\nQ(A)\n---\nP(A)", model=model)
    found = ml.evaluate(model, evidence, predicates=["P"])
    assert (found.n_databases, found.scores[0].n) == (2, 2)


def test_blocks_count_once_and_by_their_most_probable_value():
    found = score(DIE, "Side(X, A)\nSide(Y, B)\nSide(Z, A)\ndie = {Unlabelled}", "Side")
    assert (found.unit, found.n, found.accuracy, found.balanced_accuracy) == ("blocks", 3, 2 / 3, 0.5)
    assert found.log_loss == pytest.approx(-(2 * log(0.5) + log(0.3)) / 3)
    hit, missed = 0.5**2 + 0.3**2 + 0.2**2, 0.7**2 + 0.5**2 + 0.2**2
    assert found.brier == pytest.approx((2 * hit + missed) / 3)


def test_none_is_a_value_of_an_optional_block():
    found = score(DIE.replace("!", "?"), "Side(X, A)\ndie = {Y}", "Side")
    assert found.n == 2
    assert found.log_loss == pytest.approx(-(log(0.5 / 2) + log(1 / 2)) / 2)


def test_values_keep_their_names_across_databases():
    found = score(DIE.replace("C", "Far"), "Side(X, Far)\n---\nSide(X, Far)\nside = {New}", "Side")
    assert found.majority == 1.0


def test_other_predicates_are_complete_unless_open():
    model = "Q(thing)\nP(thing)\nlog(0.8/0.2) P(x)\n-5 Q(x) ^ P(x)"
    assert score(model, "P(A)", "P").accuracy == 1.0
    assert score(model, "P(A)", "P").log_loss == pytest.approx(-log(0.8))
    assert score(model, "P(A)", "P", closed_world=[]).log_loss > -log(0.8) + 0.1


def test_a_result_prints_and_is_plain_data():
    model = ml.model_from_text(COIN)
    found = ml.evaluate(model, ml.evidence_from_text("P(A)", model=model), predicates=["P"])
    head = str(found).splitlines()[0].split()
    assert {"predicate", "labels", "accuracy", "balanced", "log-loss", "Brier", "majority"} <= set(head)
    assert found.to_dict()["scores"][0]["predicate"] == "P"
    assert '"n_databases": 1' in found.to_json()


@pytest.mark.parametrize(("names", "message"), [([], "nothing is evaluated"), (["R"], "there is no predicate R")])
def test_mistakes(names, message):
    model = ml.model_from_text(COIN)
    with pytest.raises(ml.QueryMistake, match=message):
        ml.evaluate(model, ml.evidence_from_text("P(A)", model=model), predicates=names)


def test_marked_atoms_have_no_label_and_are_not_false():
    model = "Q(thing)\nP(thing)\nlog(0.8/0.2) P(x)\n-5 Q(x) ^ P(x)"
    complete = score(model, "P(A)\nQ(B)\nthing = {C}", "P")
    assert complete.n == 3
    marked = score(model, "P(A)\nQ(B)\n?P(C)", "P")
    assert marked.n == 2
    opened = score(model, "P(A)\n?Q(A)", "P")
    assert opened.log_loss > score(model, "P(A)", "P").log_loss + 0.1
