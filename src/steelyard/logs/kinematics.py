"""Kinematics: gravity, rates and accelerations in S at any time, out of whatever motion channels there are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from steelyard.check import Array
from steelyard.logs.conditioning import noise_left, noise_std, signal
from steelyard.logs.curve import Curve
from steelyard.logs.recording import Stream, first_channels, no_rotation
from steelyard.logs.smooth_turns import smooth_rotations, turning
from steelyard.logs.smoothing import Smooth, smooth
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
    position               (M, 3) [m] of the S origin in W, None without
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
    position: Array | None


@dataclass(frozen=True, eq=False)
class Channel:
    """One quantity of one stream as a curve on its clock, smoothed or low-passed alone.

    world     its vectors are in W
    variance  of what is not smoothed
    """

    stream: str
    curve: Curve | Smooth
    world: bool
    variance: float = 0.0

    def at(self, time: Array, delays: Delays) -> tuple[Array, Array]:
        """Return values (M, k, D) and their variances (M, k): k = 3 with two derivatives where smoothed, else 1."""
        stamps = time + delays.get(self.stream, 0.0)
        if isinstance(self.curve, Smooth):
            return self.curve.at(stamps)
        return self.curve.at(stamps)[:, None], np.full((len(time), 1), self.variance)

    def in_sensor(self, vectors: Array, turn: Rotation | None) -> Array:
        """Return vectors (M, 3) of the channel in S; one without a rotation `turn` is in S."""
        return turn.inverse().apply(vectors) if self.world and turn is not None else vectors

    def passed(self, derivative: int) -> float:
        """Return the share of noise in the variance of a derivative."""
        return float(self.curve.passed[derivative]) if isinstance(self.curve, Smooth) else 1.0


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
        alpha = self._passed("angular_acceleration", "angular_velocity", "rotation")
        return alpha, self._passed("linear_acceleration", "linear_velocity", "position")

    def _passed(self, *quantities: str) -> float:
        """Return the share of noise in what the first of these that there is tells, each by one derivative more."""
        shares = (self.channels[q].passed(k) for k, q in enumerate(quantities) if q in self.channels)
        return next(shares, 1.0)

    def at(self, time: Array, delays: Delays) -> Motion:
        """Return the motion at `time` (M,) [s] of the common clock, by how late [s] each stream's stamps are."""
        turn, omega, alpha, alpha_variance = self._turning(time, delays)
        gravity, told = None, self.channels.get("gravity")
        if turn is not None:
            gravity = np.asarray(turn.inverse().matrix @ self.gravity_world)
        elif told is not None:
            gravity = told.at(time, delays)[0][:, 0]
        channel = self.channels.get("position")
        place = None if channel is None else channel.at(time, delays)
        velocity, acceleration, variance = self._moving(time, delays, turn, omega, place)
        measured = acceleration is not None
        if acceleration is None:
            acceleration = np.zeros_like(omega)
            guess = _UNKNOWN_LEVER * ((omega**2).sum(1) + np.linalg.norm(alpha, axis=1))
            variance = guess**2 / 3
        elif self.place.any():
            acceleration = acceleration - lever_acceleration(omega, alpha, self.place)
            variance = variance + float(self.place @ self.place) * alpha_variance
        position = self._position(place, turn)
        return Motion(gravity, turn, omega, alpha, velocity, acceleration, alpha_variance, variance, measured, position)

    def _position(self, place: tuple[Array, Array] | None, turn: Rotation | None) -> Array | None:
        """Return where (M, 3) [m] the S origin is in W; None without positions, or where only turns tell it."""
        if place is None or (turn is None and self.place.any()):
            return None
        told = place[0][:, 0]
        return told if turn is None else np.asarray(told - turn.apply(self.place))

    def _turning(self, time: Array, delays: Delays) -> tuple[Rotation | None, Array, Array, Array]:
        """Return rotation, angular velocity and acceleration (M, 3) in S, and the variance (M,) of the latter."""
        zero = np.zeros((len(time), 3))
        turn, omega, alpha, variance = None, zero, zero, np.zeros(len(time))
        if (channel := self.channels.get("rotation")) is not None:
            turn, omega, alpha, v = turning(*channel.at(time, delays))
            variance = v[:, 2]
        if (channel := self.channels.get("angular_velocity")) is not None:
            states, v = channel.at(time, delays)
            omega = channel.in_sensor(states[:, 0], turn)
            if states.shape[1] > 1:
                # The derivative of body components is the body angular acceleration, in W or S alike.
                alpha, variance = channel.in_sensor(states[:, 1], turn), v[:, 1]
        if (channel := self.channels.get("angular_acceleration")) is not None:
            states, v = channel.at(time, delays)
            alpha, variance = channel.in_sensor(states[:, 0], turn), v[:, 0]
        return turn, omega, alpha, variance

    def _moving(
        self, time: Array, delays: Delays, turn: Rotation | None, omega: Array, place: tuple[Array, Array] | None
    ) -> tuple[Array | None, Array | None, Array]:
        """Return velocity and classical acceleration (M, 3) in S, None where no channel tells it, and its variance."""
        velocity, acceleration, variance = None, None, np.zeros(len(time))
        if (channel := self.channels.get("linear_velocity")) is not None:
            states, v = channel.at(time, delays)
            velocity = channel.in_sensor(states[:, 0], turn)
            if states.shape[1] > 1:
                acceleration, variance = channel.in_sensor(states[:, 1], turn), v[:, 1]
                if not channel.world:
                    acceleration = acceleration + np.cross(omega, states[:, 0])
        if (channel := self.channels.get("linear_acceleration")) is not None:
            states, v = channel.at(time, delays)
            acceleration, variance = channel.in_sensor(states[:, 0], turn), v[:, 0]
        if turn is not None and place is not None and (velocity is None or acceleration is None):
            channel, (states, v) = self.channels["position"], place
            velocity = channel.in_sensor(states[:, 1], turn) if velocity is None else velocity
            if acceleration is None:
                acceleration, variance = channel.in_sensor(states[:, 2], turn), v[:, 2]
        return velocity, acceleration, variance


