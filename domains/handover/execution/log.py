"""Logs of runs: `Run` in, JSON lines out; and back for replay."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import mlnlite as ml
from mlnlite.domains.handover.execution.machine import Run


def write_log(run: Run, path: str | Path) -> None:
    """One JSON object for each step: time, state, joints, what was seen, clearance, event; then one for the end."""
    with Path(path).open("w", encoding="utf-8") as file:
        for m in run.moments:
            seen = None if m.sight is None else np.round(m.sight.hand, 4).tolist()
            face = None if m.sight is None else np.round(m.sight.face, 4).tolist()
            line = {"t_s": round(m.time, 4), "state": m.state, "q_rad": np.round(m.q, 5).tolist(), "hand_m": seen,
                    "face_m": face, "clearance_m": None if np.isnan(m.clearance) else round(m.clearance, 4),
                    "event": m.event}  # fmt: skip
            file.write(json.dumps(line) + "\n")
        file.write(json.dumps({"end": run.end, "cause": run.cause, "t_s": run.time, "replans": run.replans}) + "\n")


def read_log(path: str | Path) -> list[Mapping[str, Any]]:
    """The lines of a log.

    Raises:
        MlnError: no such file, or a line is not JSON; with the line.
    """
    lines: list[Mapping[str, Any]] = []
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as reason:
        raise ml.MlnError(f"cannot read the log {path}: {reason}", hint="`execute --log` writes one") from None
    for number, line in enumerate(text.splitlines(), 1):
        try:
            lines.append(json.loads(line))
        except ValueError as reason:
            raise ml.MlnError(f"{path}:{number}: not JSON: {reason}", hint="`execute --log` writes one") from None
    return lines
