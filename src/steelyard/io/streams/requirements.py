"""What every log must hold before an answer can be sought: wrench, gravity, rows that match."""

from __future__ import annotations

from collections.abc import Sequence

from steelyard.errors import BadDescription, BadValue
from steelyard.io.streams.entries import StreamSpec
from steelyard.logs.recording import QUANTITIES, Stream


def require_answerable(specs: Sequence[StreamSpec], name: str) -> None:
    """Raise BadDescription where quantities that every answer needs are missing, or one is given twice."""
    given = [quantity for spec in specs for quantity in spec.names]
    given += ["rotation"] * given.count("joint_position")
    for quantity in given:
        if given.count(quantity) > 1:
            raise BadDescription(f'{name}: "{quantity}" is given by {given.count(quantity)} streams. Give it in one.')
    shown = ", ".join(quantity for quantity in QUANTITIES if quantity in given)
    missing = [quantity for quantity in ("force", "torque") if quantity not in given]
    if missing:
        raise BadDescription(
            f"{name}: no {' and no '.join(missing)} is given, only {shown}. An answer needs the wrench: "
            'force and torque (torque = "zero" for a passive gimbal).'
        )
    if not {"rotation", "gravity", "specific_force"} & set(given):
        raise BadDescription(
            f"{name}: nothing says where gravity points in the sensor frame; given are {shown}. "
            "Add rotation (S to W), joint_position with a URDF, gravity (in S) or specific_force (an accelerometer)."
        )


def require_matched_rows(streams: Sequence[Stream], name: str) -> None:
    """Raise where streams without a clock stand beside others that they cannot be matched with by row."""
    still = [stream for stream in streams if stream.time is None]
    if not still or len(streams) == 1:
        return
    if len(still) < len(streams):
        timed = next(stream for stream in streams if stream.time is not None)
        raise BadDescription(
            f'{name}: stream "{still[0].name}" has no time and "{timed.name}" has one, '
            "so their rows cannot be matched. Give time to all streams or to none."
        )
    if len({len(stream) for stream in streams}) > 1:
        shown = ", ".join(f'"{stream.name}" {len(stream)}' for stream in streams)
        raise BadValue(f"{name}: streams without time are matched by row, but their lengths differ: {shown} rows.")
