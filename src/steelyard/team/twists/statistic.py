"""All that twists of N grasps say about where the grasps are: one scatter matrix, whatever the length of the log.

With y (6 N,) the body twists of all grasps at one time, the joint likelihood of the grasps under white noise depends on
sum y y^T alone. Scatters of time windows add; those of different robots do not, since rows mix them. With the twists
goes their rate of change, from which late clocks are found.
First grasps, where the joint fit starts, follow from it pair by pair in closed form. Of grasps i and j on one body,
w_i = R w_j turns R (Wahba), and v_i - R v_j = -[R w_j] p is linear in p. Where all rotation is about one axis, or there
is none, velocities decide the rest of R, and gravity, where it is measured.
Source: own; the paper fits pairs of twists (eq. 1-8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.errors import CannotAnswer
from steelyard.logs.runs import distinct_rows
from steelyard.spatial import Pose, Rotation, axial_vector
from steelyard.team.poses.measured import NOISE_SHARE, ONE_AXIS, TURNS
from steelyard.team.twists.rows import TwistStretch, slope_shares

# Windows that a log is cut into, so that correlated noise is noticed; fewer where their scatters have more numbers.
WINDOWS, FEWEST, NUMBERS = 40, 8, 4e6


@dataclass(frozen=True, eq=False)
class TwistScatter:
    """Scatters of windows and patterns of robots.

    scatter  (B, 12 N, 12 N) of [y, dy/dt], zero for robots that did not speak     rows (B,)
    spoke    (B, N) which robots did     window (B,) number of the window
    """

    scatter: Array
    rows: Array
    spoke: Mask
    window: Integers

    @classmethod
    def of(cls, parts: tuple[TwistStretch, ...]) -> TwistScatter:
        """Return the statistic of recordings in motion; those at rest say nothing of where the grasps are."""
        moving = [part for part in parts if part.rows.kind != "still"] or list(parts)
        total = sum(len(part.rows) for part in moving)
        found: list[tuple[Array, int, Mask, int]] = []
        number, width = 0, 12 * moving[0].twist.shape[1]
        windows = min(WINDOWS, max(FEWEST, NUMBERS / width**2))
        for part in moving:
            pieces = max(1, round(windows * len(part.rows) / total))
            change = rates_of_change(part)
            for rows in np.array_split(np.arange(len(part.rows)), pieces):
                here = slice(int(rows[0]), int(rows[-1]) + 1)
                patterns, which = distinct_rows(part.seen[here])
                for k, spoke in enumerate(patterns):
                    if spoke.sum() < 2:
                        continue
                    chosen = which == k
                    both = [x[here][chosen] * spoke[:, None] for x in (part.twist, change)]
                    y = np.concatenate([x.reshape(len(x), -1) for x in both], axis=1)
                    found.append((y.T @ y, len(y), spoke, number))
                number += 1
        if not found:
            robots = moving[0].twist.shape[1]
            return cls(np.zeros((0, width, width)), np.zeros(0), np.zeros((0, robots), np.bool_), np.zeros(0, np.int64))
        scatter, count, spoke, window = zip(*found, strict=True)
        return cls(np.stack(scatter), np.array(count, float), np.stack(spoke), np.array(window))

    @property
    def count(self) -> int:
        """Number of robots."""
        return int(self.spoke.shape[1])

    def merged(self) -> TwistScatter:
        """Return one scatter per pattern of robots."""
        patterns, which = distinct_rows(self.spoke)
        scatter = np.zeros((len(patterns), *self.scatter.shape[1:]))
        rows = np.zeros(len(patterns))
        for k, S, count in zip(which, self.scatter, self.rows, strict=True):
            scatter[k] += S
            rows[k] += count
        return TwistScatter(scatter, rows, patterns, np.zeros(len(patterns), np.int64))

    def pair(self, i: int, j: int) -> Array:
        """Return the scatter (12, 12) of the twists of two robots over rows in which both spoke."""
        both = self.spoke[:, i] & self.spoke[:, j]
        place = np.concatenate([6 * i + np.arange(6), 6 * j + np.arange(6)])
        out = np.zeros((12, 12))
        for k in np.flatnonzero(both):
            out += self.scatter[k][np.ix_(place, place)]
        return out


def rates_of_change(part: TwistStretch) -> Array:
    """Return the slopes (T, N, 6) of all twists, zero in rows around which one that speaks there is not seen.

    A difference of next rows would be mostly noise: clocks that it is compared with seem too near.
    """
    shares = slope_shares(part.rows.rate)
    half, rows = len(shares), len(part.rows)
    out = np.zeros_like(part.twist)
    if rows <= 2 * half:
        return out
    for k, share in enumerate(shares, start=1):
        before, after = part.twist[half - k : rows - half - k], part.twist[half + k : rows - half + k]
        out[half : rows - half] += share * (after - before)
    whole = np.zeros(part.seen.shape, np.bool_)
    whole[half : rows - half] = np.lib.stride_tricks.sliding_window_view(part.seen, 2 * half + 1, axis=0).all(-1)
    told: Mask = np.asarray((whole | ~part.seen).all(1))
    return out * told[:, None, None]


def first_grasps(data: TwistScatter, reference: int, names: tuple[str, ...], level: Array | None = None) -> Pose:
    """Return the pose (N,) of every grasp in the reference's from its pair with it, in closed form from the scatter.

    level  (N, 3, 3) as in `fit_twists`

    Raises CannotAnswer where a robot never spoke together with the reference.
    """
    grasps = [Pose.identity()] * data.count
    for i in range(data.count):
        if i == reference:
            continue
        S = data.pair(reference, i)
        if not S.any():
            raise CannotAnswer(_never_together(data, reference, i, names))
        grasps[i] = _pair(S, np.zeros((3, 3)) if level is None else level[i])
    return Pose.stacked(grasps)


def _never_together(data: TwistScatter, reference: int, i: int, names: tuple[str, ...]) -> str:
    """Say why no row has the twists of two robots."""
    for k in (i, reference):
        if not data.spoke[:, k].any():
            return (
                f"'{names[k]}' gives no twists while others move: give its angular_velocity and linear_velocity (an "
                'accelerometer tells none), or, if its base stands, its poses without base = "moving".'
            )
    return f"robots '{names[reference]}' and '{names[i]}' never measured twists at the same time; record them together."


def _pair(S: Array, level: Array) -> Pose:
    """Return the second robot's grasp in the first's from their scatter."""
    w_w, v_v = S[:3, 6:9], S[3:6, 9:12]
    values, axes = np.linalg.eigh(S[:3, :3])
    candidates = [Rotation.aligning(w_w).matrix, Rotation.aligning(v_v).matrix]
    one, upright, about, told = values[1] < ONE_AXIS**2 * values[2], candidates[0], list[Array](), 0.0
    if level.any() and (one or values[1] < NOISE_SHARE * _turned(S, candidates[0]) / 3):
        # Turns do not show the rotation, and gravity shows some of it.
        told = float(np.linalg.svd(level, compute_uv=False).sum())
        turning = w_w / max(float(np.trace(S[:3, :3])), 1e-300) + level / told
        moving = v_v / max(float(np.trace(S[3:6, 3:6])), 1e-300)
        upright = Rotation.aligning(turning).matrix
        candidates += [upright, Rotation.aligning(turning + moving).matrix]
        about = [axes[:, 2], np.linalg.svd(level)[0][:, 0]]
    elif one:
        about = [axes[:, 2]]
    angles = np.arange(1, TURNS)[:, None] * (2 * np.pi / TURNS)
    for axis in about:
        candidates += list(Rotation.exp(angles * axis).matrix @ upright)
    found = [_position(S, R) for R in candidates]
    tilted = [2 * (1 - float((R * level).sum()) / told) if told else 0.0 for R in candidates]
    best = int(np.argmin([cost + tilt for (_, cost), tilt in zip(found, tilted, strict=True)]))
    return Pose(Rotation(candidates[best]), found[best][0])


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
