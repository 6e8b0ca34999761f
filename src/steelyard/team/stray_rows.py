"""Single rows of a robot that are wrong: a message that was lost and came as zeros, a tracker that jumped, a spike.

How far a row leaps is judged against the robot's own steps in that recording, channel by channel.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding
from steelyard.logs.middles import median, quantile
from steelyard.logs.strays import strays
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.team.lost_wrenches import WRENCH

# A leap is so many times the step that this share of the rows do not exceed, so large a share of the range, and so many
# times the smallest step there is: what coarse numbers do at rest is none. Of each step the middle one of so many
# around it is what the robot moves.
STEPS, USUAL, RANGE, QUANTA, AROUND = 4.0, 0.75, 0.02, 4.0, 9
# Rows that tell usual steps.
FEWEST = 50
REMEDY = "Nothing to do; check what tracks or logs them."


def without_strays(log: TeamLog) -> tuple[TeamLog, tuple[Finding, ...]]:
    """Return the log without numbers that leap away from the rows beside and back, and a finding for each robot."""
    found, lost = list[Finding](), list[dict[str, dict[str, Mask]]]()
    for recording in log.recordings:
        each = {name: _away(track) for name, track in recording.tracks.items()}
        lost.append({name: away for name, away in each.items() if away})
        for name, away in lost[-1].items():
            rows = np.any(list(away.values()), axis=0)
            first = float(recording.tracks[name].time[rows][0])
            text = (
                f"'{name}' leaps away from the rows before and after in {int(rows.sum())} of {len(rows)} rows of "
                f"'{recording.name}' ({', '.join(away)}), first at {first:.2f} s; these numbers were left out."
            )
            found.append(Finding("outliers", text, REMEDY))
    if not found:
        return log, ()
    kept = (r.changed(_without, gone) for r, gone in zip(log.recordings, lost, strict=True))
    return log.with_recordings(*kept), tuple(found)


def _away(track: Track) -> dict[str, Mask]:
    """Return by channel the rows (T,) that are away, of those in which some are."""
    out = {}
    for name, values in track.channels.items():
        there = np.flatnonzero(track.valid[name])
        if len(there) >= FEWEST:
            rows = _strays(values[there].reshape(len(there), -1))
            if rows.any():
                out[name] = np.zeros(len(track), np.bool_)
                out[name][there[rows]] = True
    return out


def _strays(values: Array) -> Mask:
    """Return which rows of numbers (N, K) are away."""
    steps = np.diff(values, axis=0)
    if not _stand_out(np.linalg.norm(np.diff(steps, axis=0), axis=1)):
        return np.zeros(len(values), np.bool_)
    size = np.linalg.norm(steps, axis=1)
    low, high = np.quantile(values, [0.02, 0.98], axis=0)
    least = max(RANGE * float(np.linalg.norm(high - low)), QUANTA * float(size[size > 0].min()))
    padded = np.pad(steps, ((AROUND // 2, AROUND // 2), (0, 0)), "reflect")
    steps = steps - median(sliding_window_view(padded, AROUND, axis=0))
    leap = max(least, STEPS * float(quantile(np.linalg.norm(steps, axis=1), USUAL)))
    path = np.concatenate([np.zeros_like(steps[:1]), np.cumsum(steps, axis=0)])

    def apart(first: Integers, second: Integers) -> Array:
        return np.asarray(np.linalg.norm(path[second] - path[first], axis=1) / leap)

    return strays(len(values), apart)


def _stand_out(sizes: Array) -> bool:
    return bool(sizes.max() > STEPS * quantile(sizes, USUAL))


def _without(track: Track, away: dict[str, Mask]) -> Track:
    """Return the track without what is away; half a wrench adds up to nothing."""
    gone, pushed = dict(away), [away[name] for name in WRENCH if name in away]
    if pushed:
        gone |= dict.fromkeys(WRENCH, np.asarray(np.any(pushed, axis=0)))
    return replace(
        track, valid={name: mask & ~gone[name] if name in gone else mask for name, mask in track.valid.items()}
    )
