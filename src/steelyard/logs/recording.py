"""Recording: what was read from files, before anything is aligned.

Streams keep their own clocks and frames; units are SI.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Mask, frozen
from steelyard.errors import BadDescription, BadValue
from steelyard.findings import Finding
from steelyard.spatial import Pose, Rotation

# [m/s^2] Standard gravity, by which g and kgf are read.
STANDARD_GRAVITY = 9.80665
# Relative standard deviation of gravity where nobody states it: even between equator and pole, 9.780 and 9.832 m/s^2.
ASSUMED_GRAVITY_STD = 0.0015
# [N], [m] A pound of force and an inch.
POUND_FORCE, INCH = 4.4482216152605, 0.0254
# [m/s^2] Gravity as most descriptions round it: for thresholds, which a thousandth does not move.
ROUNDED_GRAVITY = 9.81
# [m], [rad] Standard deviations of a pose that is known.
KNOWN_PLACE = (0.0, 0.0)

# Quantity -> number of columns (rotation is stored as matrices).
QUANTITIES: dict[str, int] = {
    "force": 3,
    "torque": 3,
    "rotation": 9,
    "position": 3,
    "linear_velocity": 3,
    "angular_velocity": 3,
    "linear_acceleration": 3,
    "angular_acceleration": 3,
    "specific_force": 3,
    "gravity": 3,
}

# What a robot of a team may tell beside QUANTITIES: joints, and whether it holds the payload.
_OF_ROBOTS = ("joint_position", "joint_torque", "carrying")
_REMEDY = "sy.recording(time=.., force=.., ..) makes recordings of arrays, lists and rotations."


@dataclass(frozen=True)
class Mount:
    """Pose of a stream's own frame in S; `rotation` or `position` (m) is None where it was not given."""

    rotation: Rotation | None = None
    position: Array | None = None


@dataclass(frozen=True)
class Stream:
    """One file or topic, one clock.

    name      the path as the description writes it: the key of `delays_s` and of messages;
              "path#2" for the second stream of one file
    time      (N,) [s] on the stream's own clock, never falling (repeated stamps pass: sanity checks find them);
              None without a clock
    channels  quantity -> (N, 3), or (N, 3, 3) for rotation (S to W); SI units.
              A torque that the description declares "zero" is exact zeros
    frames    quantity -> "S" (default) or "W" for vectors that may be given in base axes
    delay     [s] its stamps are late by this much; None = not given, so to be estimated
    mount     pose of the stream's own frame in S; None = S itself (for an accelerometer: to be estimated)
    poses     a table of still poses without time: rows of such streams belong together
    said      the unit that its stamps were said to be in, before they were read as seconds
    moved     [s] its stamps were late by this much beside the wrench's clock, and `time` is already without it
    """

    name: str
    channels: Mapping[str, Array]
    time: Array | None = None
    frames: Mapping[str, str] = field(default_factory=dict)
    delay: float | None = None
    mount: Mount | None = None
    poses: bool = False
    said: str = "s"
    moved: float = 0.0

    def __post_init__(self) -> None:
        """Raise BadValue at a quantity, frame or shape that is none; numbers become read-only float64."""
        if not isinstance(self.channels, Mapping) or not self.channels:
            raise BadValue(f"{self.name}: channels must be a dict of quantity and array. {_REMEDY}")
        channels = {quantity: _channel(self.name, quantity, values) for quantity, values in self.channels.items()}
        object.__setattr__(self, "channels", channels)
        rows = {quantity: len(values) for quantity, values in channels.items()}
        if self.time is not None:
            time = _numbers(f"{self.name}, time", self.time)
            if time.ndim != 1:
                raise BadValue(f"{self.name}, time: expected shape (N,) [s]; found {time.shape}. {_REMEDY}")
            object.__setattr__(self, "time", time)
            rows["time"] = len(time)
        if len(set(rows.values())) > 1:
            shown = ", ".join(f"{name} {count}" for name, count in rows.items())
            raise BadValue(f"{self.name}: the lengths differ: {shown} rows. Each quantity needs one row per sample.")
        for quantity, frame in self.frames.items():
            if frame not in ("S", "W"):
                raise BadValue(f'{self.name}: the frame of {quantity} must be "S" or "W"; got {frame!r}.')

    @cached_property
    def known(self) -> Mask:
        """Which rows (N,) hold a number everywhere."""
        columns = [*self.channels.values(), *(() if self.time is None else (self.time,))]
        return reduce(np.logical_and, map(known_rows, columns))

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())))

    @property
    def stamps(self) -> Array:
        """Its stamps (N,) [s]; raises BadDescription where it has none."""
        if self.time is None:
            raise BadDescription(f"'{self.name}' has no time; streams with their own rows need a clock.")
        return self.time

    @property
    def sampled(self) -> Array:
        """When its rows were sampled (N,) [s]: the stamps less a delay that was given; raises as `stamps` does."""
        return np.asarray(self.stamps - (self.delay or 0.0))

    def in_world(self, quantity: str) -> bool:
        """Tell whether a quantity is given in the axes of W, as positions always are, and not in its own."""
        return quantity == "position" or self.frames.get(quantity, "S") == "W"

    def rows(self, kept: Mask) -> Stream:
        """Return the stream of those rows (N,) alone."""
        time = None if self.time is None else frozen(self.time[kept])
        return replace(self, channels={name: frozen(values[kept]) for name, values in self.channels.items()}, time=time)

    def with_channels(self, **channels: Array) -> Stream:
        """Return the stream with these channels beside or instead of its own."""
        return replace(self, channels={**self.channels, **channels})

    @property
    def turn(self) -> Rotation | None:
        """The rotation of the stream's own frame into S, None where it was not given."""
        return None if self.mount is None else self.mount.rotation

    @property
    def arm(self) -> Array | None:
        """The origin (3,) [m] of the stream's own frame in S, None where it was not given."""
        return None if self.mount is None else self.mount.position


