"""Instances, mean poses, and the evaluation's parts."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mlnlite as ml
from mlnlite.domains.handover.evaluation import metrics, models
from mlnlite.domains.handover.evaluation.goals import goals_section
from mlnlite.domains.handover.evaluation.grasp_choice import compare_grasps
from mlnlite.domains.handover.evaluation.protocol import PAPER_TEST, is_near, predictions, run_split, splits
from mlnlite.domains.handover.evaluation.protocol_tables import protocol_section
from mlnlite.domains.handover.evaluation.published import blocks, keys, read_published
from mlnlite.domains.handover.evaluation.quality import VARIANTS, measured_of, quality_section
from mlnlite.domains.handover.evaluation.real import METHOD, REGION, HeldOut, rows_of
from mlnlite.domains.handover.evaluation.schemes import grouped_folds
from mlnlite.domains.handover.evaluation.tables import paper_is_lookup
from mlnlite.domains.handover.instances.generate import facts_of, generate
from mlnlite.domains.handover.instances.poses import (
    Cell,
    all_cells,
    mean_pose,
    mean_quaternion,
    place,
    place_all,
    templates,
)
from mlnlite.domains.handover.instances.write import read_rows, write_db, write_rows, write_templates
from mlnlite.domains.handover.knowledge.train import train
from mlnlite.domains.handover.knowledge.words import read_knowledge
from mlnlite.domains.handover.scene.objects import object_names, read_object
from mlnlite.domains.handover.study.preferences import published

DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(not (DATA / "handover" / "dataset.db").exists(), reason="no published data")


@pytest.mark.parametrize("labels", ["sampled", "preferred"])
def test_counts_of_the_paper(labels):
    rows = generate(labels)
    assert Counter(row.source for row in rows) == {"study": 259, "synthetic": 1398}
    assert {row.thing for row in rows} == set(object_names())
    study = [row for row in rows if row.source == "study"]
    assert {row.thing for row in study} == set(published().objects)
    assert Counter(row.level for row in study) == {"H": 179, "H-M": 27, "L-M": 18, "L": 35}
    if labels == "preferred":
        assert {(r.level, r.method) for r in rows} == {("H", "B"), ("H-M", "B"), ("L-M", "ours"), ("L", "ours")}
    else:
        assert Counter(r.method for r in study if r.level == "H") == {"A": 42, "B": 132, "ours": 5}


def test_same_seed_same_rows_and_unknown_labels():
    assert generate(seed=3) == generate(seed=3)
    with pytest.raises(ml.MlnError, match="way to label"):
        generate("guessed")


def test_mean_rotation():
    quats = np.roll(Rotation.from_euler("z", [[10], [20], [30]], degrees=True).as_quat(), 1, axis=1)
    quats[1] *= -1
    expected = np.roll(Rotation.from_euler("z", 20, degrees=True).as_quat(), 1)
    assert mean_quaternion(quats) == pytest.approx(expected, abs=1e-9)
    found = mean_pose(np.eye(3), quats)
    assert np.degrees(found.angle) == pytest.approx(np.sqrt(200 / 3), rel=1e-6)
    assert found.n == 3


def test_tables_there_and_back(tmp_path):
    rows = [row for row in generate() if row.thing == "ball"]
    placed = place_all(all_cells([read_object("ball")], ["H", "L"]))
    assert all(one.status == "optimal" for one in placed.values())
    write_rows(rows, placed, tmp_path / "rows.csv")
    write_db(rows, tmp_path / "rows.db")
    write_templates(templates(placed, {"ball": "sphere"}), tmp_path / "poses.csv")
    assert list(read_rows(tmp_path / "rows.csv")) == rows
    model = read_knowledge()
    assert len(ml.read_evidence(tmp_path / "rows.db", model=model).facts["handover"].arguments) == len(rows)
    assert (tmp_path / "poses.csv").read_text().count("sphere") == 3


def test_a_cell_repeats():
    cell = Cell("ball", 1, "L", "ours")
    assert np.array_equal(place(cell).position, place(cell).position)


def test_tolerance():
    upright = np.array([1.0, 0, 0, 0])
    turned = np.roll(Rotation.from_euler("x", 1.9, degrees=True).as_quat(), 1)
    assert is_near((np.zeros(3), upright), (np.array([0.004, 0, 0]), turned))
    assert not is_near((np.zeros(3), upright), (np.array([0.006, 0, 0]), upright))


def test_unseen_objects_of_the_paper():
    rows = generate("preferred")
    assert splits(3)[0] == PAPER_TEST
    assert splits(3)[1] != splits(3)[2]
    found = run_split(rows, {}, PAPER_TEST)
    share = {key: right / n for key, (right, n) in found.scores.items()}
    for model in ("ours", "ceiling"):
        for measure in ("method", "region"):
            assert share[model, measure, "synthetic", "all"] >= 0.98
    assert share["chance", "method", "synthetic", "all"] == pytest.approx(1 / 3)
    assert share["chance", "method", "synthetic", "all"] < share["majority", "method", "synthetic", "all"]


def test_the_report_keeps_sources_apart_and_says_what_is_missed():
    found = run_split(generate("sampled", n_synthetic=300), {}, ("mug", "book", "comb"))
    text = protocol_section({"sampled": [found]})
    assert "### Labels sampled, synthetic rows" in text
    assert "### Labels sampled, rows of the study" in text
    assert {key[2] for key in found.scores} == {"synthetic", "study"}
    truth, groups = np.array([0, 1, 1, 0]), ("a", "a", "b", "b")
    good, bad = np.eye(2)[truth] * 0.8 + 0.1, np.full((4, 2), 0.5)
    for mine, holds in ((good, "yes"), (bad, "**no**")):
        probabilities = {"majority": good * 0.9 + 0.05, "ours": mine}
        one = HeldOut("key", REGION, truth, groups, np.zeros(4, int), probabilities, {}, 1.0)
        goals = [line for line in goals_section({}, [one]).splitlines() if "log-loss" in line]
        assert goals[0].endswith(f"| {holds} |")


def test_each_cost_left_out_is_missed_where_it_counts():
    found = {r.variant: r for r in measured_of(("pr2",), "bottle") if r.level == "L"}
    assert set(found) == set(VARIANTS)
    ours = found["ours"]
    assert len(ours.passed) == 5
    assert found["ours without C_A"].apart <= ours.apart
    assert found["ours without C_S"].safety <= ours.safety
    assert found["ours without C_R"].reach > ours.reach
    assert "| ours without C_R |" in quality_section(list(found.values()), 1)


def test_poses_are_right_if_the_same_cell_is_and_no_pose_is_judged_where_there_is_none():
    rows = [row for row in generate("preferred") if row.thing in ("ball", "marker")]
    placed = place_all(all_cells([read_object("ball")], ["H", "H-M", "L-M", "L"]))
    found = run_split(generate("preferred"), placed, ("ball", "marker"))
    right, n = found.scores["ceiling", "pose and grasp", "synthetic", "all"]
    assert right == n == sum(row.thing == "ball" for row in rows)
    assert found.scores["chance", "pose and grasp", "synthetic", "all"][0] < n
    assert set(found.answers) == {(row.thing, row.task, row.level) for row in rows}


def test_answers_together_are_answers_alone():
    rows = generate("sampled", n_synthetic=200)
    model = train(read_knowledge(), facts_of(rows)).model
    from mlnlite.domains.handover.knowledge.ask import ask, open_knowledge

    together = predictions(model, [("mug", "to_pour", "L"), ("book", "to_read", "H")])
    alone = ask(open_knowledge(model), read_object("mug"), "to_pour", "L")
    region, method = together["mug", "to_pour", "L"]
    assert (read_object("mug").regions[region - 1], method) == (alone.region, alone.method)


def test_metrics():
    labels, p = np.array([0, 1, 1]), np.array([[0.9, 0.1], [0.2, 0.8], [0.5, 0.5]])
    assert metrics.accuracy(labels, p) == pytest.approx(2.5 / 3)
    assert metrics.balanced_accuracy(labels, p) == pytest.approx((1 + 0.75) / 2)
    assert metrics.log_loss(labels, p) == pytest.approx(-np.log([0.9, 0.8, 0.5]).mean())
    low, high = metrics.cluster_interval(np.array([1.0, 1, 0, 0]), ["a", "a", "b", "b"])
    assert (low, high) == (0.0, 1.0)


def test_folds_keep_groups_whole():
    groups = [f"g{i // 3}" for i in range(90)]
    folds = grouped_folds(groups, ["a" if i % 2 else "b" for i in range(90)], n=5)
    assert sorted(np.concatenate(folds).tolist()) == list(range(90))
    assert all(len({groups[i] for i in f} & {groups[i] for g in folds if g is not f for i in g}) == 0 for f in folds)


def test_grasps_with_and_without_the_task():
    found = compare_grasps([read_object("scissors"), read_object("mug")])
    assert all(c.free[0] == 1.0 for c in found)
    assert all(0 <= c.p <= 1 for c in found)


@needs_data
def test_published_rows():
    rows = read_published(DATA)
    assert len(rows) == 429
    assert Counter(r.level for r in rows) == {"level_1": 210, "level_2": 78, "level_3": 52, "level_4": 89}
    assert Counter(r.method for r in rows) == {"midway": 266, "far": 108, "ours": 55}
    assert (sum(r.gap for r in rows), sum(len(r.known) > 3 for r in rows)) == (74, 416)
    assert (len(set(keys(rows))), len(set(blocks(rows)))) == (73, 94)


@needs_data
def test_the_papers_model_is_a_lookup_table():
    same, n = paper_is_lookup(read_published(DATA))
    assert (same, n) == (133, 133)


@needs_data
def test_baselines_of_the_reference():
    rows = rows_of(read_published(DATA))
    y = np.array([METHOD.classes.index(row.label("handover")) for row in rows])
    assert metrics.accuracy(y, models.majority(rows, rows, METHOD)) == pytest.approx(0.620, abs=1e-3)
    table = models.lookup(rows, rows, METHOD)
    assert metrics.accuracy(y, table) == pytest.approx(0.946, abs=0.01)


def test_no_published_data(tmp_path):
    with pytest.raises(ml.MlnError, match=r"dataset\.db"):
        read_published(tmp_path)
