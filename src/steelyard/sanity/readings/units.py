"""Units that the numbers themselves give away: gravity near one, a hand that moves at hundreds of metres per second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription
from steelyard.findings import Finding
from steelyard.logs.imu import unit_factor
from steelyard.logs.recording import STANDARD_GRAVITY, Recording, Stream
from steelyard.sanity.readings.glance import channel

# No arm moves its hand faster [m/s], or stands in poses further apart [m]: such numbers are millimetres.
FASTEST, FURTHEST = 10.0, 20.0
# A length of gravity in this range is one g, not metres per second squared.
_MOST_PLACES = 2_000_000  # looked at, of positions over time
ONE_G = (0.9, 1.1)


def examine_units(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with gravity in m/s^2 and lengths in m where the numbers leave no doubt, and findings.

    Raises BadDescription where an acceleration holds gravity.
    """
    _require_no_gravity(recording)
    found: list[Finding] = []
    for step in (_gravity, _gravity_channel, _specific_force, _positions):
        recording, findings = step(recording)
        found.extend(findings)
    return recording, tuple(found)


def scaled(recording: Recording, stream: Stream, quantity: str, factor: float) -> Recording:
    """Return the recording with one channel of one stream multiplied by `factor`."""
    changed = replace(stream, channels={**stream.channels, quantity: stream.channels[quantity] * factor})
    return replace(recording, streams=tuple(changed if s is stream else s for s in recording.streams))


def _require_no_gravity(recording: Recording) -> None:
    """Raise BadDescription where a linear acceleration is as long as gravity most of the time: no arm moves so."""
    gravity = float(np.linalg.norm(recording.gravity))
    for stream, _, values in channel(recording, "linear_acceleration"):
        size = float(np.median(np.linalg.norm(values, axis=1)))
        if gravity > ONE_G[1] and ONE_G[0] * gravity < size < ONE_G[1] * gravity:
            raise BadDescription(
                f"linear_acceleration of '{stream.name}' is {size:.4g} m/s^2 long in the median, as gravity is: it "
                "holds gravity, as what accelerometers read does (and MuJoCo's framelinacc). Give an accelerometer as "
                "specific_force, in its own axes, or leave linear_acceleration out where there are positions."
            )


def _gravity(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    size = float(np.linalg.norm(recording.gravity))
    if not ONE_G[0] < size < ONE_G[1]:
        return recording, ()
    message = f"[log] gravity has the length {size:.3g}, so it is in g; it was multiplied by {STANDARD_GRAVITY} m/s^2."
    recording = replace(recording, gravity=recording.gravity * (STANDARD_GRAVITY / size))
    return recording, (Finding.of("gravity-in-g", message),)


def _gravity_channel(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    for stream, quantity, values in channel(recording, "gravity"):
        size = float(np.median(np.linalg.norm(values, axis=1)))
        if ONE_G[0] < size < ONE_G[1]:
            message = (
                f"Gravity in '{stream.name}' has the length {size:.3g}, so it is in g; it was multiplied by "
                f"{STANDARD_GRAVITY}."
            )
            return scaled(recording, stream, quantity, STANDARD_GRAVITY), (Finding.of("gravity-in-g", message),)
    return recording, ()


def _specific_force(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    gravity = float(np.linalg.norm(recording.gravity))
    if gravity <= 0:
        return recording, ()
    for stream, quantity, values in channel(recording, "specific_force"):
        factor = unit_factor(values, gravity)
        if factor != 1.0:
            size = float(np.median(np.linalg.norm(values, axis=1)))
            message = (
                f"The accelerometer of '{stream.name}' shows {size:.4g} m/s^2 in the median where gravity is "
                f"{gravity:.4g}: {'its numbers are in g' if factor > 1 else 'g was applied twice'}; multiplied by "
                f"{factor:.4g}."
            )
            return scaled(recording, stream, quantity, factor), (Finding.of("gravity-in-g", message),)
    return recording, ()


def _positions(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    found = []
    checks: dict[str, Callable[[Stream, Array], str]] = {"position": _far, "linear_velocity": _fast}
    for quantity, judge in checks.items():
        for stream, _, values in list(channel(recording, quantity)):
            why = judge(stream, values)
            if why:
                recording = scaled(recording, stream, quantity, 1e-3)
                name = quantity.replace("_", " ")
                message = f"The {name} in '{stream.name}' {why}: no arm does that in metres; taken as millimetres."
                found.append(Finding.of("length-in-mm", message))
    return recording, tuple(found)


def _far(stream: Stream, values: Array) -> str:
    """Say how positions (N, 3) are too far apart or too fast to be metres; empty where they are not."""
    if stream.time is None:
        spread = float(np.linalg.norm(np.ptp(values, axis=0)))
        return f"spreads over {spread:.4g} m" if spread > FURTHEST else ""
    span = float(stream.time[-1] - stream.time[0])
    grid = np.linspace(stream.time[0], stream.time[-1], min(max(int(span * 20), 2), _MOST_PLACES))
    where = np.stack([np.interp(grid, stream.time, column) for column in values.T], 1)
    speed = np.linalg.norm(np.diff(where, axis=0), axis=1) / max(float(grid[1] - grid[0]), 1e-9)
    top = float(np.quantile(speed, 0.98))
    return f"moves at {top:.4g} m/s" if top > FASTEST else ""


def _fast(stream: Stream, values: Array) -> str:
    top = float(np.quantile(np.linalg.norm(values, axis=1), 0.98))
    return f"reaches {top:.4g} m/s" if top > FASTEST else ""
