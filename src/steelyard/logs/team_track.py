"""Track: one robot's samples of one recording, on its own clock, and which of them are missing.

Frames: H, the robot's home frame, still in the world unless its base moves; G, its grasp, fixed to the payload. A
number that is missing is NaN when it comes in and a False in the mask of its channel after.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array, Mask
from steelyard.errors import BadDescription, BadValue
from steelyard.findings import counted
from steelyard.logs.clock import median_step, seconds
from steelyard.spatial import Pose, Rotation

CHANNELS: Mapping[str, str] = MappingProxyType(
    {
        "rotation": "G to H, matrices (T, 3, 3)",
        "position": "of G's origin in H (T, 3) [m]",
        "angular_velocity": "in G's axes (T, 3) [rad/s]",
        "linear_velocity": "of G's origin, in G's axes (T, 3) [m/s]",
        "angular_acceleration": "in G's axes (T, 3) [rad/s^2]",
        "linear_acceleration": "classical, of G's origin, gravity not included, in G's axes (T, 3) [m/s^2]",
        "specific_force": "of an accelerometer at G's origin, a - g, in G's axes (T, 3) [m/s^2]",
        "gravity": "in G's axes (T, 3) [m/s^2], where a level sensor tells it",
        "force": "applied to the payload, in G's axes (T, 3) [N]",
        "torque": "applied to the payload about G's origin, in G's axes (T, 3) [N m]",
    }
)


@dataclass(frozen=True, eq=False)
class Track:
    """One robot's samples of one recording.

    time      (T,) [s] on the robot's own clock, rising
    channels  name -> (T, 3), or (T, 3, 3) for rotation; see CHANNELS. Missing entries are filled with zeros or the
              identity. A force without a torque channel comes from a passive gimbal: its moment is zero
    valid     name -> (T,) mask of the rows that were measured
    carrying  (T,) rows in which the robot is known to hold the payload or not; None = not known, so to be found
    repeated  how many rows of its streams were logged more than once, and were left out
    """

    time: Array
    channels: Mapping[str, Array]
    valid: Mapping[str, Mask]
    carrying: Mask | None = None
    repeated: int = 0

    def __post_init__(self) -> None:
        time = check.finite("time", self.time)
        if time.ndim != 1 or len(time) < 1:
            raise BadValue(f"time must have shape (T,) with at least one sample; got {time.shape}.")
        falling = np.diff(time) <= 0
        if falling.any():
            row = int(np.argmax(falling)) + 2  # counted from 1, the later of the two
            many = f"{counted(int(falling.sum()), 'row')} {'does' if falling.sum() == 1 else 'do'} not"
            raise BadValue(f"time must rise from row to row; {many}, the first is row {row}.")
        object.__setattr__(self, "time", time)
        channels = {name: _accepted(name, values, len(time)) for name, values in self.channels.items()}
        object.__setattr__(self, "channels", MappingProxyType(channels))
        masks = {name: row_mask(f"valid of {name}", self.valid.get(name), len(time)) for name in channels}
        object.__setattr__(self, "valid", MappingProxyType(masks))
        if self.carrying is not None:
            object.__setattr__(self, "carrying", row_mask("carrying", self.carrying, len(time)))

    @classmethod
    def of(cls, time: ArrayLike, carrying: ArrayLike | None = None, **channels: ArrayLike | None) -> Track:
        """Return the track of raw columns (T, ..), NaN where a number is missing; a channel that is None is left out.

        `time` is in [s], or datetime64; `rotation` a Rotation, SciPy's, or matrices.
        A row with a NaN in one column loses that channel only; a torque is missing where the force is and the reverse,
        since half a wrench adds up to nothing.
        """
        raw = {name: _numbers(name, values) for name, values in channels.items() if values is not None}
        stamps = seconds(time)
        rows = len(np.atleast_1d(stamps))
        valid: dict[str, Mask] = {}
        filled: dict[str, Array] = {}
        for name, values in raw.items():
            good = np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
            rest = np.eye(3) if name == "rotation" else np.zeros(3)
            shaped = good.reshape(-1, *([1] * (values.ndim - 1)))
            valid[name] = np.asarray(good)
            filled[name] = values if len(values) != rows else np.where(shaped, values, rest)
        if {"force", "torque"} <= valid.keys() and len(valid["force"]) == len(valid["torque"]):
            valid["force"] = valid["torque"] = valid["force"] & valid["torque"]
        held = None if carrying is None else np.asarray(carrying, dtype=np.bool_)
        return cls(stamps, filled, valid, held)

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def step(self) -> float:
        """The usual step [s] of two stamps or more."""
        return median_step(self.time)

    def stamped_at(self, time: Array) -> bool:
        """Return whether `time` (M,) are the track's own stamps, to a microsecond."""
        return len(time) == len(self) and bool(np.abs(time - self.time).max() < 1e-6)

    def has(self, *names: str) -> bool:
        """Return whether every channel is there, with at least one measured row."""
        return all(name in self.channels and bool(self.valid[name].any()) for name in names)

    def mask(self, *names: str) -> Mask:
        """Return the rows (T,) in which every channel was measured; none where one is not there."""
        rows = np.ones(len(self), np.bool_)
        for name in names:
            rows &= self.valid[name] if name in self.channels else False
        return rows

    @property
    def rotation(self) -> Rotation:
        """Rotations R_HG (T,); identity in rows where `mask("rotation")` is False."""
        # They were judged when the track was made.
        return Rotation.trusted(self.channels["rotation"])

    @property
    def pose(self) -> Pose:
        """Poses X_HG (T,); identity in rows where `mask("rotation", "position")` is False."""
        return Pose.trusted(self.rotation, self.channels["position"])

    def wrench(self) -> Array:
        """Return wrenches (T, 6) [N m, N], moment zero for a passive gimbal; zero where `mask("force")` is False."""
        force = self.channels["force"]
        return np.concatenate([self.channels.get("torque", np.zeros_like(force)), force], axis=1)

    def rows(self, index: Any) -> Track:
        """Return the chosen rows (mask, slice or rising indices)."""
        return Track(
            self.time[index],
            {name: values[index] for name, values in self.channels.items()},
            {name: values[index] for name, values in self.valid.items()},
            None if self.carrying is None else self.carrying[index],
            self.repeated,
        )

    def shifted(self, seconds: float) -> Track:
        """Return the track with `seconds` added to its stamps."""
        return self.stamped(self.time + seconds)

    def stamped(self, time: Array) -> Track:
        """Return the track with other stamps (T,) [s], which rise as its own do."""
        # The channels were judged when the track was made.
        moved = copy(self)
        object.__setattr__(moved, "time", check.finite("time", time))
        moved.__dict__.pop("step", None)
        return moved

    def without(self, *names: str) -> Track:
        """Return the track without these channels."""
        kept = {name: values for name, values in self.channels.items() if name not in names}
        return replace(self, channels=kept, valid={name: self.valid[name] for name in kept})

    def moved(self, home: Pose) -> Track:
        """Return the track seen from home A, X_AH = `home`: only poses are given in the home frame."""
        channels = dict(self.channels)
        if "rotation" in channels:
            rows = self.valid["rotation"][:, None, None]
            channels["rotation"] = np.where(rows, home.rotation.matrix @ channels["rotation"], np.eye(3))
        if "position" in channels:
            channels["position"] = np.where(self.valid["position"][:, None], home.apply(channels["position"]), 0.0)
        return replace(self, channels=channels)


