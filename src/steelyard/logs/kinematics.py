"""Kinematics: gravity, rates and accelerations in S at any time, out of whatever motion channels there
are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription
from steelyard.logs.clock import stamps_of
from steelyard.logs.conditioning import Signal, noise_std, signal
from steelyard.logs.recording import Stream
from steelyard.logs.smoothing import Smooth, SmoothRotation, smooth, smooth_rotations
from steelyard.spatial import Rotation, lever_acceleration

# How late each stream's stamps are [s]: throughout, or at each of the times asked for.
Delays = Mapping[str, float | Array]
# What is used; velocities are smoothed where the accelerations beside them are not given.
_QUANTITIES = (
    "rotation", "angular_acceleration", "linear_acceleration", "gravity", "position", "angular_velocity",
    "linear_velocity",
)  # fmt: skip
_BETTER = {"angular_velocity": "angular_acceleration", "linear_velocity": "linear_acceleration"}
_UNKNOWN_LEVER = 0.5  # [m] how far from a turning axis S may be when nothing measures its acceleration


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of S at M times, in S.

    gravity                (M, 3) [m/s^2], None where no channel tells it
    rotation               (M,) S to W, None without
    velocity               (M, 3) [m/s] of the S origin in S, None without
    acceleration           (M, 3) classical, without gravity; zero where `measured` is False
    acceleration_variance, alpha_variance   (M,) per axis
    measured               the acceleration comes from a channel, not from a guess
    """

    gravity: Array | None
    rotation: Rotation | None
    omega: Array
    alpha: Array
    velocity: Array | None
    acceleration: Array
    alpha_variance: Array
    acceleration_variance: Array
    measured: bool


@dataclass(frozen=True, eq=False)
class Channel:
    """One quantity of one stream, ready to be evaluated; `curve` is a Signal or a smoothed signal."""

    stream: str
    curve: Signal | Smooth | SmoothRotation
    world: bool
    variance: float = 0.0


@dataclass(frozen=True, eq=False)
class Kinematics:
    """The motion channels of a recording, each with the clock of its stream.

    channels  quantity -> Channel
    gravity_world  (3,) [m/s^2]
    place     (3,) [m] in S, the point that the position and its derivatives are of
    """

    channels: Mapping[str, Channel]
    gravity_world: Array
    spans: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    place: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def streams(self) -> tuple[str, ...]:
        """Names of the streams that are used."""
        return tuple(dict.fromkeys(c.stream for c in self.channels.values()))

    @property
    def source(self) -> str:
        """Say where the acceleration comes from."""
        order = ("linear_acceleration", "linear_velocity", "position")
        return next((q for q in order if q in self.channels), "none")

    @property
    def differentiates(self) -> bool:
        """Whether an acceleration comes from poses or velocities by differentiation."""
        return self.source not in ("none", "linear_acceleration")

    @property
    def within(self) -> tuple[float, float]:
        """Shares of the variances of alpha and of the acceleration that are noise within them.

        The rest is what a smoother took off the signal.
        """
        alpha = _passed(self.channels, {"angular_acceleration": 0, "angular_velocity": 1, "rotation": 2})
        return alpha, _passed(self.channels, {"linear_acceleration": 0, "linear_velocity": 1, "position": 2})

    def at(self, time: Array, delays: Delays) -> Motion:
        """Return the motion at `time` (M,) [s] of the common clock; delays [s] say how late each stream's
        stamps are."""
        turn, omega, alpha, alpha_variance = self._turning(time, delays)
        gravity = self._gravity(time, delays, turn)
        velocity = self._vector("linear_velocity", time, delays, turn)
        acceleration, variance = self._acceleration(time, delays, turn, omega)
        if turn is not None and "position" in self.channels and (velocity is None or acceleration is None):
            states, of_states = self._smooth("position", time, delays)
            velocity = turn.inverse().apply(states[:, 1]) if velocity is None else velocity
            if acceleration is None:
                acceleration, variance = turn.inverse().apply(states[:, 2]), of_states[:, 2]
        measured = acceleration is not None
        if acceleration is None:
            acceleration = np.zeros_like(omega)
            guess = _UNKNOWN_LEVER * ((omega**2).sum(1) + np.linalg.norm(alpha, axis=1))
            variance = guess**2 / 3
        elif self.place.any():
            acceleration = acceleration - lever_acceleration(omega, alpha, self.place)
            variance = variance + float(self.place @ self.place) * alpha_variance
        return Motion(gravity, turn, omega, alpha, velocity, acceleration, alpha_variance, variance, measured)

    def _smooth(self, quantity: str, time: Array, delays: Delays) -> tuple[Array, Array]:
        channel = self.channels[quantity]
        curve = channel.curve
        if not isinstance(curve, Smooth):
            raise BadDescription(f"{quantity} of '{channel.stream}' is not smoothed.")
        return curve.at(time + delays.get(channel.stream, 0.0))

    def _vector(self, quantity: str, time: Array, delays: Delays, turn: Rotation | None) -> Array | None:
        """Return a channel's values in S, None where there is no such channel."""
        channel = self.channels.get(quantity)
        if channel is None:
            return None
        shifted = time + delays.get(channel.stream, 0.0)
        curve = channel.curve
        if isinstance(curve, Smooth):
            values = curve.at(shifted)[0][:, 0]
        elif isinstance(curve, Signal):
            values = curve.at(shifted)
        else:
            raise BadDescription(f"{quantity} cannot be a rotation.")
        return _into_sensor(values, channel, turn)

    def _turning(self, time: Array, delays: Delays) -> tuple[Rotation | None, Array, Array, Array]:
        zero = np.zeros((len(time), 3))
        turn, omega, alpha, variance = None, zero, zero, np.zeros(len(time))
        rotation = self.channels.get("rotation")
        if rotation is not None and isinstance(rotation.curve, SmoothRotation):
            turn, omega, alpha, v = rotation.curve.at(time + delays.get(rotation.stream, 0.0))
            variance = v[:, 2]
        given = self._vector("angular_velocity", time, delays, turn)
        if given is not None:
            omega = given
            if isinstance(self.channels["angular_velocity"].curve, Smooth):
                states, v = self._smooth("angular_velocity", time, delays)
                # The derivative of body components is the body angular acceleration, in W or S alike.
                alpha = _into_sensor(states[:, 1], self.channels["angular_velocity"], turn)
                variance = v[:, 1]
        given = self._vector("angular_acceleration", time, delays, turn)
        if given is not None:
            alpha, variance = given, np.full(len(time), self.channels["angular_acceleration"].variance)
        return turn, omega, alpha, variance

    def _gravity(self, time: Array, delays: Delays, turn: Rotation | None) -> Array | None:
        if turn is not None:
            return np.asarray(turn.inverse().matrix @ self.gravity_world)
        return self._vector("gravity", time, delays, None)

    def _acceleration(
        self, time: Array, delays: Delays, turn: Rotation | None, omega: Array
    ) -> tuple[Array | None, Array]:
        """Return the classical acceleration in S and its variance from the first channel but positions that has it."""
        given = self._vector("linear_acceleration", time, delays, turn)
        if given is not None:
            return given, np.full(len(time), self.channels["linear_acceleration"].variance)
        if "linear_velocity" in self.channels:
            channel = self.channels["linear_velocity"]
            states, variance = self._smooth("linear_velocity", time, delays)
            derivative = _into_sensor(states[:, 1], channel, turn)
            if not channel.world:
                derivative = derivative + np.cross(omega, states[:, 0])
            return derivative, variance[:, 1]
        return None, np.zeros(len(time))


