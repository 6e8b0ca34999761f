"""Clocks that jump within a recording: it is cut there, so that either part has a clock of its own.

How fast a rigid payload turns is the same for every robot, so that two clocks are apart by the shift at which their
robots turn alike. Where one shift fits up to some time, and another from there on, either far better than the other's,
and one that grows steadily does not, a clock has jumped. What it jumped by, the fit tells as for clocks that are set
anew between recordings (`unsteady`). The recording is cut at the gap that the jump leaves in the stamps, or, where
stamps were counted and rows lost, at the time at which both shifts together fit best.
Source: own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from steelyard.check import Array
from steelyard.logs.clock import jump_gap
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.team.clocks.errors import NOTHING, ClockError, ClockErrors, Errors
from steelyard.team.turning_speed import turning_speed

# Shifts are looked for up to so many seconds, and a share of the recording, in steps, and jumps by so much about the
# one that fits best throughout; speeds are those over OVER_S.
FARTHEST_S, SHARE, STEP_S, OVER_S = 2.0, 0.25, 0.01, 0.05
LARGEST_S = 0.7
# Times at which a clock may have jumped [s] apart, and how long a part must be at least [s].
BIN_S, LEAST_S = 0.1, 2.5
# By how much [s] a clock that is called must have jumped; either part's own shift leaves less by this factor than the
# other's; both together leave less than a shift that grows steadily; and robots turn alike but for this share.
JUMPS_S, FITS, BETTER, LEFT = 0.025, 2.0, 1.1, 0.5
_WIDTH = round(BIN_S / STEP_S)
# [s] to either side of a jump that leaves no gap, which are left out; and jumps of one recording.
UNSURE_S, MOST = 0.3, 3
NONE = ClockError()


@dataclass(frozen=True)
class Jump:
    """Stamps of `name` that are late by `before` [s] up to `last` on the reference's clock, by `after` from `first`."""

    name: str
    last: float
    first: float
    before: float
    after: float


def cut_at_jumps(log: TeamLog) -> tuple[TeamLog, ClockErrors]:
    """Return the log with recordings cut where clocks jump and stamps put right, and what they were off by."""
    made = [part for r in log.recordings for part in _parts(log, r, MOST)]
    if len(made) == len(log.recordings):
        return log, NOTHING
    errors = ClockErrors(tuple(late for _, late in made))
    return errors.corrected(log.with_recordings(*(part for part, _ in made))), errors


def _parts(log: TeamLog, recording: TeamRecording, most: int) -> list[tuple[TeamRecording, Errors]]:
    """Return a recording, or its parts, each with what clocks that jumped before it are late by."""
    if recording.kind == "still" or not most:
        return [(recording, {})]
    for name in log.others:
        jump = find_jump(recording, log.reference, name)
        if jump is not None:
            first, second = _cut(recording, jump)
            if name in first.tracks and name in second.tracks and min(len(first.tracks), len(second.tracks)) > 1:
                more = ClockError(jump.after - jump.before)
                later = [(r, {**late, name: more + late.get(name, NONE)}) for r, late in _parts(log, second, most - 1)]
                return [*_parts(log, first, most - 1), *later]
    return [(recording, {})]


def find_jump(recording: TeamRecording, reference: str, name: str) -> Jump | None:
    """Return where the clock of one robot surely jumps beside the reference's, None where it does not."""
    if not {name, reference} <= recording.tracks.keys():
        return None
    own, other = recording.tracks[reference], recording.tracks[name]
    begin, end = recording.span
    far, most = round(min(FARTHEST_S, SHARE * (end - begin)) / STEP_S), round(LARGEST_S / STEP_S)
    time = np.arange(begin, end - OVER_S, STEP_S)
    if len(time) * STEP_S < 2 * (LEAST_S + LARGEST_S):
        return None
    x, y = (_speed(track, time) for track in (own, other))
    if x is None or y is None:
        return None
    usual = int(_costs(x, y, far).sum(1).argmin()) - far
    splits = [_split(x, y, common, most) for common in {0, usual}]
    best = min((split for split in splits if split is not None), key=lambda split: split.left, default=None)
    if best is None or not best.sure:
        return None
    last, first = _place(own, other, begin + best.at, best.before, best.after)
    return Jump(name, last, first, best.before, best.after)


