"""Rows that are no measurements: repeated, frozen and clipped ones, judged stream by stream on the raw values.

A value that repeats proves nothing by itself: an orientation at rest, a coarse quantum, a noise-free simulation all
repeat. Each check therefore compares with what the same stream does elsewhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.logs.clipping import NOISE_SHARE, clipped_rows, left_out, noise_shares, saturated, with_neighbours
from steelyard.logs.hung import hung
from steelyard.logs.recording import Recording, Stream
from steelyard.logs.repeated_rows import NOISY, columns_of, repeats, rising
from steelyard.logs.runs import around, lasting
from steelyard.sanity.rows.stray_poses import without_strays
from steelyard.spatial import cross_matrix

# A channel is frozen when it holds still for this long although it never else does.
FROZEN_ROWS, FROZEN_S = 50, 0.25
# A driver hangs so many times in a log at most.
MOST_HUNG = 3
# One that repeats in more than this share of some block of so many rows has a quantum too coarse to tell: the first
# where it holds still at several values, else the second. Others stand still longer than they would by this chance.
COARSE, CHANCE = (0.5, 0.8), 1e-3

# Rows in which gravity and forces are the same to so small a share of themselves repeat a pose without noise.
SAME_PULL = 1e-6
_POSE = ("rotation", "position")
_MEASURED = ("force", "torque", "specific_force", "angular_velocity")


def examine_rows(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording without repeated, stray, frozen and clipped rows, with rising clocks, and what was found."""
    tables = all(s.time is None for s in recording.streams)
    if tables:
        recording, findings = _repeated_in_tables(recording)
        gravity = known_gravity(recording)
        return recording, (*findings, *(f for s in recording.streams for f in clipped_table(s, gravity)))
    streams: list[Stream] = []
    found: list[Finding] = []
    for stream in recording.streams:
        for step in (_without_repeats, without_strays, without_clipped, without_frozen):
            stream, findings = step(stream)
            found.extend(findings)
        streams.append(rising(stream))
    return replace(recording, streams=tuple(streams)), tuple(found)


