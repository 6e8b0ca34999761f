"""Units and axes that the numbers of a channel themselves give away, whatever is held.

Gravity near one is in g, and a hand that moves at hundreds of metres per second is in millimetres. A gyroscope's
angular velocity stands beside that of the rotations, which shows in which axes and unit it is: read otherwise it would
give accelerations that no body felt. Where there are no rotations, the accelerometer of its stream shows how gravity
turns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription
from steelyard.findings import Finding, percent
from steelyard.logs.conditioning import lowpass
from steelyard.logs.imu import first_mount
from steelyard.logs.recording import STANDARD_GRAVITY, Recording, Stream
from steelyard.sanity.readings.glance import CUTOFF_HZ, angular_velocity, resampled
from steelyard.spatial import Rotation

# No arm moves its hand faster [m/s], or stands in poses further apart [m]: such numbers are millimetres.
FASTEST, FURTHEST = 10.0, 20.0
_MOST_PLACES = 2_000_000  # looked at, of positions over time
# A length of gravity in this range is one g, not metres per second squared.
ONE_G = (0.9, 1.1)
# What turns an accelerometer's numbers into m/s^2, where their size lies beside gravity, and what they then were.
_IN_G = (
    (STANDARD_GRAVITY, (0.07, 0.14), "its numbers are in g"),
    (1 / STANDARD_GRAVITY, (7.0, 14.0), "g was applied twice"),
)

# As given more than the first share of the square of the angular velocity is unlike that of the rotations; as it was
# meant less than the second. A delay of 0.1 s leaves less.
UNLIKE, ALIKE = 0.25, 0.1
# Beside an accelerometer: of the square of how gravity turns the gyroscope leaves less than this in the axes of the
# accelerometer, and in S more by UNLIKE. Accelerations of the arm leave the same of both.
FOLLOWED = 0.3
_DEGREE = np.pi / 180
_ABOUT = 0.2  # a gyroscope in another unit is that much off the rotations at most
_RATE_HZ = 60.0
_FEWEST_ROWS = 60
_SECOND = 0.02  # of the largest: turns about one axis do not tell how a gyroscope sits


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
    larger = stream.with_channels(**{quantity: stream.channels[quantity] * factor})
    return recording.changed(lambda s: larger if s is stream else s)


def _require_no_gravity(recording: Recording) -> None:
    """Raise BadDescription where a linear acceleration is as long as gravity most of the time: no arm moves so."""
    gravity = float(np.linalg.norm(recording.gravity))
    for stream, _, values in recording.channels("linear_acceleration"):
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
    for stream, quantity, values in recording.channels("gravity"):
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
    for stream, quantity, values in recording.channels("specific_force"):
        size = float(np.median(np.linalg.norm(values, axis=1)))
        for factor, (low, high), what in _IN_G:
            if low < size / gravity < high:
                message = (
                    f"The accelerometer of '{stream.name}' shows {size:.4g} m/s^2 in the median where gravity is "
                    f"{gravity:.4g}: {what}; multiplied by {factor:.4g}."
                )
                return scaled(recording, stream, quantity, factor), (Finding.of("gravity-in-g", message),)
    return recording, ()


def _positions(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    found = []
    checks: dict[str, Callable[[Stream, Array], str]] = {"position": _far, "linear_velocity": _fast}
    for quantity, judge in checks.items():
        for stream, _, values in list(recording.channels(quantity)):
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


def examine_turning(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with the angular velocity in the axes and unit in which it follows the rotations.

    Also returns a finding where those are not the ones that it was said to be in.
    """
    given = next(recording.channels("angular_velocity"), None)
    turned = next(recording.channels("rotation"), None)
    if given is not None and turned is None:
        return _beside_accelerometer(recording, given[0])
    both = None if given is None or turned is None else _side_by_side(given[0], turned[0])
    if given is None or both is None:
        return recording, ()
    stream, shown, rotation, omega = given[0], *both
    frame = "W" if stream.in_world("angular_velocity") else "S"
    unlike = _share(shown, omega if frame == "S" else _into_world(rotation, omega))
    if unlike < UNLIKE:
        return recording, ()
    factor, said, remedies = _unit(shown, omega)
    if (other := _axes(factor * shown, rotation, omega, frame)) is not None:
        left, meant = other
        if meant != frame:
            said.append(f"in the axes of {meant}, not of {frame}")
            remedies.append(f'frame = "{meant}"')
        text = f"The angular velocity of '{stream.name}' is {' and '.join(said)}"
        remedy = f"Set {' and '.join(remedies)} in its angular_velocity."
        return _read(recording, stream, factor, meant), (Finding("gravity-frame", _text(text, left, unlike), remedy),)
    mount = _mount(shown, omega)
    if frame == "W" or mount is None or (left := _share(mount.apply(factor * shown), omega)) > ALIKE:
        return recording, ()
    degrees = f"{np.degrees(float(mount.angle())):.1f} degrees"
    text = f"The gyroscope of '{stream.name}' is {' and '.join([*said, f'turned by {degrees} against S'])}"
    remedy = "Turn the angular velocity into the axes of S beforehand, or leave it out: the rotations tell it, too."
    return _read(recording, stream, factor, "S", mount), (Finding("imu-rotated", _text(text, left, unlike), remedy),)


