"""Parts of logs put one after the other: poses that leap as no arm moves, or across a pause.

What is between was never recorded, so that nothing may be differentiated or aligned across it. A log of rests alone is
a table of still poses, and is read as one: averages over windows that are longer than what noise remembers. In others a
leap becomes a pause.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.logs.clock import median_step
from steelyard.logs.recording import Recording, Stream
from steelyard.logs.runs import runs
from steelyard.sanity.readings.glance import channel, stream_of
from steelyard.sanity.rows.still_rows import angles, as_table, spans, split

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
REST, AT_REST, FEWEST_ROWS = np.radians(1.0), 0.97, 5
# Averages are over about so long [s]; streams with clocks of their own may be so late [s].
WINDOW_S, LATE_S = 0.5, 0.25


def examine_sparse(recording: Recording) -> Recording:
    """Return a log whose rows are too far apart in time to tell a motion as a table of still poses; a note says so.

    Streams with different stamps come back as they are: nothing says which rows belong together. So do rows that turn
    little by little: their stamps are in another unit.
    """
    first = recording.streams[0].time
    if first is None or any(s.time is None or not np.array_equal(s.time, first) for s in recording.streams):
        return recording
    step = median_step(first) if len(first) > 1 else 0.0
    R = next((v for _, _, v in channel(recording, "rotation")), None)
    if step < SPARSE_S or R is None or not (angles(np.swapaxes(R[:-1], 1, 2) @ R[1:]) > TURN).any():
        return recording
    streams = tuple(replace(s, time=None, poses=True, delay=None) for s in recording.streams)
    note = f"rows are {step:.3g} s apart, too far to tell a motion: each was read as a still pose"
    return replace(recording, streams=streams, notes=(*recording.notes, note))


def examine_leaps(recording: Recording) -> Recording:
    """Return the recording as a table of still poses where it holds only rests, else with pauses where poses leap.

    A note says so. Logs without leaps, tables and logs without rotations come back as they are.
    """
    turning = stream_of(recording, "rotation")
    if turning is None or turning.time is None or any(s.time is None for s in recording.streams):
        return recording
    if len(turning) < 2 * FEWEST_ROWS:
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
    return replace(recording, streams=streams, noise={}, notes=(*recording.notes, note))


def _with_pauses(recording: Recording, time: Array, leap: Mask) -> Recording:
    """Return the recording with a pause in all streams wherever poses at `time` (N,) leap (N - 1,) and stay there."""
    lengths = np.diff(np.concatenate([[0], np.flatnonzero(leap) + 1, [len(time)]]))
    lasting = np.minimum(lengths[:-1], lengths[1:]) >= FEWEST_ROWS
    if not lasting.any() or leap.mean() > MOST:
        return recording
    after = time[1:][leap][lasting]
    streams = tuple(
        s if s.time is None else replace(s, time=s.time + PUT_S * np.searchsorted(after, s.time, "right"))
        for s in recording.streams
    )
    where = ", ".join(f"{stamp - time[0]:.1f}" for stamp in after[:5]) + (" and more" if len(after) > 5 else "")
    note = f"the poses leap at {where} s, as where parts of logs are joined: a pause was put there"
    return replace(recording, streams=streams, notes=(*recording.notes, note))


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
        if b - a >= FEWEST_ROWS:
            rest[a:b] = angles(R[(a + b) // 2].T @ R[a:b]) < REST
    kept = [(a, b) for start, stop in spans(stretch) for a, b in runs(rest[start:stop]) + start if b - a > 1]
    turned = len(kept) > 1 and float(angles(R[kept[0][0]].T @ R[rest]).max()) > TURN
    return np.array([(time[a], time[b - 1]) for a, b in kept]) if turned and rest.mean() >= AT_REST else none
