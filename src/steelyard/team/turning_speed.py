"""How fast a grasp turns: the same for every grasp of a rigid payload, in whatever frames it is told."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.logs.team_track import Track
from steelyard.spatial import Rotation
from steelyard.team.turns import turns_between


def turning_speed(track: Track, time: Array, over_s: float) -> Array:
    """Return how fast (T,) [rad/s] a grasp turns from `time` (T,) to `over_s` later; NaN where it was not measured."""
    name = "rotation" if track.has("rotation") else "angular_velocity"
    good = track.mask(name)
    if good.sum() < 2:
        return np.full(len(time), np.nan)
    known, values = (track.time, track.channels[name]) if good.all() else (track.time[good], track.channels[name][good])
    first, last = np.searchsorted(known, time), np.searchsorted(known, time + over_s)
    inside = (time >= known[0]) & (last < len(known)) & (last > first)
    first, last = np.minimum(first, len(known) - 1), np.minimum(last, len(known) - 1)
    seconds = known[last] - known[first]
    if name == "rotation":
        turns = turns_between(Rotation._trusted(values[first]), Rotation._trusted(values[last]))
        speed = np.linalg.norm(turns, axis=1) / np.where(inside, seconds, 1.0)
    else:
        speed = np.linalg.norm(values[first], axis=1)
    # Across a gap the turn may have gone forth and back.
    return np.where(inside & (seconds < 2 * over_s), speed, np.nan)
