"""What is plainly wrong with the files of a team: units, one file given for two robots, rests that hold moves.

On one payload, in whatever frames, robots turn alike fast, and are not far apart. Rows of a still recording count as at
rest: where the payload plainly moves, as from attitude to attitude, what the moves push would pass for forces that no
rigid payload explains, and such a recording is read as one in motion, which knows rest and moves alike. It takes all
robots on standing bases to move: one alone slips, lets go or errs.
Source: own.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.findings import about
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose, Rotation
from steelyard.team.adjoint import turning_speed, turns_between

# Turning so many times as fast as the others, to within this factor, is degrees beside radians.
DEGREES, WITHIN = 180 / np.pi, 2.0
# They must turn in step: least correlation of how fast. Rates are taken over so long [s], in so many places,
# of which so many must be measured by all.
IN_STEP, OVER_S, PLACES, FEWEST = 0.6, 0.05, 200, 50
# Faster than so many times the usual is a jump.
JUMP = 4.0
# Shorter recordings [s] are not judged.
SHORTEST_S = 2.0
# Positions this many times as far from home, and as far spread, are millimetres beside metres.
MANY = 100.0
# A rest is away from home where it is farther out than so many times its spread.
NOISE = 3.0
# Nobody carries a payload by grasps so far apart [m].
FARTHEST = 50.0
LONG = 50  # rows in which noise shows
COMPARED = 64  # rows of a recording that are enough to tell two robots apart
# More than soft grasps and arms sway at rest, and less than attitudes that are to be told apart.
TURN, SHIFT_M = np.radians(5.0), 0.03
# Share of rows that may lie beyond: taps, and rows that are wrong.
TAPS = 0.02


def require_one_angle_unit(log: TeamLog) -> None:
    """Raise BadValue where a robot turns 57 times faster or slower than the others, in step with them."""
    for recording in log.recordings:
        if recording.kind != "still":
            _require_one_unit(recording)


def _require_one_unit(recording: TeamRecording) -> None:
    begin, end = recording.span
    if end - begin < SHORTEST_S:
        return
    time = np.linspace(begin, end - OVER_S, PLACES)
    every = {name: turning_speed(track, time, OVER_S) for name, track in recording.tracks.items()}
    rates = {name: speed for name, speed in every.items() if np.isfinite(speed).mean() > 0.5}
    if len(rates) < 2:
        return
    names, speed = list(rates), np.stack(list(rates.values()))
    speed = speed[:, np.isfinite(speed).all(0)]
    if speed.shape[1] < FEWEST:
        return
    # Angles that go round at half a turn jump where they are misread.
    size = np.median(speed, axis=1)
    speed = np.minimum(speed, JUMP * size[:, None])
    middle = int(np.argsort(size)[len(size) // 2])
    for i, name in enumerate(names):
        times = float(size[i]) / max(float(size[middle]), 1e-300)
        if not any(1 / WITHIN < odd / DEGREES < WITHIN for odd in (times, 1 / max(times, 1e-300))):
            continue
        if float(np.corrcoef(speed[i], speed[middle])[0, 1]) > IN_STEP:
            much, looks = ("faster", "degrees read as radians") if times > 1 else ("slower", "radians read as degrees")
            raise BadValue(
                f"'{name}' turns {max(times, 1 / times):.0f} times {much} than '{names[middle]}' in "
                f"'{recording.name}', in step with it: its angles look like {looks}. Set the unit of its "
                '"joint_position", "rotation" or "angular_velocity", or that of the other robot.'
            )


def require_one_length_unit(log: TeamLog) -> None:
    """Raise BadValue where the positions of a robot are hundreds of times larger in one recording than in another."""
    for name in log.names:
        told = {r: _size(r.tracks[name]) for r in log.recordings if name in r.tracks}
        # A rest where home is says nothing of the unit: it is as far out as its noise spreads.
        sizes = {
            r.name: size for r, size in told.items() if size[1] > 0 and (r.kind != "still" or size[0] > NOISE * size[1])
        }
        if len(sizes) < 2:
            continue
        small, large = (choose(sizes, key=lambda where: sizes[where][0]) for choose in (min, max))
        far, spread = (sizes[large][k] / sizes[small][k] for k in (0, 1))
        if min(far, spread) > MANY:
            raise BadValue(
                f"positions of '{name}' are {about(far)} times as large in '{large}' as in '{small}', and spread "
                f"{about(spread)} times as far: one of them is not in the unit that was said. Set the unit "
                '("m" or "mm") that its "position" has there.'
            )


def require_metres(names: tuple[str, ...], grasps: Pose) -> None:
    """Raise BadValue where grasps (N,) lie farther apart than a payload is long; names the one that is far from all."""
    apart = np.linalg.norm(grasps.position[:, None] - grasps.position, axis=2)
    first, far = (int(i) for i in np.unravel_index(apart.argmax(), apart.shape))
    if apart[first, far] < FARTHEST:
        return
    odd = int(np.median(apart, axis=1).argmax())
    others = np.delete(np.delete(apart, odd, 0), odd, 1)
    if len(names) > 2 and others.max() < FARTHEST:
        who, whose = f"the grasp of '{names[odd]}' comes out {apart[odd].max():.3g} m from the others", "its"
    else:
        who = f"the grasps of '{names[first]}' and '{names[far]}' come out {apart[first, far]:.3g} m apart"
        whose = "each robot's"
    raise BadValue(
        f"{who}: lengths are not in the unit that was said. Set the unit "
        f'("mm" or "mm/s", say) that {whose} "position" or velocity has.'
    )


def _size(track: Track) -> tuple[float, float]:
    """Return how far from home positions are, and how far spread; zero where there are none."""
    if "position" not in track.channels:
        return 0.0, 0.0
    where = track.channels["position"][track.valid["position"]]
    if not len(where):
        return 0.0, 0.0
    return float(np.median(np.linalg.norm(where, axis=1))), float(np.linalg.norm(where.std(0)))


def require_own_numbers(log: TeamLog) -> None:
    """Raise BadValue where two robots have the same numbers in a recording: one file was given twice."""
    for recording in log.recordings:
        moving = {n: t for n, t in recording.tracks.items() if t.has("force") and len(t) >= LONG}
        for first, second in combinations(moving, 2):
            if _alike(moving[first], moving[second]):
                raise BadValue(
                    f"'{first}' and '{second}' have the same numbers in '{recording.name}': one file is given for "
                    'both. Correct the "path" of one of them.'
                )


def _alike(first: Track, second: Track) -> bool:
    """Return whether two robots measured the same, to the last digit, in rows all over a recording: all that is read of
    both, since of one file torques may be read for one alone.
    """
    if len(first) != len(second):
        return False
    rows = slice(None, None, max(1, len(first) // COMPARED))
    shared = first.channels.keys() & second.channels.keys()
    return all(np.array_equal(first.channels[name][rows], second.channels[name][rows]) for name in shared)


def with_moves_as_motion(log: TeamLog) -> tuple[TeamLog, tuple[str, ...]]:
    """Return the log with still recordings that move read as in motion, and a note on each."""
    recordings, notes = list[TeamRecording](), list[str]()
    for recording in log.recordings:
        turn, shift = _payload_moved(log, recording) if recording.kind == "still" else np.zeros(2)
        if turn > TURN or shift > SHIFT_M:
            recording = replace(recording, kind="motion")
            notes.append(
                f"'{recording.name}' is called still, but turns by {np.degrees(turn):.0f} degrees and moves by "
                f"{1e3 * shift:.0f} mm from its middle: it was read as a motion"
            )
        recordings.append(recording)
    return (log.with_recordings(*recordings) if notes else log), tuple(notes)


def _payload_moved(log: TeamLog, recording: TeamRecording) -> Array:
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
    return np.asarray(np.quantile([turned, moved], 1 - TAPS, axis=1))