def _numbers(name: str, values: ArrayLike) -> Array:
    """Return a raw channel as floats of its shape; NaN passes."""
    if isinstance(values, Rotation):
        values = values.matrix
    elif hasattr(values, "as_matrix"):  # SciPy's
        values = values.as_matrix()
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise BadValue(f"{name} must be numbers; got {type(values).__name__} ({error}).") from None
    size = (3, 3) if name == "rotation" else (3,)
    if array.ndim < 2 or array.shape[1:] != size:
        told = " Quaternions become one with sy.Rotation.from_quaternion_wxyz or .._xyzw." if name == "rotation" else ""
        raise BadValue(f"{name} must have shape (T, {', '.join(map(str, size))}); got {array.shape}.{told}")
    return array


def _accepted(name: str, values: Array, rows: int) -> Array:
    if name not in CHANNELS:
        raise BadDescription(f"a track has no channel '{name}'; there are: {', '.join(CHANNELS)}.")
    accepted = check.rotations("rotation", values) if name == "rotation" else check.vectors(name, values)
    if len(accepted) != rows:
        raise BadValue(f"{name} has {len(accepted)} rows, time has {rows}; they must agree.")
    return accepted


def row_mask(name: str, given: Mask | None, rows: int) -> Mask:
    """Return a read-only mask (rows,), all True where none is given."""
    mask = np.ones(rows, np.bool_) if given is None else np.array(given, np.bool_)
    if mask.shape != (rows,):
        raise BadValue(f"{name} must have shape ({rows},); got {mask.shape}.")
    mask.flags.writeable = False
    return mask
