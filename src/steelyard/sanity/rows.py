"""Rows that are no measurements: repeated, frozen and clipped ones, judged stream by stream on the raw values.

A value that repeats proves nothing by itself: an orientation at rest, a coarse quantum, a noise-free simulation all
repeat. Each check therefore compares with what the same stream does elsewhere.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.logs.clipping import MOST_LEFT_OUT, NOISE_SHARE, clipped_rows, noise_shares, with_neighbours
from steelyard.logs.recording import Recording, Stream
from steelyard.logs.runs import runs
from steelyard.spatial import cross_matrix

# Repeats beyond three times what the quantum of the channels explains, and at least this share of the rows.
REPEATED_SHARE, CHANCE = 0.02, 3.0
# A longer run of equal rows is rest or a frozen driver, not a row logged again.
LONGEST_RUN = 8
# A channel is frozen when it holds still for this long although it never else does.
FROZEN_ROWS, FROZEN_S = 50, 0.25
# Rows in which gravity and forces are the same to so small a share of themselves repeat a pose without noise.
SAME_PULL = 1e-6
_MEASURED = ("force", "torque", "specific_force", "angular_velocity")
_NOISY = ("force", "torque", "specific_force")


def examine_rows(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording without repeated, frozen and clipped rows and with rising clocks, and what was found."""
    tables = all(s.time is None for s in recording.streams)
    if tables:
        recording, findings = _repeated_in_tables(recording)
        return recording, (*findings, *(f for s in recording.streams for f in _clipped_table(s, _gravity(recording))))
    streams: list[Stream] = []
    found: list[Finding] = []
    for stream in recording.streams:
        for step in (without_repeats, without_clipped, without_frozen):
            stream, findings = step(stream)
            found.extend(findings)
        streams.append(_rising(stream))
    return replace(recording, streams=tuple(streams)), tuple(found)


