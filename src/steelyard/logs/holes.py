"""Holes: a stream without rows for so long that those on either side do not tell what it was in between."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.recording import Stream

# A step of a clock that is longer than both is a hole [s; median steps].
_HOLE_S, _HOLE_STEPS = 0.25, 10
_PLACES = ("rotation", "gravity", "position")


def holes(stream: Stream) -> Array:
    """Return the stamps (K, 2) [s] on either side of each hole of a stream; none of one without a clock."""
    if stream.time is None or len(stream.time) < 2:
        return np.zeros((0, 2))
    return _beside(stream.time, _holes(stream.time))


def unknown_motion(stream: Stream) -> Array:
    """Return the stamps (K, 2) [s] on either side of each hole in which the motion is not known.

    Some drivers write a pose when it changes only. So where it is the same on either side, within the largest step that
    it takes elsewhere, the robot stood still in between.
    """
    places = [stream.channels[q] for q in _PLACES if q in stream.channels]
    if stream.time is None or not places or len(stream.time) < 2:
        return holes(stream)
    missing = _holes(stream.time)
    moved = np.zeros(len(missing), np.bool_)
    for values in places:
        steps = np.linalg.norm(np.diff(values.reshape(len(values), -1), axis=0), axis=1)
        moved |= steps > steps[~missing].max(initial=0.0)
    return _beside(stream.time, missing & moved)


def _holes(time: Array) -> Mask:
    """Return which steps (N - 1,) of a clock are holes."""
    steps = np.diff(time)
    return np.asarray(steps > max(_HOLE_S, _HOLE_STEPS * float(np.median(steps))))


def _beside(time: Array, steps: Mask) -> Array:
    return np.stack([time[:-1][steps], time[1:][steps]], 1)