@dataclass(frozen=True)
class Recording:
    """Everything one description names.

    gravity       (3,) [m/s^2] in W
    gravity_std   relative standard deviation of its length: bars of mass and first moment hold it
    wrench_sign   +1: the wrench is what the robot applies to the object; -1: the reaction (on-sensor)
    noise         declared standard deviations: force [N], torque [N m], acceleration [m/s^2],
                  angular_acceleration [rad/s^2]; missing ones are estimated
    tool          path of the result or log of the gripper alone, to be taken away
    object_pose   pose of the scan's frame O in S, its standard deviations [m], [rad] None where nothing says
    dead          channels of the wrench [tau, f] in S that do not measure: nothing may be concluded from them
    findings      what reading it already showed: rows that missed a number and were left out
    notes         what reading it had to assume, in words
    sign_said     whether anything says the sign of the wrench; else it is found from the weight, and no mistake
    described     whether a description says sign, gravity and units; bare data files and typed rows have none
    """

    streams: tuple[Stream, ...]
    gravity: Array
    wrench_sign: int = 1
    noise: Mapping[str, float] = field(default_factory=dict)
    tool: str | None = None
    object_pose: Pose | None = None
    object_pose_std: tuple[float, float] | None = None
    name: str = "log"
    dead: tuple[bool, ...] = (False,) * 6
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    described: bool = True
    sign_said: bool = True
    gravity_std: float = 0.0

    def __post_init__(self) -> None:
        """Raise BadValue where what is given is no recording, or rows miss a number."""
        streams = self.streams
        if not isinstance(streams, Sequence) or not streams or not all(isinstance(s, Stream) for s in streams):
            raise BadValue(f"a Recording takes a tuple of Streams; got {type(streams).__name__}. {_REMEDY}")
        object.__setattr__(self, "streams", tuple(streams))
        gravity = check.vectors("gravity", self.gravity)
        if gravity.shape != (3,):
            raise BadValue(f"gravity must be one vector (3,) [m/s^2] in W; got shape {gravity.shape}.")
        object.__setattr__(self, "gravity", gravity)
        if self.wrench_sign not in (1, -1):
            raise BadValue(f"wrench_sign must be 1 (on-object) or -1 (on-sensor); got {self.wrench_sign!r}.")
        for stream in streams:
            if not stream.known.all():
                raise BadValue(f"{stream.name}: rows miss numbers (NaN, infinity); sy.recording leaves such rows out.")

    def stream_of(self, *quantities: str) -> Stream | None:
        """Return the first stream that holds all of the quantities; None where there is none."""
        return next((s for s in self.streams if set(quantities) <= set(s.channels)), None)

    def channels(self, *quantities: str) -> Iterator[tuple[Stream, str, Array]]:
        """Yield stream, quantity and values (N, ..) of every channel that holds one of the quantities."""
        for quantity in quantities:
            for stream in self.streams:
                if quantity in stream.channels:
                    yield stream, quantity, stream.channels[quantity]

    def changed(self, change: Callable[[Stream], Stream]) -> Recording:
        """Return the recording with its streams as `change` makes them."""
        return replace(self, streams=tuple(map(change, self.streams)))

    def noted(self, note: str) -> Recording:
        """Return the recording with one more note."""
        return replace(self, notes=(*self.notes, note))


def first_channels(streams: Sequence[Stream]) -> dict[str, tuple[Stream, Array]]:
    """Return quantity -> the first stream that has it, and its values."""
    return {quantity: (s, values) for s in reversed(streams) for quantity, values in s.channels.items()}


def no_rotation(quantity: str, stream: str) -> BadDescription:
    """Return the error about a quantity that a stream gives in W where nothing says how S stood."""
    return BadDescription(f"{quantity} of '{stream}' is given in W, but no stream gives the rotation of S in W.")


def known_rows(values: Array) -> Mask:
    """Return which rows of (N, ..) hold numbers; a sum that is one shows at once that all do."""
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(values.sum()):
            return np.ones(len(values), np.bool_)
    return np.asarray(np.isfinite(values.reshape(len(values), -1)).all(1))


def _channel(name: str, quantity: str, values: Any) -> Array:
    """Return the rows of a quantity as read-only float64; raises BadValue."""
    if quantity not in QUANTITIES and quantity not in _OF_ROBOTS:
        raise BadValue(f'{name}: unknown quantity "{quantity}"; there are {", ".join(QUANTITIES)}.')
    array = _numbers(f"{name}, {quantity}", values)
    shape = (3, 3) if quantity == "rotation" else (3,) if quantity in QUANTITIES else array.shape[1:2]
    if array.ndim != 1 + len(shape) or array.shape[1:] != shape:
        wanted = ", ".join(map(str, shape))
        raise BadValue(f"{name}, {quantity}: expected shape (N, {wanted}); found {array.shape}. {_REMEDY}")
    return array


def _numbers(where: str, values: Any) -> Array:
    """Return numbers as read-only float64, as they are where they are that already."""
    if isinstance(values, np.ndarray) and values.dtype == np.float64 and not values.flags.writeable:
        return values
    try:
        return check.frozen(values)
    except (TypeError, ValueError):
        raise BadValue(f"{where}: expected an array of numbers; got {type(values).__name__}. {_REMEDY}") from None
