"""Numbers that cannot have been measured: two robots with the same ones, and a force that never changes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track

FEWEST = 50  # rows in which noise shows
VALUES = 10  # different numbers that noise has at the least
COMPARED = 64  # rows of a recording that are enough to tell two robots apart


def require_own_numbers(log: TeamLog) -> None:
    """Raise BadValue where two robots have the same numbers in a recording: one file was given twice."""
    for recording in log.recordings:
        moving = {n: t for n, t in recording.tracks.items() if t.has("force") and len(t) >= FEWEST}
        for first, second in combinations(moving, 2):
            if _alike(moving[first], moving[second]):
                raise BadValue(
                    f"'{first}' and '{second}' have the same numbers in '{recording.name}': one file is given for "
                    'both. Correct the "path" of one of them.'
                )


def stuck_forces(log: TeamLog) -> Iterator[Finding]:
    """Yield a finding for every robot whose force is the same in all rows: the sum of forces is wrong by it.

    Each recording in motion is judged by itself, all poses at rest together.
    """
    places: dict[str, dict[str, list[tuple[str, int]]]] = {name: {} for name in log.names}
    for recording in log.recordings:
        if recording.kind != "still":
            for name, track in recording.tracks.items():
                force = _carried([track])
                _noted(places[name], _same(force), f"'{recording.name}'", len(force))
    resting = [recording for recording in log.recordings if recording.kind == "still"]
    where = " and ".join(f"'{r.name}'" for r in resting) if len(resting) < 3 else f"all {len(resting)} poses at rest"
    forces = {name: _carried([r.tracks[name] for r in resting if name in r.tracks]) for name in log.names}
    for name, axes in _stuck_at_rest(forces).items():
        _noted(places[name], axes, where, len(forces[name]))
    for name, found in places.items():
        for axis, seen in found.items():
            yield _stuck(name, axis, seen)


def _stuck_at_rest(forces: Mapping[str, Array]) -> dict[str, Mask]:
    """Return which axes (3,) of each robot's force (T, 3) stand still in all poses at rest.

    Coarse or exact numbers may well do so: the robot's other axes, or the others' where all its own stand still, must
    show noise. A force of nothing at all does not carry.
    """
    out = {name: _same(force) for name, force in forces.items()}
    for name, still in out.items():
        if still.any() and forces[name].any():
            beside = forces.values() if still.all() else [forces[name]]
            still &= any(len(np.unique(axis)) > VALUES for force in beside for axis in force.T)
    return out


def _same(force: Array) -> Mask:
    """Return which axes (3,) of a force (T, 3) are the same in all of enough rows; the first rows mostly decide."""
    if len(force) < FEWEST or (force[:FEWEST] != force[0]).any(0).all():
        return np.zeros(3, np.bool_)
    return np.asarray((force == force[0]).all(0))


def _carried(tracks: Sequence[Track]) -> Array:
    """Return the forces (T, 3) of the rows in which a robot may carry."""
    rows = [np.zeros((0, 3))]
    for track in tracks:
        if track.has("force"):
            valid = track.valid["force"] if track.carrying is None else track.valid["force"] & track.carrying
            rows.append(track.channels["force"] if valid.all() else track.channels["force"][valid])
    return rows[1] if len(rows) == 2 else np.concatenate(rows)


def _noted(places: dict[str, list[tuple[str, int]]], axes: Mask, where: str, rows: int) -> None:
    if axes.any():
        found = ", ".join(axis for axis, still in zip("xyz", axes, strict=True) if still)
        places.setdefault(found, []).append((where, rows))


def _stuck(name: str, axes: str, places: Sequence[tuple[str, int]]) -> Finding:
    """Return channel-stuck for axes of a robot's force in places, each with its number of rows."""
    rows = sum(count for _, count in places)
    text = (
        f"Force {axes} of '{name}' is the same in all {rows} rows of {' and '.join(where for where, _ in places)}. "
        "If the robot did carry, mass, centre of mass and inertia are wrong by what it carried."
    )
    remedy = (
        f"Check the cable and the driver of the force sensor of '{name}', and record again. Say away = true in the "
        "recordings in which it held nothing."
    )
    return Finding("channel-stuck", text, remedy)


def _alike(first: Track, second: Track) -> bool:
    """Return whether two robots measured the same, to the last digit, in rows all over a recording."""
    if len(first) != len(second) or first.channels.keys() != second.channels.keys():
        return False
    rows = slice(None, None, max(1, len(first) // COMPARED))
    return all(np.array_equal(first.channels[name][rows], second.channels[name][rows]) for name in first.channels)
