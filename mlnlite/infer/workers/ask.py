"""Solvers in processes of their own: a problem goes in as a line of JSON, an answer comes back as one.

Some solvers hold the interpreter lock, keep options in globals or cannot be stopped; a process can always be ended.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread
from typing import Any, TypeAlias

from mlnlite.infer.deadline import Deadline

_GRACE, _TICK = 3.0, 0.2

Ask: TypeAlias = Callable[[str, dict[str, Any], Deadline], dict[str, Any] | None]
"""Asks a worker, by the name of its file: a problem, and when to stop. None if it had to be ended."""


@contextmanager
def workers() -> Iterator[Ask]:
    """Workers that start when they are first asked and are ended with the block."""
    running: dict[str, subprocess.Popen[str]] = {}

    def ask(name: str, problem: dict[str, Any], deadline: Deadline) -> dict[str, Any] | None:
        process = running.get(name)
        if process is None or process.poll() is not None:
            _end(process)
            process = running[name] = _started(name)
        return _asked(process, problem, deadline)

    try:
        yield ask
    finally:
        for process in running.values():
            _end(process)


def _end(process: subprocess.Popen[str] | None) -> None:
    """Ends a worker, and forgets what was still on its way to it."""
    if process is None:
        return
    _kill(process)
    process.wait()
    for pipe in (process.stdin, process.stdout):
        assert pipe is not None
        with suppress(BrokenPipeError):
            pipe.close()


def _started(name: str) -> subprocess.Popen[str]:
    """A running worker."""
    command = [sys.executable, "-P", str(Path(__file__).with_name(f"{name}.py"))]
    pipe, environment = subprocess.PIPE, {**os.environ, "PYTHONHASHSEED": "0"}
    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        command, stdin=pipe, stdout=pipe, stderr=quiet, text=True, env=environment, start_new_session=True
    )


def _asked(process: subprocess.Popen[str], problem: dict[str, Any], deadline: Deadline) -> dict[str, Any] | None:
    """The answer to a problem; the worker is ended if it takes much longer than it may."""
    assert process.stdin is not None
    assert process.stdout is not None
    done = Event()
    Thread(target=_watch, args=(process, deadline, done), daemon=True).start()
    try:
        process.stdin.write(json.dumps(problem) + "\n")
        process.stdin.flush()
        line = process.stdout.readline()
    except BrokenPipeError:
        line = ""
    finally:
        done.set()
    answer: dict[str, Any] | None = json.loads(line) if line else None
    return answer


def _watch(process: subprocess.Popen[str], deadline: Deadline, done: Event) -> None:
    """Ends a worker that does not stop by itself."""
    while not done.wait(_TICK):
        if deadline.is_over:
            if not done.wait(_GRACE):
                _kill(process)
            return


def _kill(process: subprocess.Popen[str]) -> None:
    """Kills a worker with its children."""
    if sys.platform == "win32":
        process.kill()
        return
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
