"""Ctrl-C: a command answers with what it has so far, and says that it was interrupted; SIGTERM ends it at once."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals of Unix")


def grid(n):
    """A model too wide for tables and too rugged for a quick proof."""
    rng = np.random.default_rng(0)
    pairs = {tuple(sorted(p)) for p in rng.integers(0, n, (6 * n, 2)).tolist() if p[0] != p[1]}
    lines = [f"{rng.normal():.3f} S(A{a}) v S(A{b})\n{rng.normal():.3f} !S(A{a}) v S(A{b})" for a, b in sorted(pairs)]
    return "S(p)\n" + "\n".join(lines) + "\n"


def interrupted(tmp_path, n, options):
    """What a command says that is interrupted, later if it had not begun to search."""
    (tmp_path / "grid.mln").write_text(grid(n))
    (tmp_path / "few.db").write_text("S(A0)\n")
    command = [sys.executable, "-m", "mlnlite", "query", "grid.mln", "-e", "few.db", "-q", "S", "--format", "json"]
    for seconds in (5, 15, 45):
        process = subprocess.Popen([*command, *options], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        time.sleep(seconds)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        if process.returncode not in (130, -signal.SIGINT):  # the latter where Python is just making a dataclass
            assert process.returncode == 0, err
            return json.loads(out)
    return {"status": "never got to it"}


def test_sampling(tmp_path):
    found = interrupted(tmp_path, 150, ["--method", "gibbs", "--precision", "0.00001", "--time-limit", "100"])
    assert "interrupted" in found["status"]
    assert len(found["marginals"]) > 140
    open_ = [row for row in found["marginals"] if not row["exact"]]
    assert len(open_) > 140
    assert all(0 <= row["probability"] <= 1 and row["error"] > 0 for row in open_)


def test_search(tmp_path):
    found = interrupted(tmp_path, 1000, ["--task", "map", "--time-limit", "100"])
    assert found["status"] == "feasible"
    assert len(found["state"]) > 900
    assert found["bound"] >= found["log_weight"]


@pytest.mark.parametrize("options", [["--method", "gibbs", "--precision", "0.00001"], ["--task", "map"]])
def test_sigterm_ends_a_search(tmp_path, options):
    (tmp_path / "grid.mln").write_text(grid(400))
    command = [sys.executable, "-m", "mlnlite", "query", "grid.mln", "-q", "S", "--time-limit", "100", *options]
    for seconds in (4, 15, 45):
        process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        time.sleep(seconds)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=30)
        if process.returncode > 0:  # below 0 it is before the command begins, or while Python loads modules
            break
    assert (process.returncode, out) == (143, "")
    assert err.endswith("terminated\n")
    assert "Traceback" not in err
