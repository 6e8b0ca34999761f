"""Clocks: stamps in a smaller unit than was said, and wrench and poses that were logged apart.

Stamps in ms that are read as s make a log a thousand times as long, a motion too slow to be seen. Its accelerations are
then a million times too small; in the right unit the mass that is accelerated is the mass that is weighed.

Delays of clocks that count from different moments are looked for within a quarter of a second once streams are aligned.
Here the poses are moved along the wrench until the force turns with them: f = m a - R^T u + bias is linear in u,
whatever gravity, sign and mass are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, percent
from steelyard.logs.clock import median_step
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.readings.glance import glance, resampled
from steelyard.sanity.readings.rivals import best_rival, reading_of
from steelyard.sanity.readings.static_fit import masses_at_a_glance
from steelyard.spatial import Rotation

# Turns are judged from so many rows on.
FEWEST_ROWS = 200
# Units of time, each a thousand of the next, and how much smaller than was said they may be.
UNITS = ("s", "ms", "us", "ns")
SMALLER = (1e-3, 1e-6, 1e-9)
# Both masses agree within this share, or so many standard deviations; that which is accelerated is beyond so many from
# none, and both explain all but the last share of the force variance. In a unit that is not theirs, accelerations are a
# million times too large, and that mass is none.
ALIKE, WITHIN, SURE, LEFT = 0.1, 2.0, 5.0, 0.05
# A log longer than this [s] whose turns hardly change from row to row, rows being further apart than that [s], is
# doubtful: so much of a turn is that of the row before. It must turn by as much as the last [rad].
LONG_S, APART_S, LIKE_BEFORE, TURNED = 3600.0, 0.5, 0.95, np.radians(20.0)

# As given the force must leave more than the first share of its variance, or share no time with the poses; moved, less
# than the second, and less than so much of what it leaves as given.
BAD, WELL, MUCH_BETTER = 0.1, 0.03, 0.1
# Steps [s] of the search, of which there are no more than so many in the longer log.
STEP_S, _MOST_STEPS = 0.1, 3000
# What is compared must last so long [s], and for half of the shorter log.
SHORTEST_S, OVERLAP = 5.0, 0.5
# Delays below this [s] are found by aligning.
LEAST_S = 0.2
REMEDY = (
    "Check that both files are of one run, and start their clocks together next time; what is left of the delay was "
    "looked for, too."
)


def examine_clock(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with its stamps in seconds where rows too far apart for a motion are one in another unit."""
    if any(s.time is None for s in recording.streams) or glance(recording) is not None:
        return recording, ()
    said = {UNITS.index(s.said) for s in recording.streams}
    for steps, seconds in enumerate(SMALLER[: len(UNITS) - 1 - max(said)], 1):
        # A delay was declared in a unit of its own.
        quicker = replace(recording, streams=tuple(replace(s, time=s.stamps * seconds) for s in recording.streams))
        if _one_mass(quicker):
            return quicker, (_finding(said, steps),)
    return _doubted(recording), ()


def _doubted(recording: Recording) -> Recording:
    """Return the recording with a note where its poses turn little by little although rows are seconds apart."""
    turning = recording.stream_of("rotation")
    if turning is None or turning.time is None or len(turning) < FEWEST_ROWS:
        return recording
    step, span = median_step(turning.time), float(turning.time[-1] - turning.time[0])
    R = turning.channels["rotation"]
    turns = Rotation.nearest(np.swapaxes(R[:-1], 1, 2) @ R[1:]).log()
    like = float((turns[1:] * turns[:-1]).sum()) / max(float((turns**2).sum()), 1e-300)
    if span < LONG_S or step < APART_S or like < LIKE_BEFORE or float(np.ptp(turns.cumsum(0), axis=0).max()) < TURNED:
        return recording
    note = (
        f"rows are {step:.3g} s apart over {span / 3600:.2g} h, but poses turn little by little: if it was quicker, "
        "the stamps are in a smaller unit than was said"
    )
    return recording.noted(note)


def _finding(said: set[int], steps: int) -> Finding:
    """Return `time-unit` where stamps said to be in units of these numbers are so many steps of a thousand smaller."""
    if len(said) == 1:
        (old,) = (UNITS[k] for k in said)
        unit = UNITS[UNITS.index(old) + steps]
        which, remedy = f"in {unit}, not in {old}", f'Set unit = "{unit}" in time of every stream.'
    else:
        pairs = ", ".join(f'unit = "{UNITS[k + steps]}" for "{UNITS[k]}"' for k in sorted(said))
        which, remedy = f"in units {1000**steps:.3g} times smaller than said", f"Set in time of every stream {pairs}."
    text = f"The stamps are {which}: so read, the load is accelerated as it is weighed. The answer assumes this."
    return Finding("time-unit", text, remedy)


