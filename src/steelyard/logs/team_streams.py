"""Several streams of one robot, each on its own clock, become channels on one clock, in the axes of the grasp.

Frames: H, the robot's home frame; G, its grasp. A row that misses a number is NaN throughout.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadValue
from steelyard.logs.clock import median_step
from steelyard.logs.curve import Curve
from steelyard.logs.recording import Mount, Stream
from steelyard.logs.repeated_rows import repeats, rising
from steelyard.logs.team_rows import near_samples
from steelyard.spatial import Rotation, cross

# Whose clock is kept: what is differentiated is not to be interpolated.
_LEADING = ("joint_position", "rotation", "angular_velocity", "position")
_SAME = 1e-9  # [s]


def used_once(streams: Sequence[Stream]) -> tuple[list[Stream], int]:
    """Return streams with rising clocks, without rows that were logged more than once, and how many those were."""
    again = [repeats(stream)[0] for stream in streams]
    kept = [rising(stream.rows(~rows) if rows.any() else stream) for stream, rows in zip(streams, again, strict=True)]
    return kept, sum(int(rows.sum()) for rows in again)


def on_one_clock(streams: Sequence[Stream]) -> tuple[Array, dict[str, Array]]:
    """Return stamps (T,) [s] of the stream that tells the motion, and all channels there.

    Faster streams are averaged over a step of that clock, slower ones interpolated; where they have no samples near,
    rows are NaN. Delays that the streams declare are taken away. Raises BadValue for a stream without a clock.
    """
    clocks = [_clock(stream) for stream in streams]
    order = [k for name in _LEADING for k, stream in enumerate(streams) if name in stream.channels]
    time = clocks[order[0] if order else 0]
    channels = {
        name: _turns_at(own, values, time) if name == "rotation" else _values_at(own, values, time)
        for own, stream in zip(clocks, streams, strict=True)
        for name, values in stream.channels.items()
    }
    return time, channels


def in_grasp_axes(streams: Sequence[Stream], channels: Mapping[str, Array]) -> dict[str, Array]:
    """Return channels (T, ..), vectors given in H or in a mount's frame turned into G, moments moved to its origin.

    Raises BadValue where a channel in H has no rotation beside it.
    """
    out = dict(channels)
    for stream in streams:
        mount = stream.mount or Mount()
        for name in stream.channels:
            if name not in out:
                continue
            if stream.in_world(name) and name != "position":
                if "rotation" not in out:
                    raise BadValue(f'{stream.name}: {name} with frame = "W" needs the rotation of the grasp.')
                out[name] = np.einsum("tji,tj->ti", out["rotation"], out[name])
            elif mount.rotation is not None and name in ("force", "torque", "specific_force"):
                out[name] = mount.rotation.apply(out[name])
        if mount.position is not None and {"force", "torque"} <= stream.channels.keys():
            lever = np.broadcast_to(mount.position, out["force"].shape)
            out["torque"] = out["torque"] + cross(lever, out["force"])
    return out


def _clock(stream: Stream) -> Array:
    if stream.time is None:
        raise BadValue(f"{stream.name}: a stream of a team needs time.")
    return stream.sampled


def _turns_at(own: Array, values: Array, time: Array) -> Array:
    """Return rotations (M, 3, 3) at `time`, between samples along vectors away from their mean."""
    if _same(own, time):
        return values
    good = np.isfinite(values).all((1, 2))
    middle = Rotation.nearest(values[good].mean(0))
    vectors = np.full((len(own), 3), np.nan)
    vectors[good] = (middle.inverse() @ Rotation(values[good])).log()
    found = _values_at(own, vectors, time)
    turned = (middle @ Rotation.exp(np.nan_to_num(found))).matrix.copy()
    turned[np.isnan(found).any(1)] = np.nan
    return turned


def _values_at(own: Array, values: Array, time: Array) -> Array:
    """Return values (M, k) at `time` (M,), NaN where no two samples are near."""
    if _same(own, time):
        return values
    good = np.asarray(np.isfinite(values).all(1))
    known = own[good]
    if len(known) < 2:
        return np.full((len(time), values.shape[1]), np.nan)
    step = median_step(own)
    many = round(median_step(time) / step) if len(time) > 1 and step > 0 else 1
    found = Curve.through(known, _averaged(values, good, many)[good]).at(time)
    found[~near_samples(known, time, step)] = np.nan
    return found


def _averaged(values: Array, good: Mask, many: int) -> Array:
    """Return means over `many` rows, one more where that is even, about each row: they shift nothing in time."""
    if many < 2:
        return values
    window = np.ones(many | 1)
    filled = np.where(good[:, None], values, 0.0)
    count = np.maximum(np.convolve(good, window, "same"), 1)
    return np.stack([np.convolve(column, window, "same") / count for column in filled.T], axis=1)


def _same(own: Array, time: Array) -> bool:
    return len(own) == len(time) and bool(np.abs(own - time).max() < _SAME)
