"""What would take too much is refused before it starts, and the culprit is named."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

import mlnlite as ml
from mlnlite.ground.forecast import Limits, machine_limits

TEXT = "S(p, p)\nT(p)\np = {%s}\n0.5 T(x)\n1 S(x, y) ^ S(y, z) => S(x, z)\n"


def model_of(n):
    return ml.model_from_text(TEXT % ", ".join(f"P{i}" for i in range(n)))


@pytest.mark.parametrize("limits", [Limits(groundings=10_000), Limits(memory=1_000_000)])
def test_limits_name_the_formula_and_what_helps(limits):
    model = model_of(40)
    with pytest.raises(ml.LimitReached, match=r"(?s)formula 2 needs .*x, y, z range over 40 constants of p") as error:
        ml.ground(model, ml.no_evidence(model), limits=limits)
    assert error.value.diagnostics[0].code == "E410"
    assert error.value.diagnostics[0].span.place.endswith(":5:1")


def test_what_fits_is_ground():
    model = model_of(10)
    network = ml.ground(model, ml.no_evidence(model), limits=Limits(groundings=10_000, memory=500 * 10**6))
    assert network.n_open.sum() == 820


def test_what_no_machine_holds_is_refused_without_being_asked():
    model = model_of(3000)
    assert machine_limits().memory is None or machine_limits().memory > 0
    with pytest.raises(ml.LimitReached, match="formula 2 needs"):
        ml.ground(model, ml.no_evidence(model))


HUB = "*E(a, a)\nG(a, a, a)\n1 E(x, y) ^ E(y, z) => G(x, y, z)\n"
"""Estimates take links to be spread evenly; here all go through one constant, and the join is 750 times as large."""


@pytest.fixture
def hub(tmp_path):
    (tmp_path / "spilled").mkdir()
    (tmp_path / "hub.mln").write_text(HUB)
    (tmp_path / "hub.db").write_text("".join(f"E(A{i}, H)\nE(H, A{i})\n" for i in range(3000)))
    (tmp_path / "all.mln").write_text(TEXT % ", ".join(f"P{i}" for i in range(3000)))
    return tmp_path


def command(folder, *arguments):
    """A command whose temporary files go to a folder of their own."""
    full = [sys.executable, "-m", "mlnlite", *arguments]
    environment = {**os.environ, "TMPDIR": str(folder / "spilled")}
    return subprocess.Popen(
        full, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.mark.parametrize(
    ("arguments", "culprit"),
    [
        ("ground all.mln --max-memory 100MB", "all.mln:5:1: error [E410]: formula 2 needs about"),
        ("query all.mln -q T --max-memory 100MB", "all.mln:5:1: error [E410]: formula 2 needs about"),
        ("ground hub.mln -e hub.db --max-memory 60MB", "hub.mln:3:1: error [E402]: formula 1 cannot be grounded"),
        ("ground hub.mln -e hub.db --max-groundings 99999", "hub.mln:3:1: error [E402]: formula 1 cannot be grounded"),
        (
            "query hub.mln -e hub.db -q G(A1,H,A2) --method exact --max-memory 60MB",
            "hub.mln:3:1: error [E402]: formula 1 cannot be",
        ),
        ("query hub.mln -e hub.db --task map --max-groundings 99999", "hub.mln:3:1: error [E402]: formula 1 cannot"),
        ("query hub.mln -e hub.db --task map --k 2 --max-memory 60MB", "hub.mln:3:1: error [E402]: formula 1 cannot"),
    ],
)
def test_low_limits_end_in_a_message_that_names_the_culprit(hub, arguments, culprit):
    with command(hub, *arguments.split()) as process:
        stdout, stderr = process.communicate(timeout=60)
        assert (process.returncode, stdout) == (1, "")
        assert stderr.startswith(culprit)
        assert "range over" in stderr
        assert "Traceback" not in stderr
    assert list((hub / "spilled").iterdir()) == []


MEASURED = """import resource, subprocess, sys
code = subprocess.run([sys.executable, "-m", "mlnlite", *sys.argv[1:]], capture_output=True).returncode
print(code, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)
"""
"""Memory is measured by a small process: a child starts with that of its parent, which here may have run many tests."""


def test_memory_stays_near_the_limit(hub):
    full = [sys.executable, "-c", MEASURED, "ground", "hub.mln", "-e", "hub.db", "--max-memory", "60MB"]
    done = subprocess.run(full, cwd=hub, capture_output=True, text=True, timeout=60)
    code, used = map(int, done.stdout.split())
    assert code == 1
    assert used < 400 * 10**6  # the join has a gigabyte


@pytest.mark.parametrize(
    ("arguments", "sent", "code", "said"),
    [
        (["ground", "--engine", "duckdb"], signal.SIGINT, 130, "interrupted\n"),
        (["ground", "--engine", "duckdb"], signal.SIGTERM, 143, "terminated\n"),
        (
            ["query", "-q", "G(A1,H,A2)", "--method", "exact", "--max-memory", "8GB"],
            signal.SIGTERM,
            143,
            "terminated\n",
        ),
    ],
)
def test_an_ended_join_leaves_no_files(hub, arguments, sent, code, said):
    with command(hub, arguments[0], "hub.mln", "-e", "hub.db", *arguments[1:]) as process:
        while not list((hub / "spilled").iterdir()) and process.poll() is None:
            time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(sent)
        _, stderr = process.communicate(timeout=60)
        assert (process.returncode, stderr) == (code, said)
    assert list((hub / "spilled").iterdir()) == []