def _one_mass(recording: Recording) -> bool:
    """Whether force follows acceleration and gravity as those of one mass."""
    view = glance(recording)
    if view is None or view.acceleration is None or view.rotation is None:
        return False
    masses, spread, left = masses_at_a_glance(view, recording.gravity, view.rotation)
    moved, weighed = (float(v) for v in masses)
    size, std = abs(weighed), float(spread.max())
    return std < size / SURE and left < LEFT and abs(moved - weighed) < max(ALIKE * size, WITHIN * std)


def examine_offset(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with the streams of other files moved to the clock of the wrench, and what is said of it."""
    felt, posed = recording.stream_of("force", "torque"), recording.stream_of("rotation")
    if felt is None or posed is None or felt.time is None or posed.time is None or posed.delay is not None:
        return recording, ()
    if _file(felt) == _file(posed) or felt.in_world("force") or _explained(recording):
        return recording, ()
    late, left, before = _best(felt, posed, felt.time, posed.time)
    if abs(late) < LEAST_S or left > min(WELL, MUCH_BETTER * before):
        return recording, ()
    text = (
        f"The stamps of '{posed.name}' are {'late' if late > 0 else 'early'} by {abs(late):.1f} s against the wrench: "
        f"so moved, {percent(left)} of the force variance is left unexplained"
        f"{f' instead of {percent(before)}' if before < 1 else ', and as given they share too little time'}. "
        "The answer assumes this."
    )

    def moved(s: Stream) -> Stream:
        stays = s.time is None or s.delay is not None or _file(s) == _file(felt)
        return s if stays else replace(s, time=s.stamps - late, moved=late)

    return recording.changed(moved), (Finding("stream-delayed", text, REMEDY),)


def _file(stream: Stream) -> str:
    return stream.name.partition("#")[0]


def _explained(recording: Recording) -> bool:
    """Tell whether force and poses fit as they are, or as another reading of their description has them."""
    view = glance(recording)
    if view is None or view.rotation is None:
        return False
    given = reading_of(view, "", recording.gravity, view.rotation)
    return given.fit.force_share < BAD or best_rival(recording, view, given) is not None


def _best(felt: Stream, posed: Stream, clock: Array, other: Array) -> tuple[float, float, float]:
    """Return how late [s] poses are with which the force fits best, and the shares of variance left so and as given.

    As given all is left where they share too little time.
    """
    step = max(STEP_S, max(np.ptp(clock), np.ptp(other)) / _MOST_STEPS)
    force = _on_steps(clock, felt.channels["force"], step)
    if felt.turn is not None:
        force = felt.turn.apply(force)
    turned = np.swapaxes(_on_steps(other, posed.channels["rotation"], step), 1, 2)
    fewest = max(int(OVERLAP * min(len(force), len(turned))), int(SHORTEST_S / step))
    lags = range(fewest - len(turned), len(force) - fewest + 1)
    left = {lag: _left_at(force, turned, lag) for lag in lags}
    if not left:
        return 0.0, 1.0, 1.0
    lag = min(left, key=lambda k: left[k])
    late = float(other[0] - clock[0]) - step * (lag + _between([left.get(lag + k, 1.0) for k in (-1, 0, 1)]))
    given = round(float(other[0] - clock[0]) / step)
    return late, left[lag], left.get(given, 1.0)


def _on_steps(clock: Array, values: Array, step: float) -> Array:
    """Return the means (M, ..) of values (N, ..) over steps [s] from the first stamp on."""
    rows = max(int(np.ptp(clock) / step), 2)
    return resampled(clock, values, np.asarray(clock[0] + step * (np.arange(rows) + 0.5), dtype=np.float64))


def _left_at(force: Array, turned: Array, lag: int) -> float:
    """Return the share of the variance of forces (N, 3) left by turns (M, 3, 3) whose first row is at row `lag`."""
    start, end = max(lag, 0), min(lag + len(turned), len(force))
    f, R = force[start:end] - force[start:end].mean(0), turned[start - lag : end - lag]
    R = R - R.mean(0)
    normal, right = np.einsum("nij,nik->jk", R, R), np.einsum("nij,ni->j", R, f)
    u = np.linalg.lstsq(normal, right, rcond=1e-6)[0]
    variance = float((f**2).sum())
    return 1.0 - float(right @ u) / variance if variance > 0 else 1.0


def _between(left: list[float]) -> float:
    """Return where between its neighbours, -0.5 to 0.5 steps off, the least of three shares has its minimum."""
    bend = left[0] - 2 * left[1] + left[2]
    return 0.5 * (left[0] - left[2]) / bend if bend > 0 else 0.0
