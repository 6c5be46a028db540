"""The plain twin of the compiled solver: same steps in NumPy."""

from __future__ import annotations

import numpy as np


def joint_frames(table, q):
    pose, frames = np.eye(4), []
    for row, angle in zip(table[:-1], q, strict=True):
        pose = pose @ row[:16].reshape(4, 4)
        motion, (x, y, z) = np.eye(4), row[16:19]
        if row[19]:
            motion[:3, 3] = angle * row[16:19]
        else:
            skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            motion[:3, :3] += np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
        pose = pose @ motion
        frames.append(pose)
    return [*frames, pose @ table[-1, :16].reshape(4, 4)]


def rotation_vector(matrix):
    vector = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    sine = 0.5 * np.linalg.norm(vector)
    angle = np.arctan2(sine, 0.5 * (np.trace(matrix) - 1))
    return (0.5 if sine < 1e-9 else 0.5 * angle / sine) * vector, angle


def jacobian(table, frames):
    columns = []
    for row, frame in zip(table[:-1], frames[:-1], strict=True):
        axis = frame[:3, :3] @ row[16:19]
        arm = np.cross(axis, frames[-1][:3, 3] - frame[:3, 3])
        columns.append(np.hstack([axis, np.zeros(3)]) if row[19] else np.hstack([arm, axis]))
    return np.array(columns).T


def solve(table, target, starts, settings):
    limit, near, turn, weight, longest = settings
    scale = np.array([1, 1, 1, weight, weight, weight])
    for s, start in enumerate(starts):
        q = start.copy()
        for _ in range(int(limit)):
            frames = joint_frames(table, q)
            error, angle = rotation_vector(target[:3, :3] @ frames[-1][:3, :3].T)
            far = np.linalg.norm(target[:3, 3] - frames[-1][:3, 3])
            if far <= near and (angle <= turn or weight == 0):
                return q, s
            full = scale * np.hstack([target[:3, 3] - frames[-1][:3, 3], error])
            j = scale[:, None] * jacobian(table, frames)
            damping = 1e-5 + 0.05 * (far**2 + (weight * angle) ** 2)
            step = j.T @ np.linalg.solve(j @ j.T + damping * np.eye(6), full)
            step *= min(1.0, longest / max(1e-12, np.abs(step).max()))
            q = np.clip(q + step, table[:-1, 20], table[:-1, 21])
    return q, -1
