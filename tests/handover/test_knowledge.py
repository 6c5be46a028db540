"""The knowledge base: facts, training, answers, reasons."""

import pytest
from click.testing import CliRunner

import mlnlite as ml
from mlnlite.cli import mlnlite as command
from mlnlite.domains.handover.instances.generate import facts_of, generate
from mlnlite.domains.handover.knowledge.advise import advice_data, advice_text, advise
from mlnlite.domains.handover.knowledge.ask import (
    ask,
    certify,
    explain,
    level_distribution,
    open_knowledge,
    read_learnt,
)
from mlnlite.domains.handover.knowledge.facts import databases_text, gathered_text, kept, object_facts
from mlnlite.domains.handover.knowledge.reasons import said
from mlnlite.domains.handover.knowledge.train import train, write_knowledge
from mlnlite.domains.handover.knowledge.words import ASKED, VARIANTS, read_knowledge, role_of, roles_table
from mlnlite.domains.handover.scene.objects import object_names, read_object
from mlnlite.domains.handover.scene.scene import make_scene


@pytest.fixture(scope="module")
def knowledge():
    rows = [row for row in generate(n_synthetic=400) if row.thing != "mug"]
    return open_knowledge(train(read_knowledge(), facts_of(rows)).model)


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_variant_is_a_model(variant):
    model = read_knowledge(variant)
    assert ml.model_text(ml.model_from_text(ml.model_text(model))) == ml.model_text(model)
    assert "graspRegion" in model.predicates


def test_every_region_of_the_catalogue_has_a_role():
    named = {name for names in roles_table()["names"].values() for name in names}
    for name in object_names():
        thing = read_object(name)
        own = roles_table()["objects"].get(name, {})
        assert all(region in named or region in own for region in thing.regions)
        assert set(own) <= set(thing.regions)
        assert {role_of(thing, region) for region in thing.regions} <= set(roles_table()["roles"])


def test_gathered_databases_teach_the_same():
    model = read_knowledge()
    rows = [kept(facts, model.predicates) for facts in facts_of(generate(n_synthetic=60)[::4])]
    both = [
        ml.learn(model, ml.evidence_from_text(text(rows), model=model), predict=ASKED, prior=1.0)
        for text in (databases_text, gathered_text)
    ]
    assert both[0].value == pytest.approx(both[1].value, rel=1e-9)


def test_unseen_object_and_low_mobility(knowledge):
    mug = read_object("mug")
    answer = ask(knowledge, mug, "to_pour", "L")
    assert (answer.region, answer.method) == ("handle", "ours")
    assert sum(answer.regions.values()) == pytest.approx(1.0)
    assert sum(answer.methods.values()) == pytest.approx(1.0)
    assert answer.error == 0
    assert ask(knowledge, mug, "to_pour", "H").method == "B"


def test_the_most_probable_world_is_proven(knowledge):
    found = certify(knowledge, read_object("mug"), "to_pour", "L")
    assert found.status == "optimal"
    assert found["handover(x, ours)"]
    assert found["graspRegion(x, 3)"]


def test_uncertain_levels_mix_the_answers(knowledge):
    mug = read_object("mug")
    high, low = (ask(knowledge, mug, "to_pour", level).methods for level in ("H", "L"))
    mixed = ask(knowledge, mug, "to_pour", {"H": 0.25, "L": 0.75}).methods
    assert mixed["ours"] == pytest.approx(0.25 * high["ours"] + 0.75 * low["ours"])
    assert set(ask(knowledge, mug, "to_pour", "unknown").levels) == {"H", "H-M", "L-M", "L"}


@pytest.mark.parametrize("level", ["Q", {"L": 0.7}, {"L": 1.5, "H": -0.5}])
def test_senseless_levels(level):
    with pytest.raises(ml.MlnError):
        level_distribution(level)


def test_reasons_add_up_to_the_log_odds(knowledge):
    from math import log

    mug = read_object("mug")
    answer = ask(knowledge, mug, "to_pour", "L")
    reasons = explain(knowledge, mug, "to_pour", answer)
    for predicate, probabilities in (("handover", answer.methods), ("graspRegion", answer.regions)):
        first, second = list(probabilities.values())[:2]
        assert sum(r.log_odds for r in reasons if r.predicate == predicate) == pytest.approx(
            log(first / second), abs=1e-6
        )
    assert "arm mobility (low)" in said(reasons, "handover")[0]
    assert said(reasons, "handover", most=1)[1].startswith("all else together")


def test_advice_has_poses_and_words(knowledge):
    advice = advise(knowledge, make_scene("mug", "to_pour", "L"))
    assert advice.configuration is not None
    assert advice.configuration.method == "ours"
    text = advice_text(advice, certify(knowledge, advice.thing, "to_pour", "L"))
    assert "low arm mobility" in text
    assert "optimal, gap 0" in text
    assert advice_data(advice)["object_pose"]["frame"] == "world"


def test_a_task_that_is_not_afforded(knowledge):
    with pytest.raises(ml.MlnError, match="to_cut"):
        ask(knowledge, read_object("mug"), "to_cut", "L")
    with pytest.raises(ml.MlnError):
        object_facts(read_object("mug"), "to_cut")


def test_a_learnt_model_survives_its_file(knowledge, tmp_path):
    rows = facts_of(generate(n_synthetic=60))
    learned = train(read_knowledge(), rows)
    write_knowledge(learned, tmp_path / "k.mln")
    again, mug = read_learnt(tmp_path / "k.mln"), read_object("mug")
    assert ask(again, mug, "to_pour", "L").methods == pytest.approx(
        ask(open_knowledge(learned.model), mug, "to_pour", "L").methods
    )


def test_commands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner()
    made = run.invoke(command, ["handover", "dataset", "--no-poses", "-o", "data"])
    assert "1,657 instances over 32 objects" in made.output
    taught = run.invoke(
        command, ["handover", "train", "--data", "data/instances-sampled.csv", "--without", "mug", "-o", "k.mln"]
    )
    assert taught.exit_code == 0, taught.output
    asked = run.invoke(
        command, ["handover", "query", "k.mln", "--task", "to_pour", "--level", "L=0.7,L-M=0.3", "--no-place"]
    )
    assert "leave free    handle" in asked.output
    wrong = run.invoke(command, ["handover", "query", "k.mln", "--task", "to_fly", "--no-place"])
    assert wrong.exit_code == 2
    assert "to_fly" in wrong.output