def _into_world(rotation: Array, omega: Array) -> Array:
    return np.asarray(np.einsum("nij,nj->ni", rotation, omega))


def _unit(shown: Array, omega: Array) -> tuple[float, list[str], list[str]]:
    """Return what the angular velocity must be multiplied with to be as large as that of the rotations, and words."""
    ratio = float(np.sqrt((shown**2).sum() / max(float((omega**2).sum()), 1e-300)))
    for factor, is_in, read_as in ((_DEGREE, "deg/s", "rad/s"), (1 / _DEGREE, "rad/s", "deg/s")):
        if abs(ratio * factor - 1) < _ABOUT:
            return factor, [f"in {is_in}, not in {read_as}"], [f'unit = "{is_in}"']
    return 1.0, [], []


def _axes(shown: Array, rotation: Array, omega: Array, frame: str) -> tuple[float, str] | None:
    """Return the share that is left, and the axes in which an angular velocity is that of the rotations."""
    shares = {"S": _share(shown, omega), "W": _share(shown, _into_world(rotation, omega))}
    best = min(shares, key=lambda name: (shares[name] > ALIKE, name != frame))
    return (shares[best], best) if shares[best] < ALIKE else None


def _side_by_side(given: Stream, turned: Stream) -> tuple[Array, Array, Array] | None:
    """Return the angular velocity (N, 3) as given, rotations (N, 3, 3) and theirs in S (N, 3), on one even clock."""
    both = _on_one_clock((given, "angular_velocity"), (turned, "rotation"))
    if both is None:
        return None
    shown, rotation = both
    slow = lowpass(np.concatenate([shown, angular_velocity(rotation, _RATE_HZ)], 1), CUTOFF_HZ, _RATE_HZ, order=2)
    return slow[:, :3], rotation, slow[:, 3:]


def _on_one_clock(*channels: tuple[Stream, str]) -> list[Array] | None:
    """Return channels (N, ..) of streams with clocks in the same even steps, None where there are few."""
    if any(s.time is None or len(s) < _FEWEST_ROWS for s, _ in channels):
        return None
    clocks = [s.sampled for s, _ in channels]
    start, end = max(float(t[0]) for t in clocks), min(float(t[-1]) for t in clocks)
    rows = int((end - start) * _RATE_HZ)
    if rows < _FEWEST_ROWS:
        return None
    grid: Array = np.asarray(start + (np.arange(rows) + 0.5) / _RATE_HZ, dtype=np.float64)
    return [resampled(t, s.channels[name], grid) for t, (s, name) in zip(clocks, channels, strict=True)]


def _beside_accelerometer(recording: Recording, stream: Stream) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with the angular velocity in S where it is in the axes of its stream's accelerometer.

    One inertial unit has one set of axes, and its drivers write both in those: f' = -omega x f at rest, in them.
    """
    felt = recording.stream_of("force")
    if felt is None or "specific_force" not in stream.channels:
        return recording, ()
    if stream.in_world("angular_velocity") or felt.in_world("force"):
        return recording, ()
    rows = _on_one_clock((stream, "angular_velocity"), (stream, "specific_force"), (felt, "force"))
    if rows is None:
        return recording, ()
    force = recording.wrench_sign * (rows[2] if felt.turn is None else felt.turn.apply(rows[2]))
    mount = first_mount(rows[1], None, force) if stream.turn is None else stream.turn
    slow = lowpass(np.concatenate(rows[:2], 1), CUTOFF_HZ, _RATE_HZ, order=2)
    shown, pull = slow[:, :3], slow[:, 3:]
    change = np.gradient(pull, 1 / _RATE_HZ, axis=0)
    left, given = (_share(change, np.cross(pull, omega)) for omega in (shown, mount.inverse().apply(shown)))
    if left > FOLLOWED or given - left < UNLIKE:
        return recording, ()
    text = (
        f"The gyroscope of '{stream.name}' is in the axes of its accelerometer, turned by "
        f"{np.degrees(float(mount.angle())):.1f} degrees against S: so read, {percent(left)} of the square of how "
        f"gravity turns is left instead of {percent(given)}. The answer assumes this."
    )
    remedy = "Turn the angular velocity into the axes of S beforehand, or record orientations."
    return _read(recording, stream, 1.0, "S", mount), (Finding("imu-rotated", text, remedy),)


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


def _read(recording: Recording, old: Stream, factor: float, frame: str, mount: Rotation | None = None) -> Recording:
    """Return the recording with the angular velocity of a stream times a factor, in a frame, or turned into S."""
    values = factor * old.channels["angular_velocity"]
    new = old.with_channels(angular_velocity=values if mount is None else mount.apply(values))
    new = replace(new, frames={**old.frames, "angular_velocity": frame})
    return recording.changed(lambda stream: new if stream is old else stream)
