"""Wrenches of a robot that nobody measured: beyond the end of its sensor's range, or repeated by its driver.

The sum over all robots is wrong by what it then pushed. Numbers are judged as they came, by exact repeats: of the
extreme value of an axis over all recordings, or of whole rows one after the other, which those that a sensor measures
are not, but for coarse ones at rest.
Source: own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding
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
            for extreme in _ends(values[:, axis]):
                rows = clipped_rows(values[:, axis], extreme, begins[:-1])
                if rows.any():
                    said.append((quantity, axis, extreme, int(rows.sum())))
                    gone |= rows
    found = [saturated(name, *each, len(gone), _done(gone)) for each in said]
    return found, {} if gone.mean() > MOST_LEFT_OUT else _by_track(gone, measured, begins)


def _ends(column: Array) -> tuple[float, ...]:
    """Return the extreme values of a channel; that of a robot which pushes nothing at all is no limit."""
    return tuple(float(end) for end in (column.min(), column.max()) if end != 0)


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
