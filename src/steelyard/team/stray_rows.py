"""Single rows of a robot that are wrong, in any channel: spikes, zeros, poses that leap away and back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Mask
from steelyard.findings import Finding
from steelyard.logs.strays import strays
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.team.lost_wrenches import WRENCH

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
        rows = strays(values[there].reshape(len(there), -1), track.step) if len(there) > 1 else np.zeros(0, np.bool_)
        if rows.any():
            out[name] = np.zeros(len(track), np.bool_)
            out[name][there[rows]] = True
    return out


def _without(track: Track, away: dict[str, Mask]) -> Track:
    """Return the track without what is away; half a wrench adds up to nothing."""
    gone, pushed = dict(away), [away[name] for name in WRENCH if name in away]
    if pushed:
        gone |= dict.fromkeys(WRENCH, np.asarray(np.any(pushed, axis=0)))
    return replace(
        track, valid={name: mask & ~gone[name] if name in gone else mask for name, mask in track.valid.items()}
    )
