"""Recordings that are called still and hold moves, as when a team goes from attitude to attitude in one of them.

Rows of a still recording count as at rest. Where the payload plainly moves they do not lie at rest, and what the moves
push would pass for forces that no rigid payload explains; such a recording is read as one in motion, which knows rest
and moves alike. It takes all robots on standing bases to move: one alone slips, lets go or errs.
Source: own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.spatial import Rotation
from steelyard.team.turns import turns_between

# More than soft grasps and arms sway at rest, and less than attitudes that are to be told apart.
TURN, SHIFT_M = np.radians(5.0), 0.03
# Share of rows that may lie beyond: taps, and rows that are wrong.
BEYOND = 0.02


def with_moves_as_motion(log: TeamLog) -> tuple[TeamLog, tuple[str, ...]]:
    """Return the log with still recordings that move read as in motion, and a note on each."""
    recordings, notes = list[TeamRecording](), list[str]()
    for recording in log.recordings:
        turn, shift = _moved(log, recording) if recording.kind == "still" else np.zeros(2)
        if turn > TURN or shift > SHIFT_M:
            recording = replace(recording, kind="motion")
            notes.append(
                f"'{recording.name}' is called still, but turns by {np.degrees(turn):.0f} degrees and moves by "
                f"{1e3 * shift:.0f} mm from its middle: it was read as a motion"
            )
        recordings.append(recording)
    return (log.with_recordings(*recordings) if notes else log), tuple(notes)


def _moved(log: TeamLog, recording: TeamRecording) -> Array:
    """Return how far the payload turns [rad] and moves [m] from its middle: as far as the robot that does so least."""
    tracks = [track for name, track in recording.tracks.items() if log.robot(name).base == "still"]
    posed = [track for track in tracks if track.mask("rotation", "position").any()]
    return np.asarray(np.min([_reach(track) for track in posed], axis=0)) if posed else np.zeros(2)


def _reach(track: Track) -> Array:
    """Return how far a robot's grasp turns [rad] and moves [m] from its middle."""
    rows = track.mask("rotation", "position")
    matrix, place = track.channels["rotation"][rows], track.channels["position"][rows]
    middle = np.abs(matrix - np.median(matrix, 0)).sum((-1, -2)).argmin()
    turned = np.linalg.norm(turns_between(Rotation(matrix[middle]), Rotation(matrix)), axis=-1)
    moved = np.linalg.norm(place - np.median(place, 0), axis=-1)
    return np.asarray(np.quantile([turned, moved], 1 - BEYOND, axis=1))
