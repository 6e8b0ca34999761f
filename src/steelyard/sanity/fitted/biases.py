"""A bias of the wrench that is not constant: one that drifts in time, as a sensor that warms up has, or keeps its
direction in the room; how much, and how surely.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.identify.fit import Bias
from steelyard.identify.room_bias import RoomBias, room_bias, without
from steelyard.logs.drift import STEADILY
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import Rows
from steelyard.sanity.fitted.misplaced import misplaced
from steelyard.sanity.fitted.sensor_matrix import sensor_matrix
from steelyard.sanity.words import shortly

# A drift counts beyond 2 % of the weight (at 0.1 m for torques), where it takes 20 % of the squared residual away.
DRIFT_WEIGHT, DRIFT_ARM, DRIFT_SHARE = 0.02, 0.1, 0.8
# A drift is beyond doubt from so many standard deviations on, by leaving out stretches: then the fit allows for it.
# Rounding alone drifts by a share of the weight below the last.
DRIFT_SURE, DRIFT_LEAST = 5.0, 1e-4
_FEWEST_ROWS = 8

# A bias in the room is seen beyond so many standard deviations, by leaving out stretches, and where it leaves so much
# less of what lasts for a second: sound made logs keep 0.96, a real sensor's errors with the pose 0.57.
SURE, SLOWLY = 8.0, 0.5
# ... and so much less of that than another direction of gravity, which has fewer numbers.
BETTER = 0.8
# From so many standard deviations on it is likely: sound made logs stay below 2.5.
LIKELY = 4.0
# Axes of it that a body and a bias of the sensor mimic to this share of their squares are not told.
TOLD = 1e-3
REMEDY = (
    "Let the controller zero the wrench without a load just before the run, or log the sensor's own axes. For the part "
    "along gravity weigh a known mass, or move faster."
)


@dataclass(frozen=True, eq=False)
class Drift:
    """A bias that drifts in time: how much over the log [tau N m, f N] (6,), by how much it may be off, what it leaves.

    left      squared residual beside that of a steady bias
    weight    [N] of what is held
    span      [s] of the log
    settling  time constant [s] in which it settles; infinite, it grows in a line
    """

    growth: Array
    std: Array
    left: float
    weight: float
    span: float
    settling: float = STEADILY

    @property
    def sure(self) -> bool:
        """Whether any channel drifts beyond doubt: left out, even a small drift moves mass and centre by bars."""
        least = DRIFT_LEAST * self.weight * np.repeat([DRIFT_ARM, 1.0], 3)
        return bool((np.abs(self.growth) > np.maximum(DRIFT_SURE * self.std, least)).any())

    @property
    def large(self) -> bool:
        """Whether it is worth a finding."""
        sizes, errors = self._sizes
        large = sizes > np.maximum(DRIFT_SURE * errors, DRIFT_WEIGHT * self.weight * np.array([DRIFT_ARM, 1.0]))
        return bool(large.any()) and self.left <= DRIFT_SHARE

    @property
    def findings(self) -> tuple[Finding, ...]:
        """`bias-drift` where the drift is large and explains much of the residual."""
        if not self.large:
            return ()
        sizes, errors = self._sizes
        message = (
            f"The bias drifts by {sizes[1]:.2g} ± {errors[1]:.1g} N and {sizes[0]:.2g} ± {errors[0]:.1g} N m over "
            f"{self.span:.0f} s, {self.way}, which takes {100 * (1 - self.left):.0f} % of the squared residual away."
        )
        return (Finding.of("bias-drift", message),)

    @property
    def way(self) -> str:
        """How it goes, in words."""
        return "in a line" if self.settling == STEADILY else f"settling with a time constant of {self.settling:.2g} s"

    @property
    def surest_words(self) -> str:
        """How much the channel drifts that is surest to."""
        i = int(np.argmax(np.abs(self.growth) / np.maximum(self.std, 1e-300)))
        kind, unit = ("torque", "N m") if i < 3 else ("force", "N")
        return f"{kind} along {'xyz'[i % 3]} by {self.growth[i]:.2g} ± {self.std[i]:.1g} {unit} over {self.span:.0f} s"

    @property
    def _sizes(self) -> tuple[Array, Array]:
        parts = (self.growth, self.std)
        sizes, errors = (np.array([np.linalg.norm(v[:3]), np.linalg.norm(v[3:])]) for v in parts)
        return sizes, errors


def drift_of(log: MotionLog) -> Drift | None:
    """Return how the bias drifts over the log; None without a clock, or for too short a log."""
    if log.time is None or len(log) < _FEWEST_ROWS:
        return None
    rows, _ = Rows.of(log)
    if not rows.split:
        return None
    steady, moving = rows.solve(), rows.solve(rows.drifting(), jackknife=True)
    weight = abs(float(steady.phi[0])) * float(np.linalg.norm(log.gravity, axis=1).mean())
    span = float(log.time[-1] - log.time[0])
    return Drift(moving.extra, moving.extra_std, moving.beside(steady), weight, span, rows.settling)


@dataclass(frozen=True, eq=False)
class SeenRoomBias:
    """The bias in W [tau, f] that was found, with the directions of gravity (3,) and the sign of the raw channels."""

    bias: RoomBias
    up: Array
    sign: int

    def put_right(self, log: MotionLog, rotation: Array) -> MotionLog:
        """Return the log without it; rotation (N, 3, 3) turns S into W."""
        return without(self.bias.mean, log, rotation)

    @property
    def finding(self) -> Finding:
        """What is said of it."""
        torque, force = (self.sign * part for part in np.split(self.bias.mean, 2))
        upward = float(np.sqrt(self.up @ self.bias.covariance[3:, 3:] @ self.up))
        text = (
            "The wrench has a bias that keeps its direction in the room, as where a controller zeroes it in the axes "
            f"of its base: force ({shortly(force)}) N and torque ({shortly(torque)}) N m along x, y, z of W. The "
            f"answer is without it. Poses do not tell its force along gravity from weight: {upward:.2g} N "
            "of doubt are in the bar of the mass."
        )
        return Finding("bias-drift", text, REMEDY)


@dataclass(frozen=True, eq=False)
class RoomFit:
    """What a log shows of a bias in W by all of it that weight does not mimic: torque, and force across gravity.

    force, std  (3,) [N] across gravity in W; its standard deviation along itself, by leaving out stretches
    times       of how many such standard deviations the surest direction is
    slowly      what it leaves of means over a second, beside what no such bias leaves
    tilted      the same beside what another direction of gravity leaves
    left        squared residual beside that without
    best        whether it leaves less than a turned sensor, unlike gains or another point
    """

    force: Array
    std: float
    times: float
    slowly: float
    tilted: float
    left: float
    best: bool

    @property
    def sure(self) -> bool:
        """Whether it is beyond doubt, and explains more than any other cause."""
        return self.times > SURE and self.slowly <= SLOWLY and self.tilted <= BETTER and self.best

    @property
    def pulls(self) -> bool:
        """Whether it is likely, and its force across gravity shows."""
        return float(np.linalg.norm(self.force)) > LIKELY * self.std and self.tilted < 1 and self.best

    def note(self, gravity: float) -> str:
        """Say what as much along gravity [m/s^2] would do, which nothing shows."""
        size = float(np.linalg.norm(self.force))
        return (
            f"beside the weight something pulls by {size:.2g} ± {self.std:.1g} N across gravity, in one direction of "
            f"the room, as a cable does: as much along gravity would move the mass by {size / gravity:.2g} kg, and no "
            "log shows it; let the cable hang loose, or weigh a known mass once"
        )


def examine_room_bias(
    log: MotionLog, rotation: Array | None, gravity: Array, sign: int, bias: Bias
) -> SeenRoomBias | None:
    """Return the bias in W that a log shows where it is sure, and explains more than any other cause; else None.

    rotation  (N, 3, 3) S to W at the rows     gravity  (3,) [m/s^2] in W
    sign      of the recording's raw channels     bias  that of the sensor
    """
    found = None if rotation is None else room_fit(log, rotation, gravity, bias.drift)
    if rotation is None or found is None or not found.sure:
        return None
    return SeenRoomBias(room_bias(log, rotation, gravity, bias), gravity / np.linalg.norm(gravity), sign)


def room_fit(log: MotionLog, rotation: Array, gravity: Array, drift: bool) -> RoomFit | None:
    """Return what a log shows of a bias in W; None where it is too short, shows none of it, or hardly any."""
    rows, pick = Rows.of(log, drift)
    once = rows.solve()
    slow = rows.slowly(once)
    if not rows.split or not slow:
        return None
    R, level = np.swapaxes(rotation[pick], 1, 2), np.linalg.svd(gravity[None])[2][1:].T
    columns = np.zeros((len(R), 6, 5))
    columns[:, :3, :3], columns[:, 3:, 3:] = R, R @ level
    told = rows.told(columns, TOLD)
    if not told.size:
        return None
    columns = columns @ told
    fit = rows.solve(columns, jackknife=True)
    times = float((np.abs(fit.extra) / np.maximum(fit.extra_std, 1e-300)).max())
    if times < LIKELY:
        return None
    force = level @ told[3:] @ fit.extra
    along = force / max(float(np.linalg.norm(force)), 1e-300) @ level @ told[3:]
    std = float(np.sqrt(along @ fit.extra_covariance @ along))
    tilting = rows.tilting(once.phi, rotation[pick], gravity) @ level
    slowly, tilted = rows.slowly(fit, columns), rows.slowly(rows.solve(tilting), tilting)
    left = fit.beside(once)
    others = sensor_matrix(log, drift), misplaced(log, drift)
    best = all(other is None or left < other.left for other in others)
    return RoomFit(force, std, times, slowly / slow, slowly / max(tilted, 1e-300), left, best)
