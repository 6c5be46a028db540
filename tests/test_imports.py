"""`mlnlite --help` starts fast: nothing heavy is imported before a command needs it."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HEAVY = {"numpy", "scipy", "duckdb", "lark", "numba", "networkx", "highspy", "pysat", "pytoulbar2", "rich", "pandas"}


def imported(*arguments):
    command = [sys.executable, "-X", "importtime", *arguments]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = (line for line in result.stderr.splitlines() if line.startswith("import time:"))
    return {line.rpartition("|")[2].strip().partition(".")[0] for line in lines}


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["query", "--help"], ["learn", "--help"]])
def test_help_loads_nothing_heavy(arguments):
    assert imported("-m", "mlnlite", *arguments) & HEAVY == set()


def test_the_package_loads_nothing_heavy():
    assert imported("-c", "import mlnlite; mlnlite.MlnError") & HEAVY == set()


def test_every_package_is_in_the_wheel():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    folders = [p.parent for top in ("mlnlite", "domains", "grammars") for p in (ROOT / top).rglob("__init__.py")]
    names = (".".join(folder.relative_to(ROOT).parts) for folder in folders)
    packages = {name if name.startswith("mlnlite") else f"mlnlite.{name}" for name in names}
    assert sorted(packages) == sorted(project["tool"]["setuptools"]["packages"])
