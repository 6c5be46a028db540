"""How long the commands take, start-up included, on the authors' data and on small models; memory of the largest.

Run with `make benchmark`. The real data are read from `../shared/data`, next to the repository.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

DATA = Path(__file__).parents[1] / ".." / "shared" / "data"
EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"
HANDOVER, GRASP, SMOKERS = DATA / "handover", DATA / "grasp_affordance", DATA / "pracmln" / "smokers"
RC1000, VOTING = DATA / "mln" / "rc1000", DATA / "mln" / "voting"
CUP = "hasShape(x,cylinder)\nisA(x,crockery)\nhasAffordance(x,to_pour)\nhandover(midway)\narmMobility(level_1)\n"

CASES = {
    "help": ["--help"],
    "demo learn": ["learn", EXAMPLES / "handover.mln", EXAMPLES / "handover.db", "-o", "out.mln"],
    "handover check": ["check", HANDOVER / "formulas.mln", "-e", HANDOVER / "dataset.db"],
    "handover learn": ["learn", HANDOVER / "formulas.mln", HANDOVER / "dataset.db", "-o", "out.mln"],
    "handover learn without prior": [
        *("learn", HANDOVER / "formulas.mln", HANDOVER / "dataset.db", "--prior", "none", "-o", "out.mln")
    ],
    "handover marginal": ["query", HANDOVER / "learnt.mln", "-e", "cup.db", "-q", "graspRegion"],
    "handover marginal closed": [
        *("query", HANDOVER / "learnt.mln", "-e", "cup.db", "-q", "graspRegion", "--closed-world", "all")
    ],
    "handover map": ["query", HANDOVER / "learnt.mln", "-e", "cup.db", "-q", "graspRegion", "--task", "map"],
    "grasp_affordance learn": [
        *(
            "learn",
            "-m",
            GRASP / "predicate.txt",
            "-m",
            GRASP / "formula.txt",
            "-d",
            GRASP / "data.txt",
            "-o",
            "out.mln",
        )
    ],
    "smokers learn": ["learn", SMOKERS / "mlns" / "smoking.mln", SMOKERS / "dbs" / "smoking-train.db", "-o", "out.mln"],
    "voting learn": ["learn", VOTING / "voting.mln", VOTING / "voting-train.db", "-o", "out.mln"],
    "rc1000 map": ["query", RC1000 / "prog-fixed.mln", "-e", RC1000 / "evidence.db", "-q", "category", "--task", "map"],
}


@pytest.mark.parametrize("name", CASES)
def test_command(name, benchmark, tmp_path):
    if any(isinstance(a, Path) and not a.exists() for a in CASES[name]):
        pytest.skip("the real data are not here")
    (tmp_path / "cup.db").write_text(CUP)
    command = [sys.executable, "-m", "mlnlite", *(str(a.resolve()) if isinstance(a, Path) else a for a in CASES[name])]
    peaks, cpu = [], []

    def run():
        process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0
        peaks.append(usage.ru_maxrss / 1024)
        cpu.append(usage.ru_utime + usage.ru_stime)

    benchmark.pedantic(run, rounds=5, warmup_rounds=1)
    benchmark.extra_info |= {"peak MB": round(max(peaks)), "CPU s": round(min(cpu), 2)}
    assert max(peaks) < 1024
