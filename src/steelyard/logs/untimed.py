"""Tables without time: still poses, and rows whose order means nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription
from steelyard.findings import Finding
from steelyard.logs.felt import Felt
from steelyard.logs.imu import first_mount
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording, Stream, first_channels, no_rotation
from steelyard.logs.runs import stretches
from steelyard.spatial import Rotation

# Rows without a clock mostly stand in the order in which they were measured. Blocks of neighbours are left out in turn,
# so that errors which last from row to row show in the bars; in another order they say what single rows say.
BLOCKS = 20
NO_GRAVITY = "no stream tells where gravity points: give rotation, gravity or specific_force."
# Quantity -> the first stream that has it, and its values.
Found = Mapping[str, tuple[Stream, Array]]


def align_tables(recording: Recording) -> tuple[MotionLog, Rotation | None, tuple[Finding, ...], str]:
    """Return the log of streams without time, matched by row, the rotations, findings and the acceleration's source.

    A table of poses is at rest. Other rows keep the accelerations that were given; nothing is
    differentiated, and `clock-missing` says so.
    """
    streams = recording.streams
    lengths = {s.name: len(s) for s in streams}
    if len(set(lengths.values())) > 1:
        shown = ", ".join(f"'{n}' has {k}" for n, k in lengths.items())
        raise BadDescription(f"streams without time are matched by row, so they need one length; {shown} rows.")
    found = first_channels(streams)
    if "force" not in found or "torque" not in found:
        raise BadDescription("a log needs force and torque.")
    rotation = Rotation.nearest(found["rotation"][1]) if "rotation" in found else None
    force, torque = found["force"][0], found["torque"][0]
    merged = force if force is torque else Stream(force.name, {**force.channels, "torque": found["torque"][1]})
    wrench = Felt.of(merged, recording.wrench_sign).in_sensor(rotation)
    gravity = _gravity(recording.gravity, found, rotation, wrench)
    dead = np.array(recording.dead)
    if all(s.poses for s in streams):
        return replace(MotionLog.of_poses(wrench, gravity), dead=dead), rotation, (), "none"
    log = replace(_log_of_rows(found, wrench, gravity, rotation), dead=dead)
    names = ", ".join(f"'{s.name}'" for s in streams)
    given = [q for q in ("linear_acceleration", "angular_acceleration") if q in found]
    what = (
        f"{' and '.join(given)} used as given"
        if given
        else "every row taken as at rest, so that what moves the load looks like weight"
    )
    finding = Finding.of("clock-missing", f"{names} has no clock: no delay or derivative can be found; {what}.")
    return log, rotation, (finding,), "linear_acceleration" if "linear_acceleration" in found else "none"


def _gravity(gravity: Array, found: Found, rotation: Rotation | None, wrench: Array) -> Array:
    """Return gravity in S (N, 3) from the rotation, else the gravity channel, else an accelerometer at rest."""
    if rotation is not None:
        return np.asarray(rotation.inverse().matrix @ gravity)
    if "gravity" in found:
        stream, values = found["gravity"]
        return values if stream.turn is None else stream.turn.apply(values)
    if "specific_force" in found:
        stream, values = found["specific_force"]
        return -(stream.turn or first_mount(values, None, wrench[:, 3:])).apply(values)
    raise BadDescription(NO_GRAVITY)


def _log_of_rows(found: Found, wrench: Array, gravity: Array, rotation: Rotation | None) -> MotionLog:
    zero = np.zeros_like(gravity)
    motion = {}
    for quantity in ("linear_acceleration", "angular_velocity", "angular_acceleration"):
        motion[quantity] = zero
        if quantity in found:
            stream, motion[quantity] = found[quantity]
            if stream.in_world(quantity):
                if rotation is None:
                    raise no_rotation(quantity, stream.name)
                motion[quantity] = rotation.inverse().apply(motion[quantity])
    if motion["linear_acceleration"] is zero and "specific_force" in found:
        stream, values = found["specific_force"]
        if rotation is not None and stream.turn is not None:
            motion["linear_acceleration"] = stream.turn.apply(values) + gravity
    still = np.full(len(wrench), not any(m is not zero for m in motion.values()))
    blocks = stretches(len(wrench), BLOCKS)
    return MotionLog(
        wrench, gravity, motion["linear_acceleration"], motion["angular_velocity"],
        motion["angular_acceleration"], still=still, pose=blocks
    )  # fmt: skip
