"""MotionLog: one body, one clock, everything in the sensor frame S; and the noise its channels carry."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers, Mask
from steelyard.errors import BadValue
from steelyard.inertia.regressor import newton_euler
from steelyard.spatial import Pose, lever_acceleration


@dataclass(frozen=True, eq=False)
class Noise:
    """Variances of one class of rows, per axis of S.

    acceleration  (6,) of [alpha (rad/s^2)^2, a (m/s^2)^2]
    wrench        (6,) of [tau (N m)^2, f N^2]
    taken         (6,) of [alpha, a], of what a smoother took off: it scatters about the readings, and so makes no fit
                  too small
    """

    acceleration: Array
    wrench: Array
    taken: Array = field(default_factory=lambda: np.zeros(6))

    def __post_init__(self) -> None:
        for name in ("acceleration", "wrench", "taken"):
            value = check.vectors(f"{name} variance", getattr(self, name), 6)
            if (value < 0).any():
                raise BadValue(f"{name} variances must not be negative; got {value}.")
            object.__setattr__(self, name, value)

    @classmethod
    def of_std(cls, angular_acceleration: float, acceleration: float, force: float, torque: float) -> Noise:
        """Return equal noise on the three axes from standard deviations (rad/s^2, m/s^2, N, N m)."""
        pair = [[angular_acceleration, acceleration], [torque, force]]
        return cls(*(np.repeat(np.square(p), 3) for p in pair))


@dataclass(frozen=True, eq=False)
class MotionLog:
    """Aligned samples of one body held at S.

    wrench                (N, 6) [tau, f] that the robot applies to the object, biased as the sensor reads it
    gravity               (N, 3) [m/s^2] in S
    acceleration          (N, 3) [m/s^2] classical, of the S origin, gravity not included
    angular_velocity      (N, 3) [rad/s]
    angular_acceleration  (N, 3) [rad/s^2]
    time                  (N,) [s] or None: rows then have no order and no neighbours
    still                 (N,) rows known to be at rest; none by default
    pose                  (N,) number of the still pose or time block a row belongs to (for hold-out and jackknife);
                          -1 = none, the default
    noise_class           (N,) index into `noise`; 0 by default
    noise                 one Noise per class; None = not known yet
    dead                  (6,) channels [tau, f] that do not measure; none by default

    Raises BadValue for numbers that are not finite, shapes or lengths that do not agree, and classes without a Noise.
    """

    wrench: Array
    gravity: Array
    acceleration: Array
    angular_velocity: Array
    angular_acceleration: Array
    time: Array | None = None
    # None stands for the default given above and is filled in at once.
    still: Mask = None  # type: ignore[assignment]
    pose: Integers = None  # type: ignore[assignment]
    noise_class: Integers = None  # type: ignore[assignment]
    noise: tuple[Noise, ...] | None = None
    dead: Mask = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        object.__setattr__(self, "wrench", check.vectors("wrench", self.wrench, 6))
        rows = len(self.wrench)
        for name in ("gravity", "acceleration", "angular_velocity", "angular_acceleration"):
            object.__setattr__(self, name, check.vectors(name, getattr(self, name), 3))
        if self.time is not None:
            object.__setattr__(self, "time", check.vectors("time", self.time, rows))
        defaults: dict[str, np.ndarray[Any, Any]] = {
            "still": np.zeros(rows, np.bool_), "pose": np.full(rows, -1, np.int64),
            "noise_class": np.zeros(rows, np.int64), "dead": np.zeros(6, np.bool_),
        }  # fmt: skip
        for name, default in defaults.items():
            given = getattr(self, name)
            value = default if given is None else np.array(given, default.dtype)
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        self._check_lengths(rows)
        self._check_numbers()

    def _check_lengths(self, rows: int) -> None:
        for name in self._row_fields():
            value = getattr(self, name)
            if value is not None and len(value) != rows:
                raise BadValue(f"{name} has {len(value)} rows, wrench has {rows}; they must agree.")

    def _check_numbers(self) -> None:
        """Raise BadValue where channels are not six, or a row belongs to no class of noise or no pose."""
        if self.dead.shape != (6,):
            raise BadValue(f"dead must have shape (6,), one for each channel; got {self.dead.shape}.")
        if not len(self):
            return
        least, most = int(self.noise_class.min()), int(self.noise_class.max())
        if least < 0 or (self.noise is not None and most >= len(self.noise)):
            classes = "" if self.noise is None else f" below {len(self.noise)}, one Noise each"
            raise BadValue(f"noise_class must be numbers from 0 on{classes}; got {least} to {most}.")
        if (self.pose < -1).any():
            raise BadValue(f"pose must be -1 or a number from 0 on; got {int(self.pose.min())}.")

    @staticmethod
    def _row_fields() -> tuple[str, ...]:
        return (
            "wrench", "gravity", "acceleration", "angular_velocity", "angular_acceleration",
            "time", "still", "pose", "noise_class",
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.wrench)

    def rows(self, index: Any) -> MotionLog:
        """Return the chosen rows (mask, slice or indices)."""
        chosen = {n: getattr(self, n)[index] for n in self._row_fields() if getattr(self, n) is not None}
        return replace(self, **chosen)

    def in_frame(self, X_AS: Pose) -> MotionLog:
        """Return the same log as a sensor at frame A, fixed to S, would have recorded it (noise, dead dropped)."""
        R, p = X_AS.rotation, X_AS.position
        omega, alpha = R.apply(self.angular_velocity), R.apply(self.angular_acceleration)
        lever = lever_acceleration(omega, alpha, p)
        force = R.apply(self.wrench[:, 3:])
        torque = R.apply(self.wrench[:, :3]) + np.cross(p, force)
        return replace(
            self,
            wrench=np.concatenate([torque, force], 1),
            gravity=R.apply(self.gravity),
            acceleration=R.apply(self.acceleration) - lever,
            angular_velocity=omega,
            angular_acceleration=alpha,
            noise=None,
            dead=np.zeros(6, np.bool_),
        )

    @classmethod
    def of_poses(cls, wrench: Array, gravity: Array) -> MotionLog:
        """Return the log of still poses: wrench (N, 6), gravity in S (N, 3); each row is its own pose."""
        zero = np.zeros((len(wrench), 3))
        rows = len(wrench)
        return cls(
            wrench, gravity, zero, zero, zero, still=np.ones(rows, np.bool_), pose=np.arange(rows, dtype=np.int64)
        )

    def predicted(self, phi: Array) -> Array:
        """Return the wrench (N, 6) that a body phi (10,) needs for this motion, without bias."""
        return newton_euler(phi, self.acceleration - self.gravity, self.angular_velocity, self.angular_acceleration)