def kinematics(streams: tuple[Stream, ...], gravity_world: Array, cutoff_hz: float | None) -> Kinematics:
    """Smooth the motion channels of timed streams; of each quantity the first stream that has it counts.

    gravity_world  (3,) [m/s^2] in W

    Given accelerations are low-passed at `cutoff_hz` [Hz] only; given velocities are smoothed where the acceleration
    must come from them, positions always. Raises BadDescription when W-frame channels come without a rotation.
    """
    found = first_channels(streams)
    # Beside a given acceleration a position still tells the velocity, and with it what is at rest.
    smoothed = {"position", *(velocity for velocity, better in _BETTER.items() if better not in found)}
    channels = {q: _channel(*found[q], q, q in smoothed, cutoff_hz) for q in _QUANTITIES if q in found}
    for quantity, channel in channels.items():
        if channel.world and "rotation" not in channels and quantity != "position":
            raise no_rotation(quantity, channel.stream)
    spans = {s.name: (float(s.time[0]), float(s.time[-1])) for s in streams if s.time is not None}
    for channel in channels.values():
        start, end = spans[channel.stream]
        spans[channel.stream] = (max(start, channel.curve.start), min(end, channel.curve.end))
    return Kinematics(channels, gravity_world, spans)


def _channel(stream: Stream, values: Array, quantity: str, smoothed: bool, cutoff_hz: float | None) -> Channel:
    """Return one quantity of a timed stream as a curve, smoothed or low-passed alone."""
    time = stream.stamps
    if quantity == "rotation":
        return Channel(stream.name, smooth_rotations(time, Rotation.nearest(values), cutoff_hz), False)
    world = stream.in_world(quantity)
    if smoothed:
        return Channel(stream.name, smooth(time, values, cutoff_hz=cutoff_hz), world)
    curve = signal(time, values, cutoff_hz)
    return Channel(
        stream.name, curve, world, float((noise_std(values) ** 2).mean()) * noise_left(cutoff_hz, curve.rate)
    )
