"""Forces of a robot whose driver repeats its last value for a while: the sum of all is wrong by what it then pushed.

Numbers that a sensor measures do not come twice in a row on all axes, but for coarse ones at rest. They are judged as
they came: exact repeats.
Source: own.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.logs.clipping import LEFT_OUT, MOST_LEFT_OUT, TOO_MANY
from steelyard.logs.runs import lasting
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.team.clipped import WRENCH, without_wrench

# A force is frozen that holds still for so many rows and so long [s], where others repeat the row before in no more
# than this share.
ROWS, SECONDS, ELSEWHERE = 25, 0.25, 0.05


def without_frozen(log: TeamLog) -> tuple[TeamLog, tuple[Finding, ...]]:
    """Return the log without wrenches of recordings in motion that a driver repeated, and a finding for each robot.

    A force that is the same throughout, or nothing at all, is not asked for here.
    """
    recordings, found = [], list[Finding]()
    for recording in log.recordings:
        gone = {} if recording.kind == "still" else {n: _frozen(t) for n, t in recording.tracks.items()}
        gone = {name: rows for name, rows in gone.items() if rows.any()}
        for name, rows in gone.items():
            many = rows.mean() > MOST_LEFT_OUT
            text = f"The force of '{name}' stands still in {int(rows.sum())} of {len(rows)} rows of '{recording.name}'"
            found.append(Finding.of("channel-stuck", f"{text} and nowhere else; {TOO_MANY if many else LEFT_OUT}."))
        used = {n: rows for n, rows in gone.items() if rows.mean() <= MOST_LEFT_OUT}
        recordings.append(recording.changed(without_wrench, used))
    return (log.with_recordings(*recordings) if found else log), tuple(found)


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
    if not long.any() or long.all() or same[~long].mean() > ELSEWHERE:
        return none
    return np.asarray(np.concatenate([[False], long]) | np.concatenate([long, [False]]))
