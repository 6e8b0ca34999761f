"""Stamps of a team that are late or jitter, evened as those of one arm are, where a robot's motion is smoother so."""

from __future__ import annotations

from steelyard.logs.recording import Stream
from steelyard.logs.steady import steadied
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track

# What the stamps of a robot are judged by: wrenches were brought to them, and are noisy beside it.
_MOTION = ("rotation", "position", "angular_velocity", "linear_velocity")


def with_steady_tracks(log: TeamLog) -> tuple[TeamLog, tuple[str, ...]]:
    """Return the log with stamps evened where what robots tell of their motion is smoother so, and a note on each."""
    recordings, notes = [], list[str]()
    for recording in log.recordings:
        even = {}
        for robot, track in recording.tracks.items():
            motion = _motion(track, f"{robot} ({recording.name})")
            stream, said = steadied(motion)
            notes += said
            if stream is not motion and stream.time is not None:
                even[robot] = stream.time
        recordings.append(recording.changed(Track.stamped, even))
    return (log.with_recordings(*recordings) if notes else log), tuple(notes)


def _motion(track: Track, name: str) -> Stream:
    """Return what a track tells of motion in every row, as a stream of this name."""
    whole = {n: track.channels[n] for n in _MOTION if n in track.channels and track.valid[n].all()}
    return Stream(name, whole, track.time)
