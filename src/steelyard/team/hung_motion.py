"""A robot whose driver repeated its last pose while the arm moved on: its grasp seems to slip, or its clock to be late.

Judged, as for one arm, on all that a robot says of its motion, recording by recording: rows are hung that repeat the
one before for long, where others do not, and are followed by a jump, or by nothing while other robots move on. Rests
that repeat exactly end without a jump.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.logs.clipping import LEFT_OUT, MOST_LEFT_OUT, TOO_MANY
from steelyard.logs.hung import JUMPS, hung
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import CHANNELS, Track
from steelyard.team.lost_wrenches import WRENCH

MOTION = tuple(name for name in CHANNELS if name not in WRENCH)
# A driver hangs for so many rows and so long [s].
ROWS, SECONDS = 10, 0.25
# [s] Clocks that are farther apart do not tell what happens meanwhile.
CLOCKS_S = 2.0


def without_hung(log: TeamLog) -> tuple[TeamLog, tuple[Finding, ...]]:
    """Return the log without what robots said of their motion while they repeated it, and a finding for each."""
    found: list[Finding] = []
    lost: list[dict[str, Mask]] = [{} for _ in log.recordings]
    for recording, gone in zip(log.recordings, lost, strict=True):
        for name in recording.tracks if recording.kind != "still" else ():
            rows = _hung(name, recording)
            if rows.any():
                many = rows.mean() > MOST_LEFT_OUT
                text = (
                    f"The motion of '{name}' stands still in {int(rows.sum())} of {len(rows)} rows of "
                    f"'{recording.name}' while the arm goes on; {TOO_MANY if many else LEFT_OUT}."
                )
                found.append(Finding.of("channel-stuck", text))
                if not many:
                    gone[name] = rows
    if not any(lost):
        return log, tuple(found)
    kept = (r.changed(_without_motion, gone) for r, gone in zip(log.recordings, lost, strict=True))
    return log.with_recordings(*kept), tuple(found)


def _hung(name: str, recording: TeamRecording) -> Mask:
    """Return the rows (T,) in which a robot repeats its motion, which then jumps or is not told any more."""
    track = recording.tracks[name]
    measured, time, values = _motion(track)
    rows = np.zeros(len(track), np.bool_)
    if len(time) < 4 * ROWS or not values.shape[1]:
        return rows
    changed = np.flatnonzero((values != values[-1]).any(1))
    since = float(time[changed[-1]] if len(changed) else time[0]) + CLOCKS_S
    others = (_motion(other)[1:] for each, other in recording.tracks.items() if each != name)
    meanwhile = (there[(stamps > since) & (stamps < time[-1] + CLOCKS_S)] for stamps, there in others)
    if any(_moves(there) for there in meanwhile):
        values = np.concatenate([values, np.full_like(values[:1], np.inf)])  # it would jump if it went on
    rows[measured] = hung(values, max(ROWS, SECONDS / track.step))[0][: len(time)]
    return rows


def _motion(track: Track) -> tuple[Mask, Array, Array]:
    """Return the rows (T,) in which a robot tells its motion, and of these the stamps (M,) and all it says (M, K)."""
    names = [name for name in MOTION if name in track.channels]
    measured = track.mask(*names)
    columns = [np.zeros((len(track), 0)), *(track.channels[name].reshape(len(track), -1) for name in names)]
    return measured, track.time[measured], np.concatenate(columns, axis=1)[measured]


def _moves(values: Array) -> bool:
    """Return whether values (M, K) are elsewhere at their end, by far more than from row to row."""
    if len(values) < ROWS:
        return False
    typical = np.median(np.abs(np.diff(values, axis=0)), axis=0)
    return bool((np.abs(values[-1] - values[0]) > JUMPS * typical).any())


def _without_motion(track: Track, rows: Mask) -> Track:
    valid = {q: mask if q in WRENCH else mask & ~rows for q, mask in track.valid.items()}
    return replace(track, valid=valid)
