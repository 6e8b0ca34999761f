"""Turning: a gyroscope's angular velocity beside that of the rotations, which shows in whose axes it is.

Read in the wrong axes it would give accelerations that no body felt.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, percent
from steelyard.logs.conditioning import lowpass
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.readings.glance import CUTOFF_HZ, angular_velocity, channel, resampled
from steelyard.spatial import Rotation

# As given more than the first share of the square of the angular velocity is unlike that of the rotations; as it was
# meant less than the second. A delay of 0.1 s leaves less.
UNLIKE, ALIKE = 0.25, 0.1
_RATE_HZ = 60.0
_FEWEST_ROWS = 60
_SECOND = 0.02  # of the largest: turns about one axis do not tell how a gyroscope sits


def examine_turning(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with the angular velocity in the axes in which it follows the rotations, and a finding."""
    given = next(channel(recording, "angular_velocity"), None)
    turned = next(channel(recording, "rotation"), None)
    both = None if given is None or turned is None else _side_by_side(given[0], turned[0])
    if given is None or both is None:
        return recording, ()
    stream, shown, rotation, omega = given[0], *both
    frame = stream.frames.get("angular_velocity", "S")
    in_axes = {"S": omega, "W": np.einsum("nij,nj->ni", rotation, omega)}
    other = "S" if frame == "W" else "W"
    unlike = _share(shown, in_axes[frame])
    if unlike < UNLIKE:
        return recording, ()
    if (left := _share(shown, in_axes[other])) < ALIKE:
        meant = replace(stream, frames={**stream.frames, "angular_velocity": other})
        text = f"The angular velocity of '{stream.name}' is in the axes of {other}, not of {frame}"
        finding = Finding("gravity-frame", _text(text, left, unlike), f'Set frame = "{other}" in its angular_velocity.')
        return _with(recording, stream, meant), (finding,)
    mount = _mount(shown, omega)
    if frame == "W" or mount is None or (left := _share(mount.apply(shown), omega)) > ALIKE:
        return recording, ()
    values = mount.apply(stream.channels["angular_velocity"])
    meant = replace(stream, channels={**stream.channels, "angular_velocity": values})
    text = f"The gyroscope of '{stream.name}' is turned by {np.degrees(float(mount.angle())):.1f} degrees against S"
    remedy = "Turn the angular velocity into the axes of S beforehand, or leave it out: the rotations tell it, too."
    return _with(recording, stream, meant), (Finding("imu-rotated", _text(text, left, unlike), remedy),)


def _side_by_side(given: Stream, turned: Stream) -> tuple[Array, Array, Array] | None:
    """Return the angular velocity (N, 3) as given, rotations (N, 3, 3) and theirs in S (N, 3), on one even clock."""
    if given.time is None or turned.time is None or min(len(given), len(turned)) < _FEWEST_ROWS:
        return None
    clocks = [np.asarray(s.time) - (s.delay or 0.0) for s in (given, turned)]
    start, end = max(float(t[0]) for t in clocks), min(float(t[-1]) for t in clocks)
    rows = int((end - start) * _RATE_HZ)
    if rows < _FEWEST_ROWS:
        return None
    grid: Array = np.asarray(start + (np.arange(rows) + 0.5) / _RATE_HZ, dtype=np.float64)
    rotation = resampled(clocks[1], turned.channels["rotation"], grid)
    shown = resampled(clocks[0], given.channels["angular_velocity"], grid)
    slow = lowpass(np.concatenate([shown, angular_velocity(rotation, _RATE_HZ)], 1), CUTOFF_HZ, _RATE_HZ, order=2)
    return slow[:, :3], rotation, slow[:, 3:]


def _share(shown: Array, meant: Array) -> float:
    """Return the share of the square of angular velocities (N, 3) that others leave."""
    size = float((shown**2).sum())
    return float(((shown - meant) ** 2).sum()) / size if size > 0 else 0.0


def _mount(shown: Array, omega: Array) -> Rotation | None:
    """Return the turn of the gyroscope's axes into S, None where the turns are about one axis."""
    match = omega.T @ shown
    sizes = np.linalg.svd(match, compute_uv=False)
    return Rotation.aligning(match) if sizes[1] > _SECOND * sizes[0] else None


def _text(what: str, left: float, unlike: float) -> str:
    return (
        f"{what}: so read, {percent(left)} of its square is unlike that of the rotations instead of {percent(unlike)}."
    )


def _with(recording: Recording, old: Stream, new: Stream) -> Recording:
    return replace(recording, streams=tuple(new if stream is old else stream for stream in recording.streams))
