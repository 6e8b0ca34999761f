"""Stamps that are late or jitter: a stream of a steady rate is taken as sampled evenly where its numbers say so.

A logger stamps a sample when it arrives. What it comes early or late by looks like a motion that the wrench knows
nothing of. But a clock may also be right and the rate not steady: the smoother numbers tell which. What rows waited for
in a buffer is taken away first, then jitter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array, Integers
from steelyard.logs.arrival import when_sampled
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
# Rows that seem to have waited are put where they were sampled unless numbers differ by this much more so, beside what
# their noise makes of it: the stamps say so already.
_ROUGHER = 1.05
# What is taken away passes for jitter where means of so many rows spread by no more than so much of white noise.
_MEAN_OF, _WHITE = 20, 2.0


def with_steady_stamps(recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """Return the recording with stamps evened where its numbers are smoother so, and a note on each such stream."""
    steady = [steadied(stream) for stream in recording.streams]
    streams, notes = tuple(stream for stream, _ in steady), tuple(note for _, said in steady for note in said)
    changed = any(a is not b for a, b in zip(recording.streams, streams, strict=True))
    return (replace(recording, streams=streams) if changed else recording), notes


def steadied(stream: Stream) -> tuple[Stream, tuple[str, ...]]:
    """Return the stream with stamps evened where its numbers are smoother so, and notes on what was done."""
    prompt = _prompt(stream)
    even = _evened(prompt)
    return even, tuple(_words(stream, prompt, even))


def _words(given: Stream, prompt: Stream, even: Stream) -> list[str]:
    out = []
    if given.time is not None and prompt.time is not None and prompt is not given:
        late = float(np.max(given.time - prompt.time))
        out.append(
            f"rows of '{given.name}' waited and came together, up to {1e3 * late:.3g} ms late, as from a buffer: they "
            "were taken as sampled a step apart"
        )
    if prompt.time is not None and even.time is not None and even is not prompt:
        off = float(np.std(prompt.time - even.time))
        out.append(
            f"the stamps of '{given.name}' jitter by {1e3 * off:.2g} ms: its numbers are smoother at a steady rate, "
            "which was taken"
        )
    return out


def _uneven(stream: Stream) -> Array | None:
    """Return the stamps (N,) [s] of a stream that may be evened, None of one that is too short or does not rise."""
    rising = stream.time is not None and len(stream) >= _FEWEST and bool((np.diff(stream.time) > 0).all())
    return stream.time if rising else None


def _prompt(stream: Stream) -> Stream:
    """Return the stream without what rows waited for, where its stamps look so and its numbers are no rougher."""
    time = _uneven(stream)
    sampled = None if time is None else when_sampled(time)
    if time is None or sampled is None:
        return stream
    given = _roughnesses(time, stream, beside_noise=True)
    shares = [_share(_roughnesses(stamps, stream, beside_noise=True), given) for stamps in sampled]
    best = int(np.argmin(shares))
    rises = bool((np.diff(sampled[best]) > 0).all())
    return replace(stream, time=sampled[best]) if rises and shares[best] < _ROUGHER else stream


def _evened(stream: Stream) -> Stream:
    """Return the stream at a steady rate where its numbers are plainly smoother so."""
    time = _uneven(stream)
    if time is None:
        return stream
    given = _roughnesses(time, stream)
    best, steadiest = _SMOOTHER, time
    for index in _counts(time):
        even = _even(time, index)
        if not (np.diff(even) > 0).all() or not _jitters(time - even):
            continue
        share = _share(_roughnesses(even, stream), given)
        if share < best:
            best, steadiest = share, even
    return stream if steadiest is time else replace(stream, time=steadiest)


def _share(rough: Array, given: Array) -> float:
    """Return the mean share (of channels that differ at all) of one roughness (Q,) in another; one where none does."""
    return float(np.mean(rough[given > 0] / given[given > 0])) if given.any() else 1.0


def _jitters(off: Array) -> bool:
    """Tell whether what stamps are off by (N,) is without memory: a lost row that was not counted has one."""
    means = off[: len(off) // _MEAN_OF * _MEAN_OF].reshape(-1, _MEAN_OF).mean(1)
    return bool(means.std() * np.sqrt(_MEAN_OF) <= _WHITE * off.std())


def _counts(time: Array) -> list[Integers]:
    """Return counts (N,) of samples: every row is the next one and, where that differs, some were lost between them."""
    steps = np.diff(time) / median_step(time)
    gaps = np.where(steps > _GAP, np.round(steps), 1)
    lost = np.maximum(np.round(steps), 1)
    first, second = (np.concatenate([[0], np.cumsum(n)]).astype(np.int64) for n in (gaps, lost))
    return [first] if np.array_equal(first, second) else [first, second]


def _even(time: Array, index: Integers) -> Array:
    """Return stamps (N,) [s] as broken lines of the count (N,), a line for each stretch between gaps."""
    even = time.copy()
    step = median_step(time)
    for rows in np.split(np.arange(len(time)), np.flatnonzero(np.diff(time) > _GAP * step) + 1):
        if len(rows) < _FEWEST:
            continue
        x, pieces = index[rows].astype(float), int((time[rows[-1]] - time[rows[0]]) / _STEADY_S)
        pieces = max(min(pieces, len(rows) // _FEWEST), 1)
        knees = x[np.linspace(0, len(x) - 1, pieces + 1).astype(np.int64)]
        even[rows] = _broken_line(x, time[rows], knees)
    return even


def _broken_line(x: Array, y: Array, knees: Array) -> Array:
    """Return the values at x (N,) of the broken line with these `knees` (K,) that is nearest to y (N,)."""
    piece = np.clip(np.searchsorted(knees, x, "right") - 1, 0, len(knees) - 2)
    share, start, count = (x - knees[piece]) / np.diff(knees)[piece], y[0], len(knees)
    normal, right = np.zeros((count, count)), np.zeros(count)
    for at, weight in ((piece, 1 - share), (piece + 1, share)):
        right += np.bincount(at, weight * (y - start), count)
        normal += np.diag(np.bincount(at, weight**2, count))
    beside = np.bincount(piece, share * (1 - share), count)[:-1]
    heights = np.linalg.solve(normal + np.diag(beside, 1) + np.diag(beside, -1), right)
    return np.asarray(start + np.interp(x, knees, heights))


def _roughnesses(time: Array, stream: Stream, beside_noise: bool = False) -> Array:
    """Return how far (rms) the numbers of each channel (Q,) lie from the cubic through two neighbours on either side.

    beside_noise  as a share of what that cubic makes of white noise, by which even stamps would always win
    """
    near = np.array([0, 1, 3, 4])
    t = np.stack([time[k : len(time) - 4 + k] for k in range(5)])
    weights = np.ones((5, t.shape[1]))
    for j in near:
        others = near[near != j]
        weights[j] = -np.prod((t[2] - t[others]) / (t[j] - t[others]), axis=0)
    if beside_noise:
        weights /= np.sqrt((weights**2).sum(0))
    out = []
    for channel in stream.channels.values():
        values = channel.reshape(len(stream), -1)
        off = sum(w[:, None] * values[k : len(values) - 4 + k] for k, w in enumerate(weights))
        out.append(np.sqrt(np.mean(np.square(off))))
    return np.array(out)
