"""How long it takes to read large evidence: makes files, reads each in a process of its own, prints CPU and memory."""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
from pathlib import Path

MODEL = "Friends(person, person)\\nSmokes(person)\\nName(person, name)"
READER = """
import resource, sys, time
import mlnlite as ml
import mlnlite.model.read
model = ml.model_from_text("{model}")
start = time.process_time()
ml.read_evidence(sys.argv[1], model=model)
usage = resource.getrusage(resource.RUSAGE_SELF)
print(f"{{time.process_time() - start:.2f}} | {{usage.ru_maxrss // 1024:,}}")
"""


def friends(n: int, line: str) -> list[str]:
    chance = random.Random(0)
    return [line.format(i // 10, chance.randrange(max(1, n // 10))) for i in range(n)]


CASES = {
    "`.db`, 1,000,000 plain facts": ("a.db", 10**6, "Friends(P{0}, P{1})"),
    "`.db`, 1,000,000 soft facts": ("a.db", 10**6, "0.7 Friends(P{0}, P{1})"),
    "`.db`, 1,000,000 facts with quotes": ("a.db", 10**6, 'Name(P{0}, "Some body, {1}")'),
    "`.csv`, 1,000,000 rows": ("a.csv", 10**6, "P{0},P{1}"),
    "`.db`, 10,000,000 plain facts": ("a.db", 10**7, "Friends(P{0}, P{1})"),
}


def main() -> None:
    for what, (name, n, line) in CASES.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / name
            path.write_text("from,to\n" * name.endswith(".csv") + "\n".join(friends(n, line)) + "\n")
            given = f"Friends={path}" if name.endswith(".csv") else str(path)
            reader = [sys.executable, "-c", READER.format(model=MODEL), given]
            found = subprocess.run(reader, check=True, capture_output=True, text=True)
            print(f"| {what} | {path.stat().st_size / 1e6:.0f} MB | {found.stdout.strip()} |", flush=True)


if __name__ == "__main__":
    main()
