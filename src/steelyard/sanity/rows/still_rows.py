"""Rows of still poses: which belong together, their means over windows of time or of rows, and those that err alike.

Noise below the rate of a sensor makes rows remember each other; stiction, hysteresis and models of an arm shift all
rows of a pose. Such rows are worth fewer than they are, and their error bars would be too narrow. Means over several
times as many rows as noise remembers are no longer alike, and are read instead: in the end one mean for each pose.

Parts of logs put one after the other have poses that leap as no arm moves, or across a pause. What is between was never
recorded, so that nothing may be differentiated or aligned across it. A log of rests alone is a table of still poses,
and is read as one: averages over windows that are longer than what noise remembers. In others a leap becomes a pause.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.logs.autocorrelation import correlation_time
from steelyard.logs.clock import median_step
from steelyard.logs.recording import Recording, Stream
from steelyard.logs.runs import runs
from steelyard.spatial import Rotation

_KEPT = ("force", "torque", "rotation", "gravity", "specific_force")

# Gravity turns by less between rows of one pose [rad], of which there are so many on average.
SAME, FEWEST_ROWS = np.radians(2.0), 8.0
# Rows remember each other where they are worth fewer by this factor; means are over so many times the factor.
WORTH_LESS, TIMES = 1.5, 3.0
# Rows remember each other over so many at most.
MOST_LAGS = 10_000
# One log in so many whose poses scatter as their rows say is taken for one whose poses do not.
CHANCE = 1e-4

# Between two rows, a turn beyond the first [rad] is a leap where it is faster than the second [rad/s], which no arm is,
# and so is a way beyond the third [m] that is faster than the fourth [m/s].
TURN, FASTEST_TURN, WAY, FASTEST_WAY = np.radians(5.0), 15.0, 0.03, 10.0
# A pause is longer than this [s] and than so many steps of the clock.
PAUSE_S, STEPS = 0.5, 5.0
# Rows this far apart [s] tell no motion.
SPARSE_S = 0.5
# So long [s] is the pause put where poses leap between stretches of motion; where more rows than this share leap, none
# is.
PUT_S, MOST = 2.0, 0.01
# Rows within so much [rad] of the middle of their stretch are at rest; so many of all rows must be, in so many at once.
REST, AT_REST, FEWEST_AT_REST = np.radians(1.0), 0.97, 5
# Averages are over about so long [s]; streams with clocks of their own may be so late [s].
WINDOW_S, LATE_S = 0.5, 0.25


def spans(stretch: Integers) -> Integers:
    """Return the first row and the last + 1 of every stretch of a number per row (N,), which never falls (K, 2)."""
    edges = np.flatnonzero(np.diff(stretch)) + 1
    return np.stack([np.concatenate([[0], edges]), np.concatenate([edges, [len(stretch)]])], 1)


def angles(matrices: Array) -> Array:
    """Return the angle (N,) [rad] of rotations (N, 3, 3)."""
    cosine = (np.trace(matrices, axis1=1, axis2=2) - 1) / 2
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def split(rests: Array, length: float) -> Array:
    """Return the begin and end (W, 2) of even parts of about `length` of every rest (K, 2); an empty rest has none."""
    out = []
    for begin, end in rests:
        if end >= begin:
            edges = np.linspace(begin, end, max(round((end - begin) / length), 1) + 1)
            # The row on an inner edge belongs to the part that begins there.
            out.append(np.stack([edges[:-1], np.append(np.nextafter(edges[1:-1], -np.inf), end)], 1))
    return np.concatenate(out) if out else np.zeros((0, 2))


def as_table(streams: Sequence[Stream], windows: Array) -> tuple[tuple[Stream, ...], int]:
    """Return streams with clocks as tables of still poses, means over the windows (W, 2) that all fill, and how many.

    Channels that tell only of motion are left out, and streams without any other.
    """
    tables = [_averaged(s, windows) for s in streams if set(_KEPT) & s.channels.keys()]
    full = np.logical_and.reduce([filled for _, filled in tables])
    return tuple(stream.rows(full) for stream, _ in tables), int(full.sum())


def _averaged(stream: Stream, windows: Array) -> tuple[Stream, Mask]:
    """Return the stream as a table of means over windows (W, 2) [s], and which windows (W,) hold any of its rows."""
    if stream.time is None:
        return stream, np.ones(len(stream), np.bool_)
    first = np.searchsorted(stream.time, windows[:, 0], "left")
    last = np.searchsorted(stream.time, windows[:, 1], "right")
    full = last > first
    channels = {q: _means(v, first, last) for q, v in stream.channels.items() if q in _KEPT}
    if "rotation" in channels:
        channels["rotation"][full] = Rotation.nearest(channels["rotation"][full]).matrix
    return replace(stream, channels=channels, time=None, poses=True, delay=None), full


def _means(values: Array, first: Integers, last: Integers) -> Array:
    """Return the mean (W, ..) of rows first..last - 1 of values (N, ..); zero where there are none."""
    sums = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values - values[:1], axis=0)])
    count = np.maximum(last - first, 1).reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray((sums[last] - sums[first]) / count + values[:1])


def examine_memory(recording: Recording) -> Recording:
    """Return a table of still poses with rows that remember each other averaged; a note says so."""
    if not all(s.time is None and s.poses for s in recording.streams):
        return recording
    # Rotations, or else gravity as one of the channels tells it.
    telling = ("rotation", "gravity", "specific_force")
    down = next((s.channels[q] for s in recording.streams for q in telling if q in s.channels), None)
    felt = [s.channels[q] for s in recording.streams for q in ("force", "torque") if q in s.channels]
    if down is None or any(len(values) != len(down) for values in felt):
        return recording
    poses = spans(np.cumsum(np.append(False, _apart(down[:-1], down[1:]) > SAME)))
    middle = np.repeat(down[poses.mean(1).astype(np.int64)], np.diff(poses, axis=1)[:, 0], axis=0)
    # Rows that turn little by little are a motion.
    if len(down) < FEWEST_ROWS * len(poses) or (_apart(middle, down) > SAME).any():
        return recording
    worth = _worth(np.hstack(felt), poses)
    pull = down if down.ndim == 2 else np.swapaxes(down, 1, 2) @ recording.gravity
    apart = _apart_by(recording, pull, poses, worth)
    if apart < WORTH_LESS and worth < WORTH_LESS:
        return recording
    length = np.inf if apart >= WORTH_LESS else float(np.ceil(TIMES * worth))
    clocks = [replace(s, time=np.arange(len(s), dtype=np.float64)) for s in recording.streams]
    streams, rows = as_table(clocks, split(poses - np.array([0.0, 1.0]), length))
    note = f"rows of one pose remember each other over {worth:.0f} rows: means over {length:.0f} were read"
    if apart >= WORTH_LESS:
        note = f"poses scatter {apart:.2g} times as much as their rows tell: one mean for each pose was read"
    return replace(recording, streams=streams).noted(f"{note}, {rows} in all")


def _apart(down: Array, other: Array) -> Array:
    """Return the angle (N,) [rad] between rows of rotations (N, 3, 3) or of vectors (N, 3)."""
    if down.ndim == 3:
        return angles(np.swapaxes(down, 1, 2) @ other)
    sizes = np.linalg.norm(down, axis=1) * np.linalg.norm(other, axis=1)
    return np.asarray(np.arccos(np.clip((down * other).sum(1) / np.maximum(sizes, 1e-300), -1.0, 1.0)))


def _worth(values: Array, poses: Integers) -> float:
    """Return how many rows of values (N, k) are worth one, by how alike neighbours in a pose are; 1 of white noise."""
    count = np.diff(poses, axis=1)[:, 0]
    means = np.add.reduceat(values, poses[:, 0], axis=0) / count[:, None]
    left = values - np.repeat(means, count, axis=0)
    number = np.repeat(np.arange(len(poses)), count)
    # Poses so far apart that none reaches into the next.
    longest = min(int(count.max()) // 2, MOST_LAGS)
    apart = np.zeros((len(left) + longest * len(poses), left.shape[1]))
    apart[np.arange(len(left)) + longest * number] = left
    return correlation_time(apart, longest)


def _apart_by(recording: Recording, pull: Array, poses: Integers, worth: float) -> float:
    """Return how many times more than by their rows' scatter the poses' means are off; 0 where chance may do it.

    `worth` rows of a pose are worth one. Off from what is linear in gravity `pull` (N, 3) in S, up to a constant turn,
    so that gains, signs, and where and how the sensor sits, do not count.
    """
    from scipy.special import gammaincc

    felt = _felt(recording)
    if felt is None:
        return 0.0
    count = np.diff(poses, axis=1)[:, 0]
    means, down = (np.add.reduceat(v, poses[:, 0], axis=0) / count[:, None] for v in (felt, pull))
    within = np.square(felt - np.repeat(means, count, axis=0)).sum(0) / max(len(felt) - len(poses), 1)
    heard, root = within > 0, np.sqrt(count)[:, None]
    A = root * np.concatenate([np.ones((len(poses), 1)), down], axis=1)
    fit, _, rank, _ = np.linalg.lstsq(A, root * means, rcond=1e-6)
    excess = float((np.square(root * means - A @ fit).sum(0)[heard] / within[heard]).sum()) / worth
    freedom = int(heard.sum()) * (len(poses) - int(rank))
    return float(np.sqrt(excess / freedom)) if freedom and gammaincc(freedom / 2, excess / 2) < CHANCE else 0.0


def _felt(recording: Recording) -> Array | None:
    """Return torque and force (N, 6) in S, up to where and how the sensor sits; None where no rotation leads there."""
    turn = next((v for _, _, v in recording.channels("rotation")), None)
    parts = []
    for stream, part, values in recording.channels("torque", "force"):
        if stream.in_world(part):
            if turn is None:
                return None
            values = np.einsum("nji,nj->ni", turn, values)
        parts.append(values)
    return np.concatenate(parts, axis=1)


def examine_sparse(recording: Recording) -> Recording:
    """Return a log whose rows are too far apart in time to tell a motion as a table of still poses; a note says so.

    Streams with different stamps come back as they are: nothing says which rows belong together. So do rows that turn
    little by little: their stamps are in another unit.
    """
    first = recording.streams[0].time
    if first is None or any(s.time is None or not np.array_equal(s.time, first) for s in recording.streams):
        return recording
    step = median_step(first) if len(first) > 1 else 0.0
    R = next((v for _, _, v in recording.channels("rotation")), None)
    if step < SPARSE_S or R is None or not (angles(np.swapaxes(R[:-1], 1, 2) @ R[1:]) > TURN).any():
        return recording
    note = f"rows are {step:.3g} s apart, too far to tell a motion: each was read as a still pose"
    return recording.changed(lambda s: replace(s, time=None, poses=True, delay=None)).noted(note)


def examine_leaps(recording: Recording) -> Recording:
    """Return the recording as a table of still poses where it holds only rests, else with pauses where poses leap.

    A note says so. Logs without leaps, tables and logs without rotations come back as they are.
    """
    turning = recording.stream_of("rotation")
    if turning is None or turning.time is None or any(s.time is None for s in recording.streams):
        return recording
    if len(turning) < 2 * FEWEST_AT_REST:
        return recording
    leap, pause = _partings(turning, turning.time)
    rests = _rests(turning.channels["rotation"], turning.time, leap | pause)
    if len(rests) > 1:
        return _as_table(recording, rests)
    return _with_pauses(recording, turning.time, leap)


def _as_table(recording: Recording, rests: Array) -> Recording:
    """Return the rests (K, 2) [s] as rows of still poses."""
    late = LATE_S if len(recording.streams) > 1 else 0.0
    streams, rows = as_table(recording.streams, split(rests + np.array([late, -late]), WINDOW_S))
    if rows < 2:
        return recording
    note = (
        f"the log is {len(rests)} rests with leaps or pauses between: it was read as {rows} rows of still "
        f"poses, averages over {WINDOW_S:g} s or less"
    )
    # Noise that was declared is that of a row.
    return replace(recording, streams=streams, noise={}).noted(note)


def _with_pauses(recording: Recording, time: Array, leap: Mask) -> Recording:
    """Return the recording with a pause in all streams wherever poses at `time` (N,) leap (N - 1,) and stay there."""
    lengths = np.diff(np.concatenate([[0], np.flatnonzero(leap) + 1, [len(time)]]))
    lasting = np.minimum(lengths[:-1], lengths[1:]) >= FEWEST_AT_REST
    if not lasting.any() or leap.mean() > MOST:
        return recording
    after = time[1:][leap][lasting]
    where = ", ".join(f"{stamp - time[0]:.1f}" for stamp in after[:5]) + (" and more" if len(after) > 5 else "")
    note = f"the poses leap at {where} s, as where parts of logs are joined: a pause was put there"
    paused = recording.changed(lambda s: replace(s, time=s.stamps + PUT_S * np.searchsorted(after, s.stamps, "right")))
    return paused.noted(note)


def _partings(stream: Stream, time: Array) -> tuple[Mask, Mask]:
    """Return between which rows (N - 1,) poses leap, and between which there is a pause."""
    R = stream.channels["rotation"]
    step = np.maximum(np.diff(time), 1e-9)
    turn = angles(np.swapaxes(R[:-1], 1, 2) @ R[1:])
    leap = (turn > TURN) & (turn / step > FASTEST_TURN)
    if "position" in stream.channels:
        way = np.linalg.norm(np.diff(stream.channels["position"], axis=0), axis=1)
        leap |= (way > WAY) & (way / step > FASTEST_WAY)
    return leap, step > max(PAUSE_S, STEPS * float(np.median(step)))


def _rests(R: Array, time: Array, parted: Mask) -> Array:
    """Return the first and last stamp (K, 2) [s] of the rests that rotations (N, 3, 3) at `time` (N,) consist of.

    None of them (0, 2) where it holds something else, or where nothing parts them (N - 1,).
    """
    none = np.zeros((0, 2))
    if not parted.any():
        return none
    stretch = np.concatenate([[0], np.cumsum(parted)])
    rest = np.zeros(len(time), np.bool_)
    for a, b in spans(stretch):
        if b - a >= FEWEST_AT_REST:
            rest[a:b] = angles(R[(a + b) // 2].T @ R[a:b]) < REST
    kept = [(a, b) for start, stop in spans(stretch) for a, b in runs(rest[start:stop]) + start if b - a > 1]
    turned = len(kept) > 1 and float(angles(R[kept[0][0]].T @ R[rest]).max()) > TURN
    return np.array([(time[a], time[b - 1]) for a, b in kept]) if turned and rest.mean() >= AT_REST else none
