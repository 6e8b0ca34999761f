"""What the log of a team lacks: rows, numbers in rows, wrenches, and rows that were logged again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from steelyard.check import Mask
from steelyard.findings import Finding, counted
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_rows import common_time
from steelyard.logs.team_track import Track

# Share of its rows from which on a robot is said to have lost some.
ABSENT = 0.1
# A robot is said to have begun late or ended early where that costs so much, and so long [s], of what all others have.
SHORT, SHORT_S = 0.25, 1.0
# Streams of one robot begin and end within this time [s].
ENDS_S = 0.25


def repeated_rows(log: TeamLog) -> Iterator[Finding]:
    """Yield a finding for every robot of which rows were logged more than once."""
    for name in log.names:
        said = [f"{counted(t.repeated, 'row')} of '{r.name}'" for r, t in log.tracks_of(name) if t.repeated]
        if said:
            text = f"{', '.join(said)} of '{name}' repeat the row before in every channel; each was used once."
            yield Finding.of("rows-duplicated", text)


def missing_rows(log: TeamLog) -> Iterator[Finding]:
    """Yield a finding for every robot that misses rows, or numbers in some rows, of recordings."""
    for name in log.names:
        said = [
            f"{words} of '{recording.name}'{which}"
            for recording in log.recordings
            for words, which in (*_missing(recording.tracks.get(name)), *_short(recording, name))
        ]
        if said:
            yield Finding.of("rows-missing", f"'{name}' lacks {'; '.join(said)}.")


def _missing(track: Track | None) -> Iterator[tuple[str, str]]:
    """Yield how many numbers, and what share of the rows, a track lacks, and of which channels."""
    if track is None:
        return
    lost = {channel: int((~good[_inside(track, good)]).sum()) for channel, good in track.valid.items()}
    lost = {channel: rows for channel, rows in lost.items() if rows}
    if lost:
        yield f"numbers in {max(lost.values())} of {len(track)} rows", f" ({', '.join(lost)})"
    step = np.diff(track.time)
    # Not the median: stamps that come in pairs lack nothing.
    absent = 1 - np.quantile(step, 0.6) / np.mean(step) if len(step) else 0.0
    if absent > ABSENT + track.repeated / (len(track) + track.repeated):
        yield f"about {100 * absent:.0f} % of the rows", ""


def _short(recording: TeamRecording, name: str) -> Iterator[tuple[str, str]]:
    """Yield how long a robot's track lacks of the time that all others cover: nothing is used there."""
    others = [track.time for other, track in recording.tracks.items() if other != name]
    if not others or name not in recording.tracks:
        return
    begin, end = recording.span
    whole = float(min(time[-1] for time in others) - max(time[0] for time in others))
    lost = whole - (end - begin)
    if lost > max(SHORT_S, SHORT * whole):
        yield f"{lost:.3g} of the {whole:.3g} s", " that the others have, and nothing was used of them"


def _inside(track: Track, good: Mask) -> slice:
    """Return the rows without those at the ends in which a stream had not begun, or was over."""
    there = np.flatnonzero(good)
    if not len(there):
        return slice(None)
    first, last = (float(track.time[there[k]]) for k in (0, -1))
    late, early = first - track.time[0] < ENDS_S, track.time[-1] - last < ENDS_S
    return slice(int(there[0]) if late else 0, int(there[-1]) + 1 if early else len(good))


def missing_wrenches(log: TeamLog, recordings: Iterable[TeamRecording]) -> Iterator[Finding]:
    """Yield a finding for every robot without a wrench in a recording of which others have theirs: the sum is short."""
    for recording in recordings:
        if not any(track.has("force") for track in recording.tracks.values()):
            continue
        for name in log.names:
            rows = 0 if name in recording.away else _rows_without_wrench(log, recording, name)
            if rows:
                lacks = "force" if name in recording.tracks else "recording"
                yield Finding.of(
                    "rows-missing",
                    f"'{name}' has no {lacks} of '{recording.name}': {rows} rows tell nothing of mass, centre of mass "
                    "and inertia. Say away = true there if the robot held nothing.",
                )


def _rows_without_wrench(log: TeamLog, recording: TeamRecording, name: str) -> int:
    """Return in how many rows a robot of which no wrench was measured may have carried; 0 where one was."""
    track = recording.tracks.get(name)
    if track is None:
        return len(common_time(recording, log.names))
    if "force" in track.channels:
        return 0
    return len(track) if track.carrying is None else int(track.carrying.sum())
