"""Wrenches of a robot that nobody measured: beyond the end of its sensor's range, repeated by its driver, or stuck.

The sum over all robots is wrong by what it then pushed. Numbers are judged as they came, by exact repeats: of the
extreme value of an axis over all recordings, or of whole rows one after the other, which those that a sensor measures
are not, but for coarse ones at rest. A force that is the same throughout is named; nothing else can be done about it.
Source: own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding, quoted
from steelyard.logs.clipping import (
    LEFT_OUT,
    MOST_LEFT_OUT,
    NOISE_SHARE,
    TOO_MANY,
    clipped_rows,
    noise_shares,
    saturated,
    with_neighbours,
)
from steelyard.logs.runs import around, lasting
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track

WRENCH = ("force", "torque")
# A force is frozen that holds still for so many rows and so long [s], where others repeat the row before in no more
# than this share.
ROWS, SECONDS, BESIDE = 25, 0.25, 0.05
FEWEST = 50  # rows in which noise shows
VALUES = 10  # different numbers that noise has at the least


def without_frozen(log: TeamLog) -> tuple[TeamLog, tuple[Finding, ...]]:
    """Return the log without wrenches of recordings in motion that a driver repeated, and a finding for each robot.

    A force that is the same throughout, or nothing at all, is not asked for here.
    """
    found: list[Finding] = []
    lost: list[dict[str, Mask]] = [{} for _ in log.recordings]
    for recording, gone in zip(log.recordings, lost, strict=True):
        for name, track in recording.tracks.items() if recording.kind != "still" else ():
            rows = _frozen(track)
            if rows.any():
                what = f"stands still in {int(rows.sum())} of {len(rows)} rows of '{recording.name}' and nowhere else"
                found.append(Finding.of("channel-stuck", f"The force of '{name}' {what}; {_done(rows)}."))
                if rows.mean() <= MOST_LEFT_OUT:
                    gone[name] = rows
    return _without(log, lost), tuple(found)


def _frozen(track: Track) -> Mask:
    """Return the rows (T,) in which every axis of force and torque repeats the row before, or is repeated, for long."""
    none = np.zeros(len(track), np.bool_)
    if not track.has("force") or len(track) < 4 * ROWS:
        return none
    good = track.valid["force"]
    values: Array = np.concatenate([track.channels[name] for name in WRENCH if name in track.channels], axis=1)
    same = (values[1:] == values[:-1]).all(1) & good[1:] & good[:-1] & values[1:].any(1)
    if not same.any():
        return none
    rate = (len(track) - 1) / max(float(track.time[-1] - track.time[0]), 1e-9)
    long = lasting(same, max(ROWS, SECONDS * rate))
    if not long.any() or long.all() or same[~long].mean() > BESIDE:
        return none
    return around(long)


def without_clipped(log: TeamLog) -> tuple[TeamLog, tuple[Finding, ...]]:
    """Return the log without wrenches that a sensor cut off, and a `channel-saturated` for each such axis."""
    found: list[Finding] = []
    lost: list[dict[str, Mask]] = [{} for _ in log.recordings]
    for name in log.names:
        places = [k for k, r in enumerate(log.recordings) if name in r.tracks and r.tracks[name].has("force")]
        tracks = [log.recordings[k].tracks[name] for k in places]
        if tracks:
            told, rows = _clipped(name, tracks)
            found.extend(told)
            for k, mask in rows.items() if told else ():
                lost[places[k]][name] = mask
    return _without(log, lost), tuple(found)


def _clipped(name: str, tracks: Sequence[Track]) -> tuple[list[Finding], dict[int, Mask]]:
    """Return a finding for every axis of a robot that is cut off, and by track the rows (T,) to be left out."""
    measured = [track.valid["force"] for track in tracks]
    begins = np.cumsum([int(mask.sum()) for mask in measured])
    said, gone = list[tuple[str, int, float, int]](), np.zeros(begins[-1], np.bool_)
    for quantity in (q for q in WRENCH if all(q in track.channels for track in tracks)):
        values = np.concatenate([t.channels[quantity][mask] for t, mask in zip(tracks, measured, strict=True)])
        # An axis that is mostly cut off carries no noise itself.
        for axis in range(3) if (noise_shares(values) > NOISE_SHARE).any() else ():
            column = values[:, axis]
            for extreme in (float(column.min()), float(column.max())):
                rows = clipped_rows(column, extreme, begins[:-1])
                # Of a robot that pushes nothing at all nothing is no limit.
                if extreme and rows.any():
                    said.append((quantity, axis, extreme, int(rows.sum())))
                    gone |= rows
    found = [saturated(name, *each, len(gone), _done(gone)) for each in said]
    return found, {} if gone.mean() > MOST_LEFT_OUT else _by_track(gone, measured, begins)


def _by_track(gone: Mask, measured: Sequence[Mask], begins: Integers) -> dict[int, Mask]:
    """Return by track the rows (T,) that are gone among those measured in all of them, and those beside them."""
    out = {}
    for k, (mask, rows) in enumerate(zip(measured, np.split(gone, begins[:-1]), strict=True)):
        if rows.any():
            out[k] = np.zeros(len(mask), np.bool_)
            out[k][mask] = with_neighbours(rows)
    return out


def _done(rows: Mask) -> str:
    """Say what is done with these rows among all (T,)."""
    return TOO_MANY if rows.mean() > MOST_LEFT_OUT else LEFT_OUT


def _without(log: TeamLog, lost: Sequence[Mapping[str, Mask]]) -> TeamLog:
    """Return the log without the wrenches of these rows (T,), by robot, of every recording."""
    if not any(lost):
        return log
    return log.with_recordings(
        *(r.changed(_without_wrench, gone) for r, gone in zip(log.recordings, lost, strict=True))
    )


def _without_wrench(track: Track, rows: Mask) -> Track:
    valid = {q: mask & ~rows if q in WRENCH else mask for q, mask in track.valid.items()}
    return replace(track, valid=valid)


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
    where = quoted(r.name for r in resting) if len(resting) < 3 else f"all {len(resting)} poses at rest"
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
