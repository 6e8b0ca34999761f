"""Recording: what was read from files, before anything is aligned.

Streams keep their own clocks and frames; units are SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from steelyard.check import Array, Mask, frozen
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

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())))

    def rows(self, kept: Mask) -> Stream:
        """Return the stream of those rows (N,) alone."""
        time = None if self.time is None else frozen(self.time[kept])
        return replace(self, channels={name: frozen(values[kept]) for name, values in self.channels.items()}, time=time)

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
    object_pose   pose of the scan's frame O in S, with its uncertainty (m, rad)
    dead          channels of the wrench [tau, f] in S that do not measure: nothing may be concluded from them
    findings      what reading it already showed: rows that missed a number and were left out
    notes         what reading it had to assume, in words
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
    gravity_std: float = 0.0
