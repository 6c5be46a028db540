"""Execution: the safety distance, the state machine, logs."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import mlnlite as ml
from mlnlite.cli import mlnlite as command
from mlnlite.domains.handover.execution.guard import Rules, clearance, may_move, needed, shape_of
from mlnlite.domains.handover.execution.log import read_log, write_log
from mlnlite.domains.handover.execution.machine import Timing
from mlnlite.domains.handover.execution.replay import record
from mlnlite.domains.handover.execution.simulate import (
    Case,
    judge,
    random_cases,
    run_cases,
    scene_at,
    simulate,
    summary,
)
from mlnlite.domains.handover.execution.sockets import Sight
from mlnlite.domains.handover.execution.tracks import SCRIPTS, Eyes, Track, at, limited, read_track, seen
from mlnlite.domains.handover.kinematics.pose import transform_points
from mlnlite.domains.handover.show.figures import joint_origins
from tests.handover import browser


@pytest.fixture(scope="module")
def scene():
    return scene_at(Case("ball"), None)


def test_clearance_is_that_of_the_surface_points(scene):
    shape, q = shape_of(scene, None), scene.robot.home
    origins = transform_points(scene.base, joint_origins(scene.robot.chain, q))
    tool = origins[-1]
    assert clearance(shape, q, (tool + np.array([0, 0, 0.5]))[None]) <= 0.5 + 0.2
    assert clearance(shape, q, origins[3][None]) < 0
    far = np.array([[10.0, 0, 0]])
    assert clearance(shape, q, far) == pytest.approx(clearance(shape, q, far + np.array([1.0, 0, 0])) - 1, abs=0.02)


def test_older_sights_ask_for_more_distance():
    sight = Sight(1.0, np.zeros(3), np.ones(3))
    assert needed(Rules(), sight, 1.5) - needed(Rules(), sight, 1.0) == pytest.approx(0.25)


def test_nothing_moves_blind(scene):
    shape, q = shape_of(scene, None), scene.robot.home
    far = Sight(0.0, np.array([9.0, 0, 0]), np.array([9.0, 0, 1]))
    assert may_move(shape, Rules(), far, (q, q), 0.1)
    assert not may_move(shape, Rules(), None, (q, q), 0.1)
    assert not may_move(shape, Rules(), far, (q, q), 0.5)


@pytest.mark.parametrize("script", SCRIPTS)
def test_every_script_ends_in_time(script):
    case = Case("ball", script=script, seed=4)
    run, track = simulate(case)
    found = judge(case, run, track)
    assert found.end in ("done", "aborted")
    assert found.violations == 0
    assert not found.late
    assert bool(found.cause) == (found.end == "aborted")


motions = st.lists(st.tuples(*(st.floats(-0.6, 0.8),) * 3), min_size=2, max_size=12)


@settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(hand=motions, face=motions, lost=st.floats(0, 0.3), seed=st.integers(0, 1000))
def test_no_motion_within_five_centimetres(scene, hand, face, lost, seed):
    """Hand and face follow any goals as fast as they may, in approach and in abort."""
    rules, step, n = Rules(), 0.02, 900
    hands, faces = (np.repeat(np.array(g), n // len(g) + 1, axis=0)[:n] for g in (hand, face))
    track = Track(step, limited(scene.hand.position + hands, scene.hand.position, rules.speed * step),
                  limited(scene.face.position + 0.3 * faces, scene.face.position, rules.speed * step), 1.0)  # fmt: skip
    timing = replace(Timing(), replans=1, limits=(("perceive", 1.0), ("infer", 1.0), ("plan", 0.6), ("grasp", 1.0),
                     ("approach", 2.5), ("hold", 1.5), ("release", 1.0), ("abort", 3.0)))  # fmt: skip
    case = Case("ball", seed=seed)
    run, _ = simulate(case, track, eyes=Eyes(lost=lost), timing=timing)
    found = judge(case, run, track, timing=timing)
    assert found.violations == 0
    assert found.nearest >= 0.05
    assert not found.late


def test_a_lunge_towards_the_robot_stops_it(scene):
    """The robot aborts and goes back while the hand comes after it; the abort keeps the distance too."""
    goals = np.tile(scene.hand.position, (900, 1))
    goals[60:] = scene.base.position + np.array([0, 0, scene.hand.position[2]])
    track = Track(0.02, limited(goals, scene.hand.position, 0.01), np.tile(scene.face.position, (900, 1)), 1e6)
    run, _ = simulate(Case("ball"), track)
    assert run.end == "aborted"
    assert {"approach", "abort"} <= {m.state for m in run.moments}
    assert judge(Case("ball"), run, track).violations == 0


def test_blind_from_the_start_is_an_abort():
    run, _ = simulate(Case("ball"), eyes=Eyes(lost=1.0, blind=100.0))
    assert (run.end, run.cause) == ("aborted", "time limit of perceive")


def test_a_guard_that_looks_away_is_found_out(scene):
    """The judge sees what the guard prevents: without it the robot moves beside a hand that came to its gripper."""
    hands = np.tile(scene.hand.position, (900, 1))
    hands[25:] = transform_points(scene.base, joint_origins(scene.robot.chain, scene.robot.home))[-1]
    track = Track(0.02, hands, np.tile(scene.face.position, (900, 1)), 1e6)
    careless = replace(Rules(), speed=-5.0, stale=10.0)
    run, _ = simulate(Case("ball"), track, rules=careless, timing=replace(Timing(), moved=9.0))
    assert judge(Case("ball"), run, track).violations > 5
    leap = judge(Case("ball"), *simulate(Case("ball"), track))
    assert leap.violations <= 1, "the step of the leap itself, faster than the rules allow for"


def test_same_seed_same_run():
    first, second = (simulate(Case("ball", script="nervous", seed=5))[0] for _ in range(2))
    assert first.time == second.time
    assert np.array_equal(first.moments[-1].q, second.moments[-1].q)


def test_many_cases_are_counted():
    outcomes = run_cases(random_cases(2, seed=2, robots=("pr2",)), workers=1)
    assert "2 simulated executions" in summary(outcomes)
    assert all(o.violations == 0 for o in outcomes)


def test_log_there_and_back(tmp_path):
    run, _ = simulate(Case("ball"))
    for name in ("run.jsonl", "run.parquet"):
        write_log(run, tmp_path / name)
        lines = read_log(tmp_path / name)
        assert (lines[-1]["end"], lines[-1]["replans"]) == (run.end, run.replans)
        assert [line["state"] for line in lines[:-1]] == [m.state for m in run.moments]
        assert np.allclose([line["q_rad"] for line in lines[:-1]], [m.q for m in run.moments], atol=1e-5)
        with pytest.raises(ml.MlnError, match="cannot"):
            write_log(run, tmp_path / "nowhere" / name)
    for name in ("none.jsonl", "none.parquet"):
        with pytest.raises(ml.MlnError, match="cannot"):
            read_log(tmp_path / name)


@pytest.mark.skipif(browser.CHROMIUM is None, reason="needs a Chromium")
def test_a_browser_plays_the_replay(tmp_path):
    """The page needs no server: opened as a file it shows the scene, and the scene moves."""
    from PIL import Image

    case = Case("ball")
    run, _ = simulate(case)
    record(scene_at(case, None), run, tmp_path / "run.html")

    def pixels(send):
        picture = Image.open(io.BytesIO(browser.picture(send))).convert("RGB")
        return np.asarray(picture).astype(int)

    with browser.page(f"file://{tmp_path}/run.html", port=9334) as send:
        browser.wait(lambda: len(np.unique(pixels(send)[:, :900].reshape(-1, 3), axis=0)) > 300, 60)
        first = pixels(send)
        assert browser.wait(lambda: (np.abs(pixels(send) - first).max(axis=2) > 60).sum() > 200, 30)


def test_a_recording_for_the_viewer(tmp_path):
    run, _ = simulate(Case("ball"), eyes=Eyes(lost=1.0, blind=100.0))
    record(scene_at(Case("ball"), None), run, tmp_path / "run.viser")
    assert (tmp_path / "run.viser").stat().st_size > 1000
    with pytest.raises(ml.MlnError, match="kind of recording"):
        record(scene_at(Case("ball"), None), run, tmp_path / "run.gif")


def test_recorded_tracks(tmp_path):
    path = tmp_path / "t.json"
    path.write_text(json.dumps({"step_s": 0.1, "hand_m": [[0, 0, 0], [1, 0, 0]], "face_m": [[0, 0, 1]] * 2}))
    track = read_track(path)
    assert at(track.hand, track.step, 0.05).tolist() == [0.5, 0, 0]
    errors = [
        np.linalg.norm(s.hand - h)
        for s, h in zip(seen(track, Eyes(lost=0), np.random.default_rng(0)), track.hand, strict=True)
    ]
    assert max(errors) <= Eyes().noise + 1e-12
    path.write_text("{}")
    with pytest.raises(ml.MlnError, match="step_s"):
        read_track(path)


def test_command(tmp_path):
    log = tmp_path / "run.jsonl"
    found = CliRunner().invoke(
        command, ["handover", "execute", "--object", "ball", "--script", "still", "--log", str(log)]
    )
    assert found.exit_code == 0, found.output
    assert "0 violations" in found.output
    assert log.exists()