def without_repeats(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream with each repeated row once, where rows repeat more often than its quantum explains."""
    if stream.time is None or len(stream) < 30:
        return stream, ()
    values = _columns(stream)
    equal = values[1:] == values[:-1]
    repeat = equal.all(1)
    stamped = repeat & (np.diff(stream.time) == 0)
    again = repeat & (_run_length(repeat) <= _longest(repeat))
    if not _more_than_chance(equal, again, _moving(stream, values)):
        again = stamped
    count = int(again.sum())
    if count <= max(10, REPEATED_SHARE * len(stream)) and not _many(stamped):
        return stream, ()
    message = (
        f"{count} of {len(stream)} rows of '{stream.name}' ({100 * count / len(stream):.0f} %) repeat the row before "
        f"in every channel{_with_stamps(int(stamped.sum()), count)}; each was used once."
    )
    return _kept(stream, np.concatenate([[True], ~again])), (Finding.of("rows-duplicated", message),)


def without_frozen(stream: Stream) -> tuple[Stream, tuple[Finding, ...]]:
    """Return the stream without stretches in which a channel stood still although nothing else says rest."""
    found: list[tuple[str, str]] = []
    if stream.time is None or len(stream) < 4 * FROZEN_ROWS:
        return stream, ()
    frozen = _hung_rows(stream)
    if frozen.any():
        found.append(("every channel", f"stands still in {int(frozen.sum())} of {len(frozen)} rows and jumps after"))
    for quantity in (q for q in _NOISY if q in stream.channels):
        values = stream.channels[quantity]
        same = values[1:] == values[:-1]
        dead, noisy = _dead(values), noise_shares(values) > NOISE_SHARE
        for axis in range(3):
            name = f"{quantity} {'xyz'[axis]}"
            others = np.delete(np.arange(3), axis)
            rows = _frozen_rows(values[:, axis], stream.time) & ~frozen & noisy[others].any()
            if dead[axis]:
                found.append((name, "does not change at all while its neighbours do"))
            elif rows.any() and (same[rows[1:]][:, others].mean(0) < 0.5).any():
                found.append((name, f"stands still in {int(rows.sum())} of {len(rows)} rows and nowhere else"))
                frozen |= rows
    rest, then = _left_out(stream, frozen)
    return rest, tuple(_stuck(stream, name, what, then) for name, what in found)


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


def _hung_rows(stream: Stream) -> Mask:
    """Return rows (N,) in which a noisy stream repeats one row for long and then jumps, as a hung driver does."""
    values, none = _columns(stream), np.zeros(len(stream), bool)
    if not set(_NOISY) & set(stream.channels) or stream.time is None or not values.shape[1]:
        return none
    same = (values[1:] == values[:-1]).all(1)
    length = _run_length(same)
    long = length >= _rows_needed(stream.time)
    held = runs(long)
    if not 1 <= len(held) <= 3 or same[~long].mean() > 0.05:
        return none
    steps = np.abs(np.diff(values, axis=0))
    typical = np.maximum(np.median(steps[~long], 0), 1e-300)
    for start, stop in held:
        if stop < len(steps) and (steps[stop] > 5 * typical).any():
            none[start : stop + 1] = True
    return none


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
                if rows.any():
                    found.append((quantity, axis, float(extreme), int(rows.sum())))
                    clipped |= rows
    rest, then = _left_out(stream, with_neighbours(clipped))
    return rest, tuple(_saturated(stream, *each, then) for each in found)


def _left_out(stream: Stream, rows: Mask) -> tuple[Stream, str]:
    """Return the stream without `rows` (N,), or all of it where they are too many, and what was done in words."""
    if rows.mean() > MOST_LEFT_OUT:
        return stream, "so many cannot be left out, and these were used as they are"
    return _kept(stream, ~rows) if rows.any() else stream, "these rows were left out"


def _columns(stream: Stream) -> Array:
    """Return all channels side by side (N, K), without those that never change."""
    values = np.concatenate([v.reshape(len(v), -1) for v in stream.channels.values()], 1)
    return np.asarray(values[:, (values != values[0]).any(0)])


def _moving(stream: Stream, values: Array) -> Mask:
    """Return which steps (N-1,) count: all where a channel carries noise, else those in which the body moves."""
    if set(_NOISY) & set(stream.channels):
        return np.ones(len(values) - 1, bool)
    size = np.linalg.norm(np.diff(values, axis=0), axis=1)
    level = np.convolve(size, np.full(11, 1 / 11), "same")
    return np.asarray(level > 0.2 * np.quantile(level, 0.95))


def _more_than_chance(equal: Mask, again: Mask, counted: Mask) -> bool:
    """Tell whether all K channels repeat together more often than their single repeats explain.

    For independent channels the numbers of steps c_k with k channels equal obey c_K <= c_(K-1)^2 / c_(K-2) times
    (K-1) / 2K (Newton's inequality).
    """
    K = equal.shape[1]
    if K < 2 or not counted.any():
        return False
    counts = np.bincount(equal[counted].sum(1), minlength=K + 1).astype(float)
    bound = (counts[K - 1] + 1) ** 2 / (counts[K - 2] + 1) * (K - 1) / (2 * K)
    together = float((again & counted).sum())
    return bool(together > CHANCE * bound + max(10.0, REPEATED_SHARE * float(counted.sum())))


def _run_length(mask: Mask) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return for each true entry the length of its run of true entries, zero elsewhere."""
    lengths = np.ptp(runs(mask), axis=1)
    out = np.zeros(len(mask), np.int64)
    out[mask] = np.repeat(lengths, lengths)
    return out


def _longest(repeat: Mask) -> int:
    """Return how long a run of repeats may be: more where a fast logger holds every sample for many rows."""
    lengths = np.ptp(runs(repeat), axis=1)
    return max(LONGEST_RUN, 2 * int(np.median(lengths))) if len(lengths) > 20 else LONGEST_RUN


def _many(stamped: Mask) -> bool:
    return int(stamped.sum()) >= 10 or float(stamped.mean()) > 0.01


def _with_stamps(stamped: int, count: int) -> str:
    if stamped == 0:
        return ""
    return ", with the same stamp" if stamped == count else f", {stamped} of them with the same stamp"


def _frozen_rows(column: Array, time: Array) -> Mask:
    """Return rows (N,) of runs of one value that are long, in a channel that moves on everywhere else."""
    same = column[1:] == column[:-1]
    length = _run_length(same)
    long = length >= _rows_needed(time)
    if not long.any():
        return np.zeros(len(column), bool)
    elsewhere = same[~long]
    blocks = max(len(elsewhere) // FROZEN_ROWS, 1)
    if len(elsewhere) < FROZEN_ROWS or max(b.mean() for b in np.array_split(elsewhere, blocks)) > 0.5:
        return np.zeros(len(column), bool)
    return np.asarray(np.concatenate([[False], long]) | np.concatenate([long, [False]]))


def _rows_needed(time: Array) -> float:
    return max(FROZEN_ROWS, FROZEN_S * (len(time) - 1) / max(float(time[-1] - time[0]), 1e-9))


def _stuck(stream: Stream, name: str, what: str, then: str) -> Finding:
    done = "it was not used" if "at all" in what else then
    return Finding.of("channel-stuck", f"{name[0].upper()}{name[1:]} of '{stream.name}' {what}; {done}.")


def _saturated(stream: Stream, quantity: str, axis: int, extreme: float, rows: int, then: str) -> Finding:
    return Finding.of(
        "channel-saturated",
        f"{quantity.capitalize()} {'xyz'[axis]} of '{stream.name}' stops at {extreme:.6g} in {rows} of "
        f"{len(stream)} rows; {then}.",
    )


def _kept(stream: Stream, rows: Mask) -> Stream:
    time = None if stream.time is None else stream.time[rows]
    return replace(stream, channels={q: v[rows] for q, v in stream.channels.items()}, time=time)


def _rising(stream: Stream) -> Stream:
    """Return the stream with equal stamps of a coarse clock spread evenly up to the next one."""
    if stream.time is None or (np.diff(stream.time) > 0).all():
        return stream
    stamps, first, counts = np.unique(stream.time, return_index=True, return_counts=True)
    gap = np.diff(stamps)
    gap = np.append(gap, np.median(gap)) if len(gap) else np.ones(1)
    gap = np.minimum(gap, 2 * np.median(gap))
    place = np.arange(len(stream.time)) - np.repeat(first, counts)
    return replace(stream, time=stream.time + np.repeat(gap / counts, counts) * place)


def _repeated_in_tables(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return tables without rows that come again anywhere in all streams together."""
    if len({len(s) for s in recording.streams}) != 1 or len(recording.streams[0]) < 4:
        return recording, ()
    together = np.concatenate([_columns(s) for s in recording.streams], 1)
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
    streams = tuple(_kept(s, rows) for s in recording.streams)
    return replace(recording, streams=streams), (Finding.of("rows-duplicated", message),)


def _clipped_table(stream: Stream, gravity: Array | None) -> list[Finding]:
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
                        out.append(_saturated(stream, quantity, axis, values[end], int(at.sum()), "check them"))
    return out


def _same_pull(stream: Stream, at: Mask, gravity: Array | None) -> bool:
    """Tell whether rows `at` (N,) are repeats of one pose without noise: gravity (N, 3) and all forces agree."""
    if gravity is None or "force" not in stream.channels:
        return False
    alike = (np.ptp(values[at], axis=0).max() / np.abs(values).max() for values in (gravity, stream.channels["force"]))
    return all(share < SAME_PULL for share in alike)


def _gravity(recording: Recording) -> Array | None:
    """Return gravity in S (N, 3) where rotations or a channel tell it in every row."""
    found = {q: v for s in recording.streams for q, v in s.channels.items()}
    if "rotation" in found and np.isfinite(found["rotation"]).all():
        return np.asarray(np.swapaxes(found["rotation"], 1, 2) @ recording.gravity)
    return found.get("gravity")
