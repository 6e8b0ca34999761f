"""Mistakes made on purpose in a Recording that was read, and the one code that names each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from steelyard.logs.misread import rolled
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.readings.glance import in_axes
from steelyard.spatial import Rotation

Edit = Callable[[Recording], Recording]


def edited(recording: Recording, **changes: Callable[[np.ndarray], np.ndarray]) -> Recording:
    """Return the recording with some quantities changed."""

    def change(stream: Stream) -> Stream:
        channels = {q: changes[q](v) if q in changes else v for q, v in stream.channels.items()}
        return replace(stream, channels=channels)

    return replace(recording, streams=tuple(change(s) for s in recording.streams))


def tilted(recording: Recording, *degrees: float) -> Recording:
    """Return the recording with gravity turned in W by roll, pitch, yaw."""
    return replace(recording, gravity=Rotation.from_rpy(np.radians(degrees)).apply(recording.gravity))


def repeated(recording: Recording, new_stamps: bool) -> Recording:
    """Return the recording with rows written twice, so that 30 % of all rows are repeats."""
    rng = np.random.default_rng(3)

    def twice(stream: Stream) -> Stream:
        rows = len(stream)
        index = np.sort(np.concatenate([np.arange(rows), rng.choice(rows, int(0.43 * rows), replace=False)]))
        time = None
        if stream.time is not None:
            time = stream.time[index].copy()
            again = np.diff(index, prepend=-1) == 0
            time[again] += 0.4 * np.median(np.diff(stream.time)) if new_stamps else 0.0
        return replace(stream, channels={q: v[index] for q, v in stream.channels.items()}, time=time)

    return replace(recording, streams=tuple(twice(s) for s in recording.streams))


def delayed(recording: Recording, quantity: str, seconds: float) -> Recording:
    """Return the recording with the stamps of the streams that hold `quantity` later."""
    streams = tuple(
        replace(s, time=s.time + seconds) if s.time is not None and quantity in s.channels else s
        for s in recording.streams
    )
    return replace(recording, streams=streams)


def clipped(recording: Recording) -> Recording:
    """Return the recording with the force cut at its 90 % quantile in the axis that moves most."""

    def cut(force: np.ndarray) -> np.ndarray:
        axis = int(force.std(0).argmax())
        out = force.copy()
        out[:, axis] = np.minimum(out[:, axis], np.quantile(out[:, axis], 0.9))
        return out

    return edited(recording, force=cut)


def exchanged(recording: Recording) -> Recording:
    """Return the recording with force and torque in each other's columns."""
    other = {"force": "torque", "torque": "force"}
    streams = (replace(s, channels={other.get(q, q): v for q, v in s.channels.items()}) for s in recording.streams)
    return replace(recording, streams=tuple(streams))


def reread(recording: Recording, misread: Callable[[Rotation], Rotation]) -> Recording:
    """Return the recording with its rotations as somebody misreads them."""
    return edited(recording, rotation=lambda v: misread(Rotation.nearest(v)).matrix)


def in_base_axes(recording: Recording) -> Recording:
    """Return the recording with force and torque turned into W, still said to be in S."""
    poses = next(s for s in recording.streams if "rotation" in s.channels)

    def turned(stream: Stream) -> Stream:
        felt = [q for q in ("force", "torque") if q in stream.channels]
        if not felt:
            return stream
        rows = np.arange(len(stream))
        if stream.time is not None and poses.time is not None:
            rows = np.minimum(np.searchsorted(poses.time, stream.time), len(poses) - 1)
        rotation = poses.channels["rotation"][rows]
        changed = {q: np.einsum("nij,nj->ni", rotation, stream.channels[q]) for q in felt}
        return replace(stream, channels={**stream.channels, **changed})

    return replace(recording, streams=tuple(turned(s) for s in recording.streams))


TRAPS: dict[str, tuple[Edit, str]] = {
    "sign": (lambda r: replace(r, wrench_sign=-r.wrench_sign), "wrench-sign-flipped"),
    "gravity up": (lambda r: replace(r, gravity=-r.gravity), "gravity-frame"),
    "gravity along y": (lambda r: replace(r, gravity=r.gravity[[0, 2, 1]]), "gravity-frame"),
    "gravity along x": (lambda r: replace(r, gravity=-r.gravity[[2, 1, 0]]), "gravity-frame"),
    "transposed": (lambda r: edited(r, rotation=lambda v: np.swapaxes(v, 1, 2)), "gravity-frame"),
    "gravity in g": (lambda r: replace(r, gravity=r.gravity / 9.82), "gravity-in-g"),
    "w first": (lambda r: edited(r, rotation=lambda v: rolled(v, 1)), "quaternion-order"),
    "w last": (lambda r: edited(r, rotation=lambda v: rolled(v, -1)), "quaternion-order"),
    "radians as degrees": (lambda r: reread(r, lambda R: Rotation.from_rpy(np.radians(R.rpy()))), "gravity-frame"),
    "rotation vector, radians as degrees": (
        lambda r: reread(r, lambda R: Rotation.exp(np.radians(R.log()))),
        "gravity-frame",
    ),
    "wrench in W": (in_base_axes, "gravity-frame"),
    "wrench said to be in W": (lambda r: in_axes(r, ("force", "torque")), "gravity-frame"),
    "rotation vector as rpy": (lambda r: reread(r, lambda R: Rotation.from_rpy(R.log())), "gravity-frame"),
    "yaw, pitch, roll": (lambda r: reread(r, lambda R: Rotation.from_rpy(R.rpy()[..., ::-1])), "gravity-frame"),
    "moving axes": (lambda r: reread(r, lambda R: Rotation.from_rpy(-R.inverse().rpy())), "gravity-frame"),
    "torque in N mm": (lambda r: edited(r, torque=lambda v: 1000 * v), "length-in-mm"),
    "force in kN": (lambda r: edited(r, force=lambda v: v / 1000), "force-unit"),
    "force and torque exchanged": (exchanged, "force-unit"),
    "rows twice, same stamps": (lambda r: repeated(r, False), "rows-duplicated"),
    "rows twice, new stamps": (lambda r: repeated(r, True), "rows-duplicated"),
    "tilt 20": (lambda r: tilted(r, 20, 0, 0), "base-tilted"),
    "tilt -20": (lambda r: tilted(r, -20, 0, 0), "base-tilted"),
    "clipped": (clipped, "channel-saturated"),
}
TIMED_TRAPS: dict[str, tuple[Edit, str]] = {
    "tilt along the turning axis": (lambda r: tilted(r, 0, 20, 0), "base-tilted"),
    "accelerometer in g": (lambda r: edited(r, specific_force=lambda v: v / 9.82), "gravity-in-g"),
    "accelerometer in g twice": (lambda r: edited(r, specific_force=lambda v: v * 9.82), "gravity-in-g"),
}
