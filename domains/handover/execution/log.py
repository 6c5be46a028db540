"""Logs of runs: `Run` in, JSON lines or Parquet out; and back."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import mlnlite as ml
from mlnlite.domains.handover.execution.machine import Moment, Run
from mlnlite.domains.handover.parquet import read_parquet, write_parquet


def write_log(run: Run, path: str | Path) -> None:
    """One row for each step: time, state, joints, what was seen, clearance, event; then one for the end.

    Args:
        run: what happened.
        path: of the file; Parquet if it ends in `.parquet`, else JSON lines.

    Raises:
        MlnError: the file cannot be written.
    """
    if Path(path).suffix == ".parquet":
        write_parquet(_rows(run), path)
        return
    try:
        Path(path).write_text("".join(json.dumps(row) + "\n" for row in _rows(run)), encoding="utf-8")
    except OSError as reason:
        raise ml.MlnError(f"cannot write the log {path}: {reason}", hint="give a file in a folder") from None


def _rows(run: Run) -> Iterator[dict[str, Any]]:
    yield from map(_row, run.moments)
    yield {"t_s": round(run.time, 4), "end": run.end, "cause": run.cause, "replans": run.replans}


def _row(moment: Moment) -> dict[str, Any]:
    sight = moment.sight
    return {
        "t_s": round(moment.time, 4), "state": moment.state, "q_rad": np.round(moment.q, 5).tolist(),
        "hand_m": None if sight is None else np.round(sight.hand, 4).tolist(),
        "face_m": None if sight is None else np.round(sight.face, 4).tolist(),
        "clearance_m": None if np.isnan(moment.clearance) else round(moment.clearance, 4), "event": moment.event,
    }  # fmt: skip


def read_log(path: str | Path) -> list[Mapping[str, Any]]:
    """The rows of a log.

    Raises:
        MlnError: no such file, or a line is not JSON; with the line.
    """
    if Path(path).suffix == ".parquet":
        return list(read_parquet(path))
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
