"""The payload's motion, fused over the team, as rows of one body: what the ten parameters are fitted to.

Poses of all robots together place the payload far better than one gimbal encoder: rotation comes from positions over a
baseline of a metre. Motion and wrench go through the same zero-phase filter, so that what it takes away it takes from
both, and are thinned to what is then independent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.logs.conditioning import lowpass
from steelyard.logs.log import MotionLog, Noise
from steelyard.spatial import Pose, Rotation, cross
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.stacked import Stretch

# Rows kept per cycle of the cut-off: about what passes the filter independently.
PER_CYCLE = 2.5
# Cycles of the cut-off left out at both ends, where the filter has only one side.
ENDS = 1.0
# Fewer rows of a recording than this are left out.
FEWEST = 3


@dataclass(frozen=True, eq=False)
class Fused:
    """Rows of one recording in the balance frame B, fixed to the payload.

    log     wrench of the team, gravity and motion in B's axes at B's origin; noise declared
    shares  (N, T, 6) what each robot adds to the wrench
    """

    name: str
    log: MotionLog
    shares: Array


@dataclass(frozen=True, eq=False)
class Balance:
    """Frame B at the middle of the grasps along the axes in which they spread: noise of its wrench is uncorrelated."""

    X_RB: Pose

    @classmethod
    def of(cls, grasps: Pose) -> Balance:
        """Return the frame for grasps (N,) given in R."""
        centre = grasps.position.mean(0)
        off = grasps.position - centre
        _, axes = np.linalg.eigh(off.T @ off)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        return cls(Pose(Rotation(axes), centre))


def fused(part: Stretch, motion: Pose, grasps: Pose, gravity: Array, noise: Array, cutoff_hz: float) -> Fused | None:
    """Return the rows of one recording, None where too few are complete.

    motion   X_HR (T,) of the payload      grasps  X_RG (N,)      gravity  (3,) [m/s^2] in H
    noise    (6, 6) covariance of a row of `motion` [rad, m] in R's axes
    """
    balance = Balance.of(grasps).X_RB
    shares = _shares(part, balance.inverse() @ grasps)
    path = motion @ balance
    spread = adjoint_inverse(balance) @ noise @ adjoint_inverse(balance).T
    step = max(1, round(part.rate / (PER_CYCLE * cutoff_hz)))
    make = _resting if part.kind == "still" else _moving
    made = make(part, path, shares, gravity, cutoff_hz, step)
    if made is None or len(made.time) < FEWEST:
        return None
    tilt = np.diag(spread)[:3] * float(gravity @ gravity)
    acceleration = np.diag(spread) * made.share + np.concatenate([np.zeros(3), np.full(3, tilt.mean())])
    log = MotionLog(
        made.shares.sum(0), made.gravity, made.acceleration, made.omega, made.alpha, made.time,
        noise=(Noise(acceleration, np.ones(6)),),
    )  # fmt: skip
    return Fused(part.name, log, made.shares)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Thinned rows in B; `share` is the variance of their accelerations per variance of white noise in the path."""

    time: Array
    shares: Array
    gravity: Array
    acceleration: Array
    omega: Array
    alpha: Array
    share: float


def _shares(part: Stretch, X_BG: Pose) -> Array:
    """Return the wrench (N, T, 6) of every robot at B, zero where it holds nothing."""
    given = np.moveaxis(part.wrench, 1, 0) * np.moveaxis(part.carries, 1, 0)[..., None]
    turn, place = X_BG.rotation.matrix, X_BG.position
    force = np.einsum("nij,ntj->nti", turn, given[..., 3:])
    moment = np.einsum("nij,ntj->nti", turn, given[..., :3]) + cross(
        np.broadcast_to(place[:, None], force.shape), force
    )
    return np.concatenate([moment, force], axis=-1)


def _moving(part: Stretch, path: Pose, shares: Array, gravity: Array, cutoff_hz: float, step: int) -> _Rows | None:
    """Return the rows of a payload in motion, None where the recording is too short to filter."""
    rate = part.rate
    if len(part) < 4 * rate / cutoff_hz or cutoff_hz >= rate / 2:
        return None
    middle = Rotation.nearest(path.rotation.matrix.mean(0))
    rotation = middle @ Rotation.exp(lowpass((middle.inverse() @ path.rotation).log(), cutoff_hz, rate))
    place = lowpass(path.position, cutoff_hz, rate)
    flat = np.moveaxis(shares, 0, 1).reshape(len(part), -1)
    pieces = np.moveaxis(lowpass(flat, cutoff_hz, rate).reshape(len(part), len(shares), 6), 1, 0)
    omega, alpha, second = np.zeros((3, len(part), 3))
    omega[1:-1] = (rotation[:-2].inverse() @ rotation[2:]).log() * (rate / 2)
    alpha[2:-2] = (omega[3:-1] - omega[1:-3]) * (rate / 2)
    second[1:-1] = (place[2:] - 2 * place[1:-1] + place[:-2]) * rate**2
    keep = _clear_of_gaps(part.complete & part.seen.any(1), int(0.5 * rate / cutoff_hz) + 1)
    ends = int(np.ceil(ENDS * rate / cutoff_hz)) + 2
    keep[:ends] = keep[-ends:] = False
    chosen = np.flatnonzero(keep)[::step]
    back = rotation[chosen].inverse()
    return _Rows(
        part.time[chosen], pieces[:, chosen], back.apply(gravity), back.apply(second[chosen]), omega[chosen],
        alpha[chosen], _acceleration_share(rate, cutoff_hz),
    )  # fmt: skip


def _acceleration_share(rate: float, cutoff_hz: float) -> float:
    """Return the variance of filtered second derivatives per variance of white noise in the path [s^-4]."""
    impulse = np.zeros((801, 1))
    impulse[400] = 1
    kernel = np.diff(lowpass(impulse, min(cutoff_hz, 0.45 * rate), rate)[:, 0], 2) * rate**2
    return float(kernel @ kernel)


def _resting(part: Stretch, path: Pose, shares: Array, gravity: Array, cutoff_hz: float, step: int) -> _Rows | None:
    """Return means over blocks of `step` rows of a payload at rest, which does not accelerate."""
    good = np.flatnonzero(part.complete & part.seen.any(1))
    blocks = len(good) // step
    if not blocks:
        return None
    good = good[: blocks * step].reshape(blocks, step)
    zeros = np.zeros((blocks, 3))
    down = path.rotation.inverse().apply(gravity)
    return _Rows(part.time[good].mean(1), shares[:, good].mean(2), down[good].mean(1), zeros, zeros, zeros, 0.0)


def _clear_of_gaps(good: Array, reach: int) -> Array:
    """Return the good rows with no bad one within `reach` rows."""
    bad = np.convolve((~good).astype(float), np.ones(2 * reach + 1), mode="same") > 0.5
    return np.asarray(good & ~bad)
