"""Solvers in processes of their own: a problem goes in as a line of JSON, an answer comes back as one.

Some solvers hold the interpreter lock, keep options in globals or cannot be stopped; a process can always be ended.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Timer
from typing import Any, TypeAlias

_GRACE = 5.0

Ask: TypeAlias = Callable[[str, dict[str, Any], float], dict[str, Any] | None]
"""Asks a worker, by the name of its file: a problem and how many seconds it may take. None if it had to be ended."""


@contextmanager
def workers() -> Iterator[Ask]:
    """Workers that start when they are first asked and are ended with the block."""
    running: dict[str, subprocess.Popen[str]] = {}

    def ask(name: str, problem: dict[str, Any], seconds: float) -> dict[str, Any] | None:
        process = running.get(name)
        if process is None or process.poll() is not None:
            _end(process)
            process = running[name] = _started(name)
        return _asked(process, problem, seconds)

    try:
        yield ask
    finally:
        for process in running.values():
            _end(process)


def _end(process: subprocess.Popen[str] | None) -> None:
    """Ends a worker, and forgets what was still on its way to it."""
    if process is None:
        return
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        assert pipe is not None
        with suppress(BrokenPipeError):
            pipe.close()


def _started(name: str) -> subprocess.Popen[str]:
    """A running worker."""
    command = [sys.executable, "-P", str(Path(__file__).with_name(f"{name}.py"))]
    pipe, environment = subprocess.PIPE, {**os.environ, "PYTHONHASHSEED": "0"}
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True, env=environment)


def _asked(process: subprocess.Popen[str], problem: dict[str, Any], seconds: float) -> dict[str, Any] | None:
    """The answer to a problem; the worker is ended if it takes much longer than it may."""
    assert process.stdin is not None
    assert process.stdout is not None
    timer = Timer(min(seconds, 1e6) + _GRACE, process.kill)
    timer.start()
    try:
        process.stdin.write(json.dumps(problem) + "\n")
        process.stdin.flush()
        line = process.stdout.readline()
    except BrokenPipeError:
        line = ""
    finally:
        timer.cancel()
    answer: dict[str, Any] | None = json.loads(line) if line else None
    return answer
