"""Twists read wrongly: one robot's linear velocities in another unit, or twists in the axes of homes, not of grasps.

They fit the others' once they are read otherwise; those of all robots, as where one driver wrote them, one another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import FAILURES
from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.team.misread.poses import METRES, Reading
from steelyard.team.twists.team import TwistTeam

# So read, noise is below this share of the twists, and these shares fall by this factor (rms).
FITS, CLOSES = 0.3, 4.0
# Where gravity, too, agrees so read and did not before, that factor is enough.
AGREES = 1.25
# Readings within this factor of the best are as good.
AS_GOOD = 1.5


@dataclass(frozen=True)
class _Tried:
    """Shares of noise (rms and largest) when twists of a robot, or of all, are read so, and what is said of that.

    level  whether all then agree on where gravity points
    """

    left: float
    largest: float
    level: bool
    words: str
    remedy: str


def _unit(name: str, size: float) -> Reading[Track]:
    def meant(track: Track) -> Track | None:
        if not track.has("linear_velocity"):
            return None
        return replace(track, channels={**track.channels, "linear_velocity": size * track.channels["linear_velocity"]})

    return Reading(f"the linear velocities of {{}} are in {name}", "Convert them to m/s.", meant)


def _from_home(track: Track) -> Track | None:
    """Return the track with twists turned from the axes of its home into those of its grasp."""
    if not track.has("rotation", "angular_velocity", "linear_velocity"):
        return None
    into, told = track.rotation.inverse(), track.mask("rotation")
    names = ("angular_velocity", "linear_velocity")
    return replace(
        track,
        channels={**track.channels, **{name: into.apply(track.channels[name]) for name in names}},
        valid={**track.valid, **{name: track.valid[name] & told for name in names}},
    )


# What velocities may be in, read as m/s [m/s].
UNITS = {f"{name}/s": size for name, size in METRES.items() if name != "m"}
HOME = Reading(
    "the twists of {} are in the axes of its home", "Turn them into those of its grasp, by its rotation.", _from_home
)
READINGS = (*(_unit(name, size) for name, size in UNITS.items()), HOME)


def require_twists_well_read(log: TeamLog, team: TwistTeam) -> None:
    """Raise BadValue where twists fit far better once one robot's, or all in homes' axes, are read in another way."""
    given, level = float(np.sqrt((team.share**2).mean())), team.tilt(log.names) is None
    enough = [
        one
        for one in _tried(log)
        if one.left < given / (AGREES if one.level and not level else CLOSES) and one.largest < FITS
    ]
    if not enough:
        return
    found = sorted(enough, key=lambda one: one.left)
    able = [one for one in found if one.left < AS_GOOD * found[0].left and one.level >= found[0].level]
    raise BadValue(
        f"the robots' twists do not fit one payload, and do so if {' or if '.join(one.words for one in able)}: "
        f"{100 * found[0].left:.2g} % of them is then noise, as given {100 * given:.2g} %. "
        f"{' '.join(dict.fromkeys(one.remedy for one in able))}"
    )


def _tried(log: TeamLog) -> Iterator[_Tried]:
    """Yield what every reading leaves. Units that all robots share fit one another as well as metres."""
    every = frozenset(log.names)
    tries = [(frozenset({name}), f"'{name}'", reading) for name in log.names for reading in READINGS]
    for who, called, reading in (*tries, (every, "all robots", HOME)):
        read = [_read(recording, who, reading) for recording in log.recordings]
        if all(now is was for now, was in zip(read, log.recordings, strict=True)):
            continue
        try:
            team = TwistTeam.of(log.with_recordings(*read), False)
        except FAILURES:
            continue
        words, remedy = reading.words.format(called), reading.remedy
        if len(who) > 1:
            words, remedy = (text.replace(" its ", " their ") for text in (words, remedy))
        share, level = team.share, team.tilt(log.names) is None
        yield _Tried(float(np.sqrt((share**2).mean())), float(share.max()), level, words, remedy)


def _read(recording: TeamRecording, who: frozenset[str], reading: Reading[Track]) -> TeamRecording:
    meant = {name: reading.meant(track) for name, track in recording.tracks.items() if name in who}
    new = {name: track for name, track in meant.items() if track is not None}
    return replace(recording, tracks={**recording.tracks, **new}) if new else recording
