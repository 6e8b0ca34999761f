"""Stamps that jitter: a stream of a steady rate is taken as sampled evenly where its numbers say so.

A logger stamps a sample when it arrives. What it comes early or late by looks like a motion that the wrench knows
nothing of. But a clock may also be right and the rate not steady: the smoother numbers tell which.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array, Integers
from steelyard.logs.clock import median_step
from steelyard.logs.recording import Recording, Stream

# Shorter streams, and stretches between gaps, are left as they are (samples).
_FEWEST = 50
# The rate may change in so long a time, as clocks drift [s].
_STEADY_S = 5.0
# A step this much longer than the median is a gap: the phase of the rate starts anew behind it.
_GAP = 3.5
# Even stamps are taken where numbers differ by this much less (rms) from what their neighbours say.
_SMOOTHER = 0.7
# What is taken away passes for jitter where means of so many rows spread by no more than so much of white noise.
_MEAN_OF, _WHITE = 20, 2.0


def with_steady_stamps(recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """Return the recording with stamps evened where its numbers are smoother so, and a note on each such stream."""
    streams = tuple(_steadied(stream) for stream in recording.streams)
    pairs = [(a, b) for a, b in zip(recording.streams, streams, strict=True) if a is not b]
    return (replace(recording, streams=streams) if pairs else recording), tuple(_words(a, b) for a, b in pairs)


def _words(given: Stream, even: Stream) -> str:
    off = 0.0 if given.time is None or even.time is None else float(np.std(given.time - even.time))
    return (
        f"the stamps of '{given.name}' jitter by {1e3 * off:.2g} ms: its numbers are smoother at a steady rate, "
        "which was taken"
    )


def _steadied(stream: Stream) -> Stream:
    """Return the stream at a steady rate where its numbers are plainly smoother so."""
    if stream.time is None or len(stream) < _FEWEST or not (np.diff(stream.time) > 0).all():
        return stream
    channels = [values.reshape(len(stream), -1) for values in stream.channels.values()]
    given = np.array([_roughness(stream.time, values) for values in channels])
    best, time = _SMOOTHER, stream.time
    for index in _counts(stream.time):
        even = _even(stream.time, index)
        if not (np.diff(even) > 0).all() or not _jitters(stream.time - even):
            continue
        rough = np.array([_roughness(even, values) for values in channels])
        share = float(np.mean(rough[given > 0] / given[given > 0])) if given.any() else 1.0
        if share < best:
            best, time = share, even
    return stream if time is stream.time else replace(stream, time=time)


def _jitters(off: Array) -> bool:
    """Tell whether what stamps are off by (N,) is without memory: a lost row that was not counted has one."""
    means = off[: len(off) // _MEAN_OF * _MEAN_OF].reshape(-1, _MEAN_OF).mean(1)
    return bool(means.std() * np.sqrt(_MEAN_OF) <= _WHITE * off.std())


def _counts(time: Array) -> tuple[Integers, Integers]:
    """Return two counts (N,) of samples: every row is the next one, or some were lost between them."""
    steps = np.diff(time) / median_step(time)
    gaps = np.where(steps > _GAP, np.round(steps), 1)
    lost = np.maximum(np.round(steps), 1)
    first, second = (np.concatenate([[0], np.cumsum(n)]).astype(np.int64) for n in (gaps, lost))
    return first, second


def _even(time: Array, index: Integers) -> Array:
    """Return stamps (N,) [s] as broken lines of the count (N,), a line for each stretch between gaps."""
    from scipy.interpolate import make_lsq_spline

    even = time.copy()
    step = median_step(time)
    for rows in np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) > _GAP * step) + 1):
        if len(rows) < _FEWEST:
            continue
        x, pieces = index[rows].astype(float), int((time[rows[-1]] - time[rows[0]]) / _STEADY_S)
        pieces = max(min(pieces, len(rows) // _FEWEST), 1)
        knees = x[np.linspace(0, len(x) - 1, pieces + 1).astype(np.int64)]
        even[rows] = make_lsq_spline(x, time[rows], np.concatenate([knees[:1], knees, knees[-1:]]), k=1)(x)
    return even


def _roughness(time: Array, values: Array) -> float:
    """Return how far (rms) values (N, D) lie from the cubic through the two neighbours on either side."""
    near = np.array([0, 1, 3, 4])
    t = np.stack([time[k : len(time) - 4 + k] for k in range(5)])
    expected = np.zeros_like(values[4:])
    for j in near:
        others = near[near != j]
        weight = np.prod((t[2] - t[others]) / (t[j] - t[others]), axis=0)
        expected += weight[:, None] * values[j : len(values) - 4 + j]
    return float(np.sqrt(np.mean((values[2:-2] - expected) ** 2)))
