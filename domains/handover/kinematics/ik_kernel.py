"""Damped least squares on a joint table, compiled. In: table, target, starts, settings. Out: configuration and counts.

The plain-Python twin is in `tests/handover/ik_twin.py`. Only arithmetic, no clock, no chance: equal inputs give equal
bits.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mlnlite.domains.handover.compiled import kernel
from mlnlite.domains.handover.kinematics.pose import FloatArray


@kernel
def forward(table: FloatArray, q: FloatArray, frames: FloatArray) -> None:
    """Writes the joint frames after their motion to `frames[:n]` and the tool's to `frames[n]`, each 3x4 [m]."""
    n = len(q)
    r, p, m = np.eye(3), np.zeros(3), np.empty((3, 3))
    for i in range(n + 1):
        row = table[i]
        for a in range(3):
            p[a] += r[a, 0] * row[3] + r[a, 1] * row[7] + r[a, 2] * row[11]
        for a in range(3):
            for b in range(3):
                m[a, b] = r[a, 0] * row[b] + r[a, 1] * row[4 + b] + r[a, 2] * row[8 + b]
        if i == n:
            r[:, :] = m
        elif row[19] > 0.5:
            r[:, :] = m
            for a in range(3):
                p[a] += q[i] * (m[a, 0] * row[16] + m[a, 1] * row[17] + m[a, 2] * row[18])
        else:
            s, c = np.sin(q[i]), np.cos(q[i])
            x, y, z, k = row[16], row[17], row[18], 1.0 - c
            e00, e01, e02 = c + x * x * k, x * y * k - z * s, x * z * k + y * s
            e10, e11, e12 = x * y * k + z * s, c + y * y * k, y * z * k - x * s
            e20, e21, e22 = x * z * k - y * s, y * z * k + x * s, c + z * z * k
            for a in range(3):
                r[a, 0] = m[a, 0] * e00 + m[a, 1] * e10 + m[a, 2] * e20
                r[a, 1] = m[a, 0] * e01 + m[a, 1] * e11 + m[a, 2] * e21
                r[a, 2] = m[a, 0] * e02 + m[a, 1] * e12 + m[a, 2] * e22
        frames[i, :, :3] = r
        frames[i, :, 3] = p


@kernel
def pose_error(now: FloatArray, target: FloatArray, error: FloatArray) -> tuple[float, float]:
    """Writes position error [m] and rotation vector [rad] from `now` to `target`; returns their norms."""
    e = np.empty((3, 3))
    for a in range(3):
        error[a] = target[a, 3] - now[a, 3]
        for b in range(3):
            e[a, b] = target[a, 0] * now[b, 0] + target[a, 1] * now[b, 1] + target[a, 2] * now[b, 2]
    vx, vy, vz = e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1]
    sine = 0.5 * np.sqrt(vx * vx + vy * vy + vz * vz)
    angle = np.arctan2(sine, 0.5 * (e[0, 0] + e[1, 1] + e[2, 2] - 1.0))
    scale = 0.5 if sine < 1e-9 else 0.5 * angle / sine
    error[3], error[4], error[5] = scale * vx, scale * vy, scale * vz
    return np.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2), angle


@kernel
def jacobian(table: FloatArray, frames: FloatArray, weight: float, out: FloatArray) -> None:
    """Writes the Jacobian of the tool (6 x n): linear rows [m], angular rows times `weight` [m/rad]."""
    n = out.shape[1]
    tip = frames[n, :, 3]
    for i in range(n):
        f, row = frames[i], table[i]
        ax = f[0, 0] * row[16] + f[0, 1] * row[17] + f[0, 2] * row[18]
        ay = f[1, 0] * row[16] + f[1, 1] * row[17] + f[1, 2] * row[18]
        az = f[2, 0] * row[16] + f[2, 1] * row[17] + f[2, 2] * row[18]
        if row[19] > 0.5:
            out[0, i], out[1, i], out[2, i], out[3, i], out[4, i], out[5, i] = ax, ay, az, 0.0, 0.0, 0.0
            continue
        dx, dy, dz = tip[0] - f[0, 3], tip[1] - f[1, 3], tip[2] - f[2, 3]
        out[0, i], out[1, i], out[2, i] = ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx
        out[3, i], out[4, i], out[5, i] = weight * ax, weight * ay, weight * az


@kernel
def damped_step(j: FloatArray, error: FloatArray, damping: float, step: FloatArray) -> None:
    """Writes `J^T (J J^T + damping I)^-1 error` by Cholesky factors of the 6x6 matrix."""
    factor, y = np.zeros((6, 6)), np.zeros(6)
    for a in range(6):
        for b in range(a + 1):
            total = damping if a == b else 0.0
            for i in range(j.shape[1]):
                total += j[a, i] * j[b, i]
            for k in range(b):
                total -= factor[a, k] * factor[b, k]
            factor[a, b] = np.sqrt(total) if a == b else total / factor[b, b]
    for a in range(6):
        total = error[a]
        for k in range(a):
            total -= factor[a, k] * y[k]
        y[a] = total / factor[a, a]
    for a in range(5, -1, -1):
        total = y[a]
        for k in range(a + 1, 6):
            total -= factor[k, a] * y[k]
        y[a] = total / factor[a, a]
    for i in range(j.shape[1]):
        total = 0.0
        for a in range(6):
            total += j[a, i] * y[a]
        step[i] = total


@kernel
def solve(table: FloatArray, target: FloatArray, starts: FloatArray, settings: FloatArray) -> tuple[Any, int, int]:
    """First start that ends within the tolerances, in order.

    Args:
        table: joints, shape (n + 1, 22).
        target: pose of the tool in the base, shape (3, 4) or (4, 4) [m].
        starts: shape (s, n) [rad] or [m].
        settings: steps per start, tolerances [m] and [rad], weight of rotation [m/rad], longest joint step [rad].

    Returns:
        Configuration (n,), index of the start that led to it or -1, steps spent.
    """
    n = starts.shape[1]
    frames, j, step, error = np.empty((n + 1, 3, 4)), np.empty((6, n)), np.empty(n), np.empty(6)
    weight, longest, spent = settings[3], settings[4], 0
    q = np.empty(n)
    for s in range(starts.shape[0]):
        q[:] = starts[s]
        for _ in range(int(settings[0])):
            forward(table, q, frames)
            far, turned = pose_error(frames[n], target, error)
            if far <= settings[1] and (turned <= settings[2] or weight == 0.0):
                return q, s, spent
            error[3:] *= weight
            size = far * far + (weight * turned) ** 2
            jacobian(table, frames, weight, j)
            damped_step(j, error, 1e-5 + 0.05 * size, step)
            scale = min(1.0, longest / max(1e-12, np.abs(step).max()))
            for i in range(n):
                q[i] = min(table[i, 21], max(table[i, 20], q[i] + scale * step[i]))
            spent += 1
    return q, -1, spent