def _passed(channels: Mapping[str, Channel], order: Mapping[str, int]) -> float:
    """Return the share of noise in what the first of some quantities tells by its derivative of that order."""
    for quantity, derivative in order.items():
        curve = channels[quantity].curve if quantity in channels else None
        curve = curve.quaternion if isinstance(curve, SmoothRotation) else curve
        if curve is not None and (derivative == 0 or isinstance(curve, Smooth)):
            return float(curve.passed[derivative]) if isinstance(curve, Smooth) else 1.0
    return 1.0


def kinematics(streams: tuple[Stream, ...], gravity_world: Array, cutoff_hz: float | None) -> Kinematics:
    """Smooth the motion channels of timed streams; of each quantity the first stream that has it counts.

    gravity_world  (3,) [m/s^2] in W

    Given accelerations are low-passed at `cutoff_hz` [Hz] only; given velocities are smoothed where the
    acceleration must come from them, positions always. Raises BadDescription when W-frame channels come without a
    rotation.
    """
    found: dict[str, tuple[Stream, Array]] = {}
    for stream in streams:
        for quantity, values in stream.channels.items():
            found.setdefault(quantity, (stream, values))
    # Beside a given acceleration a position still tells the velocity, and with it what is at rest.
    smoothed = {"position", *(velocity for velocity, better in _BETTER.items() if better not in found)}
    channels = {q: _channel(*found[q], q, q in smoothed, cutoff_hz) for q in _QUANTITIES if q in found}
    for quantity, channel in channels.items():
        if channel.world and "rotation" not in channels and quantity != "position":
            raise BadDescription(
                f"{quantity} of '{channel.stream}' is given in W, but no stream gives the rotation of S in W."
            )
    spans = {s.name: (float(s.time[0]), float(s.time[-1])) for s in streams if s.time is not None}
    for channel in channels.values():
        start, end = spans[channel.stream]
        first, last = _ends(channel.curve, start, end)
        spans[channel.stream] = (max(start, first), min(end, last))
    return Kinematics(channels, gravity_world, spans)


def _ends(curve: Signal | Smooth | SmoothRotation, start: float, end: float) -> tuple[float, float]:
    """Return the first and last time [s] that a curve tells; of a plain one those of its stream."""
    smoothed = curve.quaternion if isinstance(curve, SmoothRotation) else curve
    if not isinstance(smoothed, Smooth):
        return start, end
    return float(smoothed.time[0]), float(smoothed.time[-1])


def _channel(stream: Stream, values: Array, quantity: str, smoothed: bool, cutoff_hz: float | None) -> Channel:
    """Return one quantity of a timed stream as a curve, smoothed or low-passed alone."""
    time = stamps_of(stream)
    if quantity == "rotation":
        return Channel(stream.name, smooth_rotations(time, Rotation.nearest(values), cutoff_hz), False)
    world = quantity == "position" or stream.frames.get(quantity, "S") == "W"
    if smoothed:
        return Channel(stream.name, smooth(time, values, cutoff_hz=cutoff_hz), world)
    curve = signal(time, values, cutoff_hz)
    share = min(1.0, 2 * cutoff_hz / curve.rate) if cutoff_hz is not None else 1.0
    return Channel(stream.name, curve, world, float((noise_std(values) ** 2).mean()) * share)


def _into_sensor(values: Array, channel: Channel, turn: Rotation | None) -> Array:
    if not channel.world:
        return values
    if turn is None:
        raise BadDescription(f"a channel of '{channel.stream}' is given in W, but there is no rotation of S in W.")
    return turn.inverse().apply(values)
