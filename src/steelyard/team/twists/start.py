"""First grasps from twists, pair by pair in closed form: where the joint fit starts.

Of grasps i and j on one body, w_i = R w_j turns R (Wahba), and v_i - R v_j = -[R w_j] p is linear in p. Where all
rotation is about one axis, or there is none, velocities decide the rest of R, and gravity, where it is measured.
Source: the paper's eq. 3-8.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.spatial import Pose, Rotation, axial_vector
from steelyard.team.poses.start import NOISE_SHARE, ONE_AXIS, TURNS
from steelyard.team.twists.statistic import TwistScatter


def first_grasps(data: TwistScatter, reference: int, names: tuple[str, ...], level: Array | None = None) -> Pose:
    """Return the pose (N,) of every grasp in the reference's from its pair with it, in closed form from the scatter.

    level  (N, 3, 3) as in `fit_twists`

    Raises CannotAnswer where a robot never spoke together with the reference.
    """
    turns, places = [], []
    for i in range(data.count):
        if i == reference:
            turns.append(np.eye(3))
            places.append(np.zeros(3))
            continue
        S = data.pair(reference, i)
        if not S.any():
            raise CannotAnswer(_never_together(data, reference, i, names))
        R, p = _pair(S, np.zeros((3, 3)) if level is None else level[i])
        turns.append(R)
        places.append(p)
    return Pose(Rotation(np.stack(turns)), np.stack(places))


def _never_together(data: TwistScatter, reference: int, i: int, names: tuple[str, ...]) -> str:
    """Say why no row has the twists of two robots."""
    for k in (i, reference):
        if not data.spoke[:, k].any():
            return (
                f"'{names[k]}' gives no twists while others move: give its angular_velocity and linear_velocity (an "
                'accelerometer tells none), or, if its base stands, its poses without base = "moving".'
            )
    return f"robots '{names[reference]}' and '{names[i]}' never measured twists at the same time; record them together."


def _pair(S: Array, level: Array) -> tuple[Array, Array]:
    """Return rotation (3, 3) and position (3,) of the second robot's grasp in the first's from their scatter."""
    w_w, v_v = S[:3, 6:9], S[3:6, 9:12]
    values, axes = np.linalg.eigh(S[:3, :3])
    candidates = [Rotation.aligning(w_w).matrix, Rotation.aligning(v_v).matrix]
    one = values[1] < ONE_AXIS**2 * values[2]
    if level.any() and (one or values[1] < NOISE_SHARE * _turned(S, candidates[0]) / 3):
        return _upright(S, level, candidates, axes[:, 2])
    if one:
        for angle in np.arange(1, TURNS) * (2 * np.pi / TURNS):
            candidates.append(Rotation.exp(angle * axes[:, 2]).matrix @ candidates[0])
    found = [_position(S, R) for R in candidates]
    best = int(np.argmin([cost for _, cost in found]))
    return candidates[best], found[best][0]


def _upright(S: Array, level: Array, candidates: list[Array], axis: Array) -> tuple[Array, Array]:
    """Return rotation and position where turns do not show the rotation, and gravity shows some of it."""
    size, told = float(np.trace(S[:3, :3])), float(np.linalg.svd(level, compute_uv=False).sum())
    turning = S[:3, 6:9] / max(size, 1e-300) + level / told
    moving = S[3:6, 9:12] / max(float(np.trace(S[3:6, 3:6])), 1e-300)
    upright = Rotation.aligning(turning).matrix
    vertical = np.linalg.svd(level)[0][:, 0]
    every = [*candidates, upright, Rotation.aligning(turning + moving).matrix]
    for about in (axis, vertical):
        turns = Rotation.exp(np.arange(1, TURNS)[:, None] * (2 * np.pi / TURNS) * about).matrix
        every += list(turns @ upright)
    found = [_position(S, R) for R in every]
    tilted = [2 * (1 - float((R * level).sum()) / told) for R in every]
    best = int(np.argmin([cost + tilt for (_, cost), tilt in zip(found, tilted, strict=True)]))
    return every[best], found[best][0]


def _turned(S: Array, R: Array) -> float:
    """Return what a rotation leaves of the turns."""
    return float(np.trace(S[:3, :3]) + np.trace(S[6:9, 6:9]) - 2 * np.trace(R @ S[6:9, :3]))


def _position(S: Array, R: Array) -> tuple[Array, float]:
    """Return p that makes v_i - R v_j = -[R w_j] p hold best, and what is left with the misfit of the rotation."""
    q_q = R @ S[6:9, 6:9] @ R.T
    # Columns are q = R w_j, rows u = v_i - R v_j.
    u_q = (S[3:6, 6:9] - R @ S[9:12, 6:9]) @ R.T
    u_u = S[3:6, 3:6] - S[3:6, 9:12] @ R.T - R @ S[9:12, 3:6] + R @ S[9:12, 9:12] @ R.T
    A = np.trace(q_q) * np.eye(3) - q_q
    # -sum [q]^T u = sum q x u, entry by entry.
    b = axial_vector(u_q)
    p = np.linalg.solve(A + (1e-3 * np.trace(A) + 1e-300) * np.eye(3) * 1e-3, b)
    left = float(np.trace(u_u) - 2 * p @ b + p @ A @ p)
    turned = _turned(S, R)
    return p, left / max(np.trace(S[3:6, 3:6]), 1e-300) + turned / max(np.trace(S[:3, :3]), 1e-300)
