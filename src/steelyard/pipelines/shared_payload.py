"""One payload, many robots: the log of a team becomes a TeamEstimate.

    poses and twists -> where everybody holds the payload, and when -> the payload's motion and the sum of wrenches
    -> mass, centre of mass, inertia

Two ways through the same rooms: the paper's, step after step, and one joint estimate.
Source: "Cooperative Payload Estimation by a Team of Mocobots".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np

from steelyard.check import Mask
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import UNEXPLAINED, Finding, counted, other_than
from steelyard.identify.fit import within_numbers
from steelyard.identify.scale import allow_scale
from steelyard.logs.recording import STANDARD_GRAVITY
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_rows import common_time
from steelyard.logs.team_track import Track
from steelyard.pipelines.telling import MISREAD
from steelyard.team.clocks.errors import NOTHING, ClockErrors
from steelyard.team.clocks.lags import together
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.lost_wrenches import stuck_forces, without_clipped, without_frozen
from steelyard.team.misread.files import (
    require_one_angle_unit,
    require_one_length_unit,
    require_own_numbers,
    with_moves_as_motion,
)
from steelyard.team.published import PublishedTeam
from steelyard.team.team_findings import late_clocks
from steelyard.team.weighed import clocked

Method = Literal["joint", "paper"]
METHODS: tuple[Method, ...] = get_args(Method)

# Share of its rows from which on a robot is said to have lost some.
ABSENT = 0.1
# A robot is said to have begun late or ended early where that costs so much, and so long [s], of what all others have.
SHORT, SHORT_S = 0.25, 1.0
# Streams of one robot begin and end within this time [s].
ENDS_S = 0.25
# joint  every grasp, home and clock at once, then one fit of the ten parameters to still and moving rows together
# paper  grasps from twists (eq. 1-8), loops closed, mass and centre of mass at rest (9-16), inertia in motion (17-33)
ESTIMATORS: Mapping[Method, JointTeam | PublishedTeam] = MappingProxyType(
    {"joint": JointTeam(), "paper": PublishedTeam()}
)


@within_numbers()
def identify_team(log: TeamLog, method: Method = "joint") -> TeamEstimate:
    """Return every grasp, mass, centre of mass and inertia, in the grasp frame of the reference robot.

    Raises CannotAnswer where the data do not determine them, BadInput where they make no sense.
    """
    if method not in METHODS:
        raise BadValue(f"method must be one of {', '.join(METHODS)}; got {method!r}.")
    require_one_angle_unit(log)
    require_one_length_unit(log)
    require_own_numbers(log)
    log, moving = with_moves_as_motion(log)
    log, apart = together(log) if method == "joint" else (log, NOTHING)
    for recording in log.recordings:
        recording.require_overlap()
    live, frozen = without_frozen(log)
    whole, clipped = without_clipped(live)
    found = _with_clocks(ESTIMATORS[method].identify(whole), apart, log)
    lost = (*_repeated_rows(log), *_missing_rows(log), *_missing_wrenches(log, method))
    seen = (*stuck_forces(log), *frozen, *clipped, *found.findings, *lost)
    found = replace(found, findings=seen, notes=(*moving, *found.notes)).by_cause()
    return _weighed(_with_gravity(_remedied(found), log))


def _with_clocks(found: TeamEstimate, apart: ClockErrors, log: TeamLog) -> TeamEstimate:
    """Return the estimate with how late clocks were that were brought together before it."""
    if not apart:
        return found
    found = clocked(found, apart.first(log))
    others = other_than(found.findings, "clock-offset")
    said = (*apart.findings(log), *late_clocks(found.clock_offsets_s, found.clock_offset_std_s), *others)
    return replace(found, findings=tuple(sorted(said, key=lambda finding: finding.code != "robot-excluded")))


def _remedied(found: TeamEstimate) -> TeamEstimate:
    """Return the estimate with remedies that help where its wrenches are no body's."""
    return found.with_remedies(UNEXPLAINED) if found.codes() & MISREAD else found


def _with_gravity(found: TeamEstimate, log: TeamLog) -> TeamEstimate:
    """Return the estimate with bars, and a note, for gravity that nobody stated."""
    if not log.gravity_std:
        return found
    note = (
        f"no robot gives gravity: {STANDARD_GRAVITY} m/s² along -z of level bases was assumed, ± {log.gravity_std:.2%}"
    )
    return allow_scale(found, log.gravity_std, whole=False).noted(note)


def _weighed(found: TeamEstimate) -> TeamEstimate:
    """Return the estimate; raise CannotAnswer, with what was noticed first, where its mass is less than its bar."""
    if found.mass >= found.std[0]:
        return found
    noticed = "".join(f" Noticed: {finding.message} {finding.remedy}" for finding in found.findings[:1])
    weighed = f"{found.mass:.2g} kg, with a standard deviation of {found.std[0]:.2g} kg"
    raise CannotAnswer(f"the data do not tell the mass: {weighed}.{noticed}")


def _repeated_rows(log: TeamLog) -> Iterator[Finding]:
    """Yield a finding for every robot of which rows were logged more than once."""
    for name in log.names:
        said = [f"{counted(t.repeated, 'row')} of '{r.name}'" for r, t in log.tracks_of(name) if t.repeated]
        if said:
            text = f"{', '.join(said)} of '{name}' repeat the row before in every channel; each was used once."
            yield Finding.of("rows-duplicated", text)


def _missing_rows(log: TeamLog) -> Iterator[Finding]:
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


def _missing_wrenches(log: TeamLog, method: Method) -> Iterator[Finding]:
    """Yield a finding for every robot without a wrench in a recording of which others have theirs: the sum is short."""
    weighed = log.recordings
    if method == "paper":
        weighed = tuple(r for r in weighed if r.kind == "still" or r in log.of_kind("motion"))
    for recording in weighed:
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
