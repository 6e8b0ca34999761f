"""First grasps and homes, pair by pair in closed form: where the joint fit starts.

With the poses of the reference r and of robot i relative to the row m, A(t) = T_r(m)^-1 T_r(t) and B(t) likewise,
A G = G B: rotation vectors turn as alpha = R beta (Wahba), and (R_A - 1) p = R b - a is linear in p. Where all rotation
is about one axis, or there is none, positions decide the rest of R.
Source: AX = XB as in hand-eye calibration; the paper's eq. 3-8 are the same with twists.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.spatial import Pose, Rotation
from steelyard.team.poses import Team, TeamMotion
from steelyard.team.turns import turns_between

# Turns about the one axis of rotation that are tried where it is the only one.
TURNS = 24
# Rotation about a second axis is at least this share of that about the first, or it counts as none.
ONE_AXIS = 0.1
# Fewer common rows than this start nothing.
FEWEST = 8
# [rad] Rotations below this are noise and place nothing.
ROTATION_NOISE = 1e-3
# Evenly spread rows that are enough.
ENOUGH = 300


def first_team(data: TeamMotion, reference: int, names: tuple[str, ...]) -> Team:
    """Return grasps and homes from pairs with the reference; raises CannotAnswer where two have no rows in common."""
    count = data.valid.shape[1]
    grasps, homes = [], []
    for i in range(count):
        if i == reference:
            grasps.append(Pose.identity())
            homes.append(Pose.identity())
            continue
        both = np.flatnonzero(data.valid[:, reference] & data.valid[:, i])
        if len(both) < FEWEST:
            raise CannotAnswer(
                f"robots '{names[reference]}' and '{names[i]}' have {len(both)} rows in common; at least {FEWEST} are "
                "needed to find where one holds the payload from the other. Record them together."
            )
        both = both[:: max(1, len(both) // ENOUGH)]
        T_r, T_i = data.poses[both, reference], data.poses[both, i]
        G = _grasp(T_r, T_i)
        middle = len(both) // 2
        grasps.append(G)
        homes.append(T_r[middle] @ G @ T_i[middle].inverse())
    G, Z = _stack(grasps), _stack(homes)
    return Team(G, Z, data.motion_seen(G, Z), np.zeros(count))


def _stack(poses: list[Pose]) -> Pose:
    matrix = np.stack([p.rotation.matrix for p in poses])
    return Pose(Rotation(matrix), np.stack([p.position for p in poses]))


def _grasp(T_r: Pose, T_i: Pose) -> Pose:
    """Return the grasp of i in that of r that explains their motions best, among a few."""
    middle = len(T_r.position) // 2
    A, B = T_r[middle].inverse() @ T_r, T_i[middle].inverse() @ T_i
    alpha = turns_between(T_r.rotation[middle], T_r.rotation)
    beta = turns_between(T_i.rotation[middle], T_i.rotation)
    a, b = A.position - A.position.mean(0), B.position - B.position.mean(0)
    turning, moving = alpha.T @ beta, a.T @ b
    candidates = [_wahba(turning), _wahba(moving)]
    seen, axes = np.linalg.eigh(alpha.T @ alpha)
    axis = axes[:, 2]
    if seen[1] > ONE_AXIS**2 * seen[2] and seen[1] > len(alpha) * (10 * ROTATION_NOISE) ** 2:
        return Pose(candidates[0], _position(A, B, candidates[0])[0])
    for angle in np.arange(TURNS) * (2 * np.pi / TURNS):
        candidates.append(Rotation.exp(angle * axis) @ candidates[0])
    found = [_position(A, B, R) for R in candidates]
    spread = float(np.linalg.norm(alpha, axis=1).mean()) + 1e-12
    size = float(np.linalg.norm(a, axis=1).mean()) + 1e-12
    cost = [
        left / size**2 + float(((alpha - R.apply(beta)) ** 2).sum()) / spread**2
        for R, (_, left) in zip(candidates, found, strict=True)
    ]
    best = int(np.argmin(cost))
    return Pose(candidates[best], found[best][0])


def _wahba(H: Array) -> Rotation:
    """Return R that minimises sum |alpha - R beta|^2 for H = sum alpha beta^T. Source: the paper, eq. 5."""
    u, _, vt = np.linalg.svd(H)
    u[:, 2] *= np.linalg.det(u @ vt)
    return Rotation(u @ vt)


def _position(A: Pose, B: Pose, R: Rotation) -> tuple[Array, float]:
    """Return the position (3,) by least squares, near zero where no rotation shows it, and the squares left."""
    left = A.rotation.matrix - np.eye(3)
    right = R.apply(B.position) - A.position
    # An offset of the row m itself is noise: means are taken away.
    left, right = left - left.mean(0), right - right.mean(0)
    ridge = len(left) * ROTATION_NOISE**2
    p = np.linalg.solve(np.einsum("tki,tkj->ij", left, left) + ridge * np.eye(3), np.einsum("tki,tk->i", left, right))
    return p, float(((left @ p - right) ** 2).sum() + ridge * (p @ p))
