"""Forces of a robot at the end of its sensor's range: what it pushed beyond is missing in the sum of all.

Each axis is judged over all recordings of a robot, on the numbers as they came: exact repeats of the extreme value.
Source: own.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    with_neighbours,
)
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track

WRENCH = ("force", "torque")


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
    if not any(lost):
        return log, tuple(found)
    recordings = [r.changed(without_wrench, gone) for r, gone in zip(log.recordings, lost, strict=True)]
    return log.with_recordings(*recordings), tuple(found)


def _clipped(name: str, tracks: Sequence[Track]) -> tuple[list[Finding], dict[int, Mask]]:
    """Return a finding for every axis of a robot that is cut off, and by track the rows (T,) to be left out."""
    measured = [track.valid["force"] for track in tracks]
    begins = np.cumsum([int(mask.sum()) for mask in measured])
    said, gone = list[tuple[str, int, float]](), np.zeros(begins[-1], np.bool_)
    for quantity in (q for q in WRENCH if all(q in track.channels for track in tracks)):
        values = np.concatenate([t.channels[quantity][mask] for t, mask in zip(tracks, measured, strict=True)])
        # An axis that is mostly cut off carries no noise itself.
        for axis in range(3) if (noise_shares(values) > NOISE_SHARE).any() else ():
            for extreme in _ends(values[:, axis]):
                rows = clipped_rows(values[:, axis], extreme, begins[:-1])
                if rows.any():
                    said.append((f"{quantity.capitalize()} {'xyz'[axis]} of '{name}' stops", int(rows.sum()), extreme))
                    gone |= rows
    many = gone.mean() > MOST_LEFT_OUT
    then = TOO_MANY if many else LEFT_OUT
    found = [
        Finding.of("channel-saturated", f"{what} at {extreme:.6g} in {rows} of {len(gone)} rows; {then}.")
        for what, rows, extreme in said
    ]
    return found, {} if many else _by_track(gone, measured, begins)


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


def without_wrench(track: Track, rows: Mask) -> Track:
    """Return the track without its wrench in rows (T,)."""
    valid = {q: mask & ~rows if q in WRENCH else mask for q, mask in track.valid.items()}
    return replace(track, valid=valid)
