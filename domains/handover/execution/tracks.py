"""Moving hands and faces: scripts or recordings in, tracks out; and what noisy eyes see of them.

Seeing errs by at most `noise` [m] in any direction and is lost now and then; both are seeded.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

import mlnlite as ml
from mlnlite.domains.handover.execution.sockets import Sight
from mlnlite.domains.handover.kinematics.pose import FloatArray, locked

Script = Literal["still", "drift", "nervous", "lunge", "withdraw"]
SCRIPTS: tuple[Script, ...] = ("still", "drift", "nervous", "lunge", "withdraw")
"""At rest; slowly elsewhere; about a place; at the robot; away for good."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Where hand and face are, at equal steps of time; the last place holds on.

    Attributes:
        step: between places [s].
        hand: shape (n, 3) [m].
        face: shape (n, 3) [m].
        patience: how long after an offer the person takes the object [s]; infinite for never.
    """

    step: float
    hand: FloatArray
    face: FloatArray
    patience: float = 1.0


@dataclass(frozen=True, slots=True)
class Eyes:
    """How well is seen.

    Attributes:
        noise: largest error of a place [m].
        lost: probability that a loss of sight begins at a step.
        blind: mean length of a loss [s].
    """

    noise: float = 0.005
    lost: float = 0.01
    blind: float = 0.15


def scripted(
    script: Script, hand: FloatArray, face: FloatArray, rng: np.random.Generator, *, seconds: float = 30.0,
    step: float = 0.02, speed: float = 0.5,
) -> Track:  # fmt: skip
    """A track of a script, the hand at most as fast as `speed` [m/s].

    Args:
        script: one of `SCRIPTS`.
        hand: where the palm starts, shape (3,) [m].
        face: where the face starts, shape (3,) [m].
        rng: of what is random.
        seconds: length [s].
        step: between places [s].
        speed: largest of hand and face [m/s].
    """
    n = int(seconds / step)
    goals = np.tile(hand, (n, 1))
    if script == "drift":
        share = np.minimum(step * np.arange(n) / 6.0, 1.0)[:, None]
        goals = hand + share * rng.uniform(-0.15, 0.15, 3)
    elif script == "nervous":
        phase, rate = rng.uniform(0, 6.3, 3), rng.uniform(0.5, 3.0, 3)
        goals = hand + 0.05 * np.sin(rate * step * np.arange(n)[:, None] + phase)
    elif script == "lunge":
        begin = int(rng.uniform(0.3, 4.0) / step)
        goals[begin : begin + int(rng.uniform(0.5, 3.0) / step)] = hand + np.array(
            [rng.uniform(0.2, 0.5), *rng.uniform(-0.1, 0.1, 2)]
        )
    elif script == "withdraw":
        goals[int(rng.uniform(0.3, 5.0) / step) :] = hand + np.array([-0.2, -0.2, -0.3])
    face_goals = face + 0.02 * np.sin(0.7 * step * np.arange(n)[:, None] + rng.uniform(0, 6.3, 3))
    patience = float("inf") if script == "withdraw" else float(rng.uniform(0.3, 2.0))
    return Track(step, limited(goals, hand, speed * step), limited(face_goals, face, speed * step), patience)


def limited(goals: FloatArray, start: FloatArray, largest: float) -> FloatArray:
    """Places that follow goals, shape (n, 3) [m], from `start` with steps of at most `largest` [m]."""
    out, here = np.empty_like(goals), np.asarray(start, dtype=np.float64)
    for i, goal in enumerate(goals):
        away = goal - here
        length = float(np.linalg.norm(away))
        here = here + away * min(1.0, largest / length) if length > 0 else here
        out[i] = here
    return locked(out)


def read_track(path: str | Path) -> Track:
    """A recorded track: JSON with `step_s`, `hand_m`, `face_m` and, if you like, `patience_s`.

    Raises:
        MlnError: no such file, or not such a file.
    """
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
        track = Track(float(data["step_s"]), locked(data["hand_m"]), locked(data["face_m"]),
                      float(data.get("patience_s", 1.0)))  # fmt: skip
    except (OSError, ValueError, KeyError, TypeError) as reason:
        hint = "write step_s, hand_m and face_m as lists of x, y, z [m]"
        raise ml.MlnError(f"cannot read the track {path}: {reason}", hint=hint) from None
    if track.step <= 0 or track.hand.ndim != 2 or track.hand.shape[1:] != (3,) or track.face.shape != track.hand.shape:
        raise ml.MlnError(f"{path}: hand_m and face_m must be equally long lists of x, y, z", hint="in metres")
    return track


def at(places: FloatArray, step: float, time: float) -> FloatArray:
    """The place of a track at a time [s], linear between its steps."""
    x = min(max(time / step, 0.0), len(places) - 1.0)
    i = min(int(x), len(places) - 2) if len(places) > 1 else 0
    if len(places) == 1:
        only: FloatArray = places[0]
        return only
    out: FloatArray = places[i] + (x - i) * (places[i + 1] - places[i])
    return out


def seen(track: Track, eyes: Eyes, rng: np.random.Generator) -> Sequence[Sight | None]:
    """What eyes see at each step of a track."""
    out: list[Sight | None] = []
    blind = 0
    for i in range(len(track.hand)):
        if blind == 0 and rng.random() < eyes.lost:
            blind = 1 + int(rng.exponential(eyes.blind) / track.step)
        if blind:
            blind -= 1
            out.append(None)
            continue
        hand, face = (place + _ball(rng, eyes.noise) for place in (track.hand[i], track.face[i]))
        out.append(Sight(i * track.step, hand, face))
    return out


def _ball(rng: np.random.Generator, radius: float) -> FloatArray:
    """A point in a ball."""
    direction = rng.normal(size=3)
    out: FloatArray = direction / np.linalg.norm(direction) * radius * rng.random() ** (1 / 3)
    return out
