"""A timed recording made ready for alignment: each stream as a function of its own time, in S."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadDescription
from steelyard.logs.clock import sampling_rate
from steelyard.logs.felt import Felt
from steelyard.logs.holes import unknown_motion
from steelyard.logs.imu import Imu, imu
from steelyard.logs.intervals import inside, merged
from steelyard.logs.kinematics import Kinematics, kinematics
from steelyard.logs.recording import Recording, Stream
from steelyard.logs.smoothing import SMEARED


@dataclass(frozen=True)
class AlignOptions:
    """How to align.

    cutoff_hz        [Hz] common low-pass; above it an arm and its load do not move as one body
    estimate_delays  look for delays that were not given; False counts them as none
    place            (3,) [m] in S, the point whose position, velocity or acceleration the poses give
    turn             (3,) [rad] rotation vector by which a wrench in S seems turned: delays are found without it
    touched          (start, end) [s] on the wrench clock, in order: a hand spoils the wrench, which tells no clock then
    """

    cutoff_hz: float = 40.0
    estimate_delays: bool = True
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    touched: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Prepared:
    """A timed recording, each stream as a function of its own time.

    clock, felt     (N,) raw samples of the wrench on the object
    known, unknown  delays that were given, and the streams whose delay is sought
    cutoff          [Hz] common low-pass, None where one stream tells everything on one clock
    holes           stream -> stamps (K, 2) [s] between which its motion is not known
    """

    recording: Recording
    options: AlignOptions
    clock: Array
    felt: Felt
    cutoff: float | None
    kinematics: Kinematics
    imu: Imu | None
    known: Mapping[str, float]
    unknown: tuple[str, ...]
    holes: Mapping[str, Array]

    @property
    def source(self) -> str:
        """Where the acceleration of S comes from."""
        return "specific_force" if self.imu is not None else self.kinematics.source

    def wrench(self, delays: Mapping[str, float]) -> Array:
        """Return the raw wrench (N, 6) in S; a delay that is not known counts as none."""
        turned = self.kinematics.at(self.clock, delays).rotation if self.felt.world else None
        return self.felt.in_sensor(turned)

    def spans(self) -> dict[str, tuple[float, float]]:
        """Return the first and last stamp of every stream that is used."""
        spans = {n: self.kinematics.spans[n] for n in self.kinematics.streams}
        if self.imu is not None:
            spans[self.imu.name] = (self.imu.signal.start, self.imu.signal.end)
        return spans

    def in_hands(self, time: Array) -> Mask:
        """Return at which times (N,) a hand is known to have touched the object."""
        return inside(time, np.array(self.options.touched).reshape(-1, 2))

    def covered(self, time: Array, delays: Mapping[str, float], reach: float = 0.0) -> Mask:
        """Return which times (N,) all streams cover, be they late by up to `reach` [s] more or less."""
        ok = np.ones(len(time), bool)
        for name, (start, end) in self.spans().items():
            stamp = time + delays.get(name, 0.0)
            ok &= (stamp >= start + reach - 1e-9) & (stamp <= end - reach + 1e-9)
            ok &= ~inside(stamp, merged(self.holes[name] + [-reach, reach]))
        return ok


def prepared(recording: Recording, options: AlignOptions) -> Prepared:
    """Smooth the motion and low-pass the rest."""
    source = _wrench_stream(recording)
    wrench = replace(source, time=source.sampled, delay=0.0)
    streams = tuple(wrench if s is source else s for s in recording.streams)
    cutoff = _cutoff(streams, wrench, options)
    moving = replace(kinematics(streams, recording.gravity, cutoff), place=np.array(options.place))
    feeling = next((s for s in streams if "specific_force" in s.channels), None)
    sensor = None
    if feeling is not None and "linear_acceleration" not in moving.channels:
        sensor = imu(feeling, cutoff)
    seen = {*moving.streams, *([sensor.name] if sensor is not None else [])}
    one_clock = cutoff is None or source.delay is not None or "specific_force" in source.channels
    clocks = [s for s in streams if s.name in (seen - {source.name} if one_clock else seen)]
    given = {s.name: s.delay for s in recording.streams}
    sought = [s.name for s in clocks if options.estimate_delays and given[s.name] is None]
    known = {s.name: s.delay or 0.0 for s in clocks if s.name not in sought}
    felt = Felt.of(wrench, recording.wrench_sign, recording.dead)
    # A low-pass smears what a smoother makes of a hole over its surroundings.
    smeared = 0.0 if cutoff is None else SMEARED / cutoff
    wider = np.array([-smeared, smeared])
    unseen = {s.name: unknown_motion(s) + wider for s in streams if s.name in seen}
    return Prepared(recording, options, wrench.stamps, felt, cutoff, moving, sensor, known, tuple(sought), unseen)


def _wrench_stream(recording: Recording) -> Stream:
    stream = recording.stream_of("force")
    if stream is None:
        raise BadDescription("no stream has force; a log needs force and torque.")
    if "torque" not in stream.channels:
        raise BadDescription(f"'{stream.name}' has force but no torque; give both in one stream.")
    return stream


def _cutoff(streams: tuple[Stream, ...], wrench: Stream, options: AlignOptions) -> float | None:
    """Return the common low-pass [Hz]: what the slower of wrench and quickest motion stream can follow."""
    given = {"linear_acceleration", "angular_acceleration"}
    if len(streams) == 1 and given <= set(wrench.channels):
        return None
    rates = {s.name: sampling_rate(s.stamps) for s in streams if s is not wrench}
    feeling = [rates[s.name] for s in streams if "specific_force" in s.channels and s is not wrench]
    rate = min(sampling_rate(wrench.stamps), feeling[0] if feeling else max(rates.values(), default=np.inf))
    return min(options.cutoff_hz, 0.4 * rate)