def _without_repeats(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream with each repeated row once, where rows repeat more often than its quantum explains."""
    again, stamped = repeats(stream)
    if not again.any():
        return stream, ()
    count = int(again.sum())
    message = (
        f"{count} of {len(stream)} rows of '{stream.name}' ({100 * count / len(stream):.0f} %) repeat the row before "
        f"in every channel{_with_stamps(stamped, count)}; each was used once."
    )
    return stream.rows(~again), (Finding.of("rows-duplicated", message),)


def _with_stamps(stamped: int, count: int) -> str:
    if stamped == 0:
        return ""
    return ", with the same stamp" if stamped == count else f", {stamped} of them with the same stamp"


def _repeated_in_tables(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return tables without rows that come again anywhere in all streams together."""
    if len({len(s) for s in recording.streams}) != 1 or len(recording.streams[0]) < 4:
        return recording, ()
    together = np.concatenate([columns_of(s) for s in recording.streams], 1)
    _, first = np.unique(together, axis=0, return_index=True)
    count = len(together) - len(first)
    if count < max(2, 0.05 * len(together)):
        return recording, ()
    rows = np.zeros(len(together), bool)
    rows[first] = True
    message = (
        f"{count} of {len(together)} rows ({100 * count / len(together):.0f} %) repeat an earlier row in every "
        "channel; each was used once."
    )
    streams = tuple(s.rows(rows) for s in recording.streams)
    return replace(recording, streams=streams), (Finding.of("rows-duplicated", message),)


def without_frozen(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream without stretches in which a channel stood still although nothing else says rest."""
    found: list[tuple[str, str]] = []
    if stream.time is None or len(stream) < 4 * FROZEN_ROWS:
        return stream, ()
    frozen = np.zeros(len(stream), bool)
    every = "every channel" if set(stream.channels) <= set(NOISY) else "every noisy channel"
    # Poses, or a counter, may go on beside a driver that hangs, and a wrench beside poses that do.
    for name, rows in ((every, _hung(stream, NOISY)[0]), ("the pose", _hung_poses(stream))):
        if rows.any() and not frozen.any():
            found.append((name, f"stands still in {int(rows.sum())} of {len(rows)} rows and jumps after"))
            frozen = rows
    for quantity in (q for q in NOISY if q in stream.channels):
        values = stream.channels[quantity]
        dead, noisy = _dead(values), noise_shares(values) > NOISE_SHARE
        for axis in range(3):
            name = f"{quantity} {'xyz'[axis]}"
            others = np.delete(np.arange(3), axis)
            rows = _frozen_rows(values[:, axis], stream.time) & ~frozen & noisy[others].any()
            if dead[axis]:
                found.append((name, "does not change at all while its neighbours do"))
            elif rows.any() and _alone(values, axis, rows):
                # One that only came to rest a little before the others, as behind a filter, is no case of its own.
                if rows.sum() >= FROZEN_ROWS:
                    found.append((name, f"stands still in {int(rows.sum())} of {len(rows)} rows and nowhere else"))
                frozen |= rows
    rest, then = left_out(stream, frozen)
    words = [(f"{name[0].upper()}{name[1:]} of '{stream.name}' {what}", what) for name, what in found]
    done = [(text, "it was not used" if "at all" in what else then) for text, what in words]
    return rest, tuple(Finding.of("channel-stuck", f"{text}; {end}.") for text, end in done)


def dead_channels(recording: Recording) -> tuple[bool, ...]:
    """Return which channels (6,) [tau, f] of the wrench never change while their neighbours do.

    Where the wrench is not given in the axes of S, a dead channel is none of the six, and none is returned.
    """
    dead = np.array(recording.dead)
    for stream in (s for s in recording.streams if "force" in s.channels and s.time is not None):
        if stream.turn is not None or len(stream) < 4 * FROZEN_ROWS:
            continue
        for k, quantity in enumerate(("torque", "force")):
            if quantity in stream.channels and stream.frames.get(quantity, "S") == "S":
                dead[3 * k : 3 * k + 3] |= _dead(stream.channels[quantity])
        if stream.arm is not None:
            # Moments about the S origin take from the force.
            dead[:3] |= (cross_matrix(stream.arm) != 0) @ dead[3:]
    return tuple(bool(d) for d in dead)


def _dead(values: Array) -> Mask:
    """Return which of three channels (N, 3) never change while one beside them carries noise."""
    same = (values[1:] == values[:-1]).mean(0)
    lively = (same < 0.3) & (noise_shares(values) > NOISE_SHARE)
    return np.asarray((values == values[0]).all(0) & lively.any())


def _hung_poses(stream: Stream) -> Mask:
    """Return rows (N,) in which noisy poses stand still and then jump.

    Poses without noise stand still at every rest, and jump after one where parts of logs were joined: they are noisy
    where each stretch without change ends in a jump.
    """
    rows, always = _hung(stream, _POSE)
    return rows if always and "rotation" in stream.channels else np.zeros(len(stream), bool)


def _hung(stream: Stream, quantities: tuple[str, ...]) -> tuple[Mask, bool]:
    """Return the rows (N,) of long stretches in which nothing of these changes and that jump after; and if all jump.

    None are where values repeat elsewhere, too, or stand still more than a few times.
    """
    channels = {q: stream.channels[q] for q in quantities if q in stream.channels}
    if stream.time is None or not channels:
        return np.zeros(len(stream), bool), True
    return hung(columns_of(replace(stream, channels=channels)), _rows_needed(stream.time), MOST_HUNG)


def _alone(values: Array, axis: int, rows: Mask) -> bool:
    """Tell whether another axis of values (N, 3) goes on in these rows (N,)."""
    others = np.delete(values, axis, axis=1)
    return bool(((others[1:] == others[:-1])[rows[1:]].mean(0) < 0.5).any())


def _frozen_rows(column: Array, time: Array, aside: Mask | None = None) -> Mask:
    """Return rows (N,) of runs of one value that are long, in a channel that moves on everywhere else.

    aside  rows (N,) that do not tell how often its numbers repeat
    """
    same, none = column[1:] == column[:-1], np.zeros(len(column), bool)
    long = lasting(same, _rows_needed(time))
    elsewhere = same[~(long if aside is None else long | aside[1:])]
    if not long.any() or len(elsewhere) < FROZEN_ROWS:
        return none
    share = max(b.mean() for b in np.array_split(elsewhere, max(len(elsewhere) // FROZEN_ROWS, 1)))
    one_value = bool((column[1:][long] == column[1:][long][0]).all())
    if share > COARSE[one_value]:
        return none
    # At rest amid a quantum all but sqrt(share) of the rows are at one value, or more: so long it lasts by chance.
    by_chance = 2 * np.log(CHANCE / len(column)) / np.log(max(share, 1e-9))
    return around(lasting(long, by_chance))


def _rows_needed(time: Array) -> float:
    return max(FROZEN_ROWS, FROZEN_S * (len(time) - 1) / max(float(time[-1] - time[0]), 1e-9))


def without_clipped(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream without rows at the end of a channel's range."""
    found: list[tuple[str, int, float, int]] = []
    clipped = np.zeros(len(stream), bool)
    for quantity in (q for q in _MEASURED if q in stream.channels):
        values = stream.channels[quantity]
        noisy = noise_shares(values) > NOISE_SHARE
        for axis in np.flatnonzero(noisy).tolist():
            for extreme in (values[:, axis].min(), values[:, axis].max()):
                rows = clipped_rows(values[:, axis], float(extreme))
                if not rows.any() and stream.time is not None:
                    rows = _held_rows(values, axis, float(extreme), stream.time)
                if rows.any():
                    found.append((quantity, axis, float(extreme), int(rows.sum())))
                    clipped |= rows
    rest, then = left_out(stream, with_neighbours(clipped))
    return rest, tuple(saturated(stream.name, *each, len(stream), then) for each in found)


def _held_rows(values: Array, axis: int, extreme: float, time: Array) -> Mask:
    """Return rows (N,) at the extreme value of an axis that stands still there while others go on.

    So it is clipped, though its steps into the stop are no larger than its quantum.
    """
    at = values[:, axis] == extreme
    held = _frozen_rows(values[:, axis], time, at) & at
    return at if held.any() and _alone(values, axis, held) else np.zeros(len(at), bool)


def clipped_table(stream: Stream, gravity: Array | None) -> list[Finding]:
    """Return a finding for each wrench channel of a table whose extreme value comes again and no other does.

    gravity  (N, 3) in S; rows of which it asks the same value are no clipped ones. None where it is not known
    """
    out = []
    for quantity in (q for q in ("force", "torque") if q in stream.channels and len(stream) >= 8):
        for axis, column in enumerate(stream.channels[quantity].T):
            values, counts = np.unique(column, return_counts=True)
            for end in (0, -1):
                if len(values) > 4 and counts[end] >= 3 and counts[1:-1].max() == 1:
                    at = column == values[end]
                    if not _same_pull(stream, at, gravity):
                        extreme, rows = values[end], int(at.sum())
                        out.append(saturated(stream.name, quantity, axis, extreme, rows, len(stream), "check them"))
    return out


def _same_pull(stream: Stream, at: Mask, gravity: Array | None) -> bool:
    """Tell whether rows `at` (N,) are repeats of one pose without noise: gravity (N, 3) and all forces agree."""
    if gravity is None or "force" not in stream.channels:
        return False
    alike = (np.ptp(values[at], axis=0).max() / np.abs(values).max() for values in (gravity, stream.channels["force"]))
    return all(share < SAME_PULL for share in alike)


def known_gravity(recording: Recording) -> Array | None:
    """Return gravity in S (N, 3) where rotations or a channel tell it in every row."""
    found = {q: v for s in recording.streams for q, v in s.channels.items()}
    if "rotation" in found and np.isfinite(found["rotation"]).all():
        return np.asarray(np.swapaxes(found["rotation"], 1, 2) @ recording.gravity)
    return found.get("gravity")