@dataclass(frozen=True)
class _Split:
    """Two shifts [s] that together fit best, `before` the time `at` [s] and `after` it.

    left    share of how the speed varies that they leave
    fits    how many times as much either part is left by the other's shift, the lesser of the two
    both    what they leave in all, of `cost`
    cost    (S, K) what every shift leaves of every bin
    """

    at: float
    before: float
    after: float
    left: float
    fits: float
    both: float
    cost: Array

    @property
    def sure(self) -> bool:
        far = abs(self.after - self.before) > JUMPS_S
        # What a steady drift leaves takes longest to tell, and is asked last.
        return far and self.fits > FITS and self.left < LEFT and _steady(self.cost) > BETTER * self.both


def _split(x: Array, y: Array, common: int, most: int) -> _Split | None:
    """Return the best split of two speeds (T,), by shifts within `most` steps of one that they have in common."""
    begin = most + max(-common, 0)
    x, y = x[max(-common, 0) :], y[max(common, 0) :]
    x, y = x[: len(y)], y[: len(x)]
    ends = round(LEAST_S / BIN_S)
    if len(x) * STEP_S < 2 * (LEAST_S + LARGEST_S) + BIN_S:
        return None
    cost, inner = _costs(x, y, most), x[most:-most]
    least = 1e-12 * float(inner @ inner) + 1e-300
    sums = np.cumsum(cost, axis=1)
    rest = sums[:, -1:] - sums
    at = int((sums.min(0) + rest.min(0))[ends:-ends].argmin()) + ends
    i, j = int(sums[:, at].argmin()), int(rest[:, at].argmin())
    one, two = (max(float(value), least) for value in (sums[i, at], rest[j, at]))
    before, after = (STEP_S * (k - most + common) for k in (i, j))
    return _Split(
        STEP_S * begin + BIN_S * (at + 1), before, after,
        (one + two) / float(((inner - inner.mean()) ** 2).sum() + least),
        min(sums[j, at] / one, rest[i, at] / two), one + two, cost,
    )  # fmt: skip


def _speed(track: Track, time: Array) -> Array | None:
    """Return how fast a robot turns (T,), through its gaps too; None where that is not known at all."""
    speed = turning_speed(track, time, OVER_S)
    good = np.isfinite(speed)
    return np.interp(time, time[good], speed[good]) if good.sum() > 0.5 * len(time) else None


@njit(cache=True)
def _costs(x: Array, y: Array, most: int) -> Array:
    """Return the squares (S, K) left between two speeds at every shift, summed over bins."""
    count = (len(x) - 2 * most) // _WIDTH
    out = np.empty((2 * most + 1, count))
    for shift in range(len(out)):
        for k in range(count):
            total = 0.0
            for t in range(k * _WIDTH, (k + 1) * _WIDTH):
                off = x[most + t] - y[shift + t]
                total += off * off
            out[shift, k] = total
    return out


def _steady(cost: Array) -> float:
    """Return the least that a shift leaves which grows or falls steadily, by up to all that is looked for."""
    shifts, bins = cost.shape
    along, where = np.linspace(-0.5, 0.5, bins), np.arange(bins)
    least = np.inf
    for grows in np.arange(1 - shifts, shifts, 2):
        rows = np.round(grows * along).astype(np.int64)
        starts = np.arange(-rows.min(), shifts - rows.max())
        if len(starts):
            least = min(least, float(cost[starts[:, None] + rows, where].sum(1).min()))
    return least


def _place(own: Track, other: Track, near: float, before: float, after: float) -> tuple[float, float]:
    """Return the last time before a jump and the first after it on the reference's clock."""
    for track, size, offsets in ((other, after - before, (before, after)), (own, before - after, (0.0, 0.0))):
        k = jump_gap(track.time, size, near + offsets[0])
        if k is not None:
            return float(track.time[k] - offsets[0]), float(track.time[k + 1] - offsets[1])
    return near - UNSURE_S, near + UNSURE_S


def _cut(recording: TeamRecording, jump: Jump) -> tuple[TeamRecording, TeamRecording]:
    """Return what was recorded before and after a jump."""
    begin = min(float(track.time[0]) for track in recording.tracks.values())
    parts = []
    for later, edge, own in ((False, jump.last, jump.before), (True, jump.first, jump.after)):
        tracks = {}
        for name, track in recording.tracks.items():
            time = track.time - (own if name == jump.name else 0.0)
            rows = time >= edge - 1e-9 if later else time <= edge + 1e-9
            if rows.sum() > 1:
                tracks[name] = track.rows(rows)
        parts.append(tracks)
    named = f"{recording.name} from {jump.first - begin:.1f} s on"
    return replace(recording, tracks=parts[0]), replace(recording, tracks=parts[1], name=named)
