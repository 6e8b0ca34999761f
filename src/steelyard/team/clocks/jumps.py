"""Clocks that jump within a recording: it is cut there, so that either part has a clock of its own.

How fast a rigid payload turns is the same for every robot, so that two clocks are apart by the shift at which their
robots turn alike. Where one shift fits up to some time, and another from there on, either far better than the other's,
and one that grows steadily does not, a clock has jumped. What it jumped by, the fit tells as for clocks that are set
anew between recordings (`unsteady`). The recording is cut at the gap that the jump leaves in the stamps, or, where
stamps were counted and rows lost, at the time at which both shifts together fit best. A robot that may hold nothing for
a while goes ways of its own meanwhile: how it turns then tells of no clock.
Source: own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadValue
from steelyard.logs.clock import NEAR_S, SAME_S, UNSURE_S, jump_gap
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.team.adjoint import turning_speed
from steelyard.team.changes.presence import LIGHT, perhaps_idle, usual_push
from steelyard.team.clocks.errors import NOTHING, ClockError, ClockErrors, Errors, Step, joined, punctual
from steelyard.team.clocks.shifts import LARGEST_S, LEAST_S, LEFT, STEP_S, WIDTH, Split, best_line, best_split, costs

# Shifts are looked for up to so many seconds, and a share of the recording; speeds are those over OVER_S.
FARTHEST_S, SHARE, OVER_S = 2.0, 0.25, 0.05
# Clocks that drift apart by so much [s] over a recording, up to this rate, are put right before the fit: where one
# shift leaves more than this share of how the speed varies, and so many times what one leaves that grows, in so many
# bins.
DRIFTS_S, FASTEST, ROUGH, DRIFTING, FEW_BINS = 0.04, 0.015, 0.002, 1.3, 200
# Jumps of one recording.
MOST = 3


@dataclass(frozen=True)
class Jump:
    """Stamps of `name` that are late by `before` [s] up to `last` on the reference's clock, by `after` from `first`."""

    name: str
    last: float
    first: float
    before: float
    after: float


def cut_at_jumps(log: TeamLog, drifts: bool = False) -> tuple[TeamLog, ClockErrors]:
    """Return the log with recordings cut where clocks jump and stamps put right, and what they were off by.

    drifts  whether stamps of clocks that run so fast or slow that a fit would not find its way are put right, too
    """
    made = [part for r in log.recordings for part in _parts(log, r, MOST, drifts)]
    errors = ClockErrors(tuple(late for _, late in made))
    if not errors:
        return log, NOTHING
    cut = log.with_recordings(*(part for part, _ in made))
    return errors.corrected(cut), errors


def _parts(log: TeamLog, recording: TeamRecording, most: int, drifts: bool) -> list[tuple[TeamRecording, Errors]]:
    """Return a recording, or its parts, each with what clocks are late by that run fast or jumped before it."""
    if recording.kind == "still":
        return [(recording, {})]
    pairs = dict(_pairs(log, recording))
    for name in pairs if most else ():
        jump = pairs[name].jump()
        if jump is None:
            continue
        # A leap of the reference is one of all others.
        jumps = (jump, *_alike(jump, [pair.jump() for n, pair in pairs.items() if n != name]))
        first, second = _cut(recording, jumps)
        both = all(jump.name in part.tracks for jump in jumps for part in (first, second))
        if both and min(len(first.tracks), len(second.tracks)) > 1:
            more = {jump.name: ClockError(jump.after - jump.before) for jump in jumps}
            before, after = (_parts(log, part, most - 1, drifts) for part in (first, second))
            return [*before, *((part, joined(more, late)) for part, late in after)]
    found = ((name, pair.drift()) for name, pair in pairs.items() if drifts)
    return [(recording, {name: drift for name, drift in found if drift is not None})]


def cut_at_step(
    log: TeamLog, errors: ClockErrors, step: Step, late: Mapping[str, float]
) -> tuple[TeamLog, ClockErrors]:
    """Return the log with a recording cut where the clock of one robot steps and its stamps put right, and all errors.

    errors  what was put right before     late  how late each clock is [s] beside them
    """
    recording = log.recordings[step.recording]
    # A step of the reference is one of all others.
    moved = log.others if step.name == log.reference else (step.name,)
    size = -step.size if step.name == log.reference else step.size
    shown = next(name for name in moved if name in recording.tracks)
    own, other = (recording.tracks.get(name, recording.tracks[shown]) for name in (log.reference, shown))
    shift = late.get(shown, 0.0) - late.get(log.reference, 0.0)
    last, first = _place(own, other, step.at + late.get(log.reference, 0.0), shift, shift + size)
    offsets = {name: late.get(name, 0.0) - late.get(log.reference, 0.0) for name in recording.tracks}
    jumps = [
        Jump(name, last, first, offset, offset + (size if name in moved else 0.0)) for name, offset in offsets.items()
    ]
    before, after = _cut(recording, jumps)
    if min(len(before.tracks), len(after.tracks)) < len(recording.tracks):
        raise BadValue(f"'{recording.name}' cannot be cut at {step.at:.1f} s.")
    cut = [r for k, one in enumerate(log.recordings) for r in ((before, after) if k == step.recording else (one,))]
    known = list(errors.recordings) if errors else [{} for _ in log.recordings]
    more = {name: ClockError(size) for name in moved if name in after.tracks}
    known.insert(step.recording + 1, joined(known[step.recording], more))
    cut[step.recording + 1] = punctual(after, more)
    return log.with_recordings(*cut), ClockErrors(tuple(known))


def _alike(jump: Jump, others: Iterable[Jump | None]) -> Iterator[Jump]:
    """Yield those that jump when this one does, and by as much."""
    for other in others:
        if other is None or abs(other.last - jump.last) > NEAR_S:
            continue
        if abs((other.after - other.before) - (jump.after - jump.before)) < SAME_S:
            yield other


@dataclass(frozen=True, eq=False)
class _Pair:
    """How fast the reference and another robot turn, x and y (T,) at `time`, and what shifts within `far` leave of it.

    cost   (2 far + 1, K) squares that every shift of y leaves of every bin, of `width` steps
    """

    log: TeamLog
    recording: TeamRecording
    name: str
    time: Array
    x: Array
    y: Array
    far: int
    width: int
    cost: Array

    def jump(self) -> Jump | None:
        """Return where the clock surely jumps beside the reference's, None where it does not.

        Who holds nothing for a while turns as he likes: the time in which both surely hold the payload must show it.
        """
        best = self._best(self.x, self.y)
        if best is not None and (light := self._light()).any():
            best = self._best(*(np.where(light, np.nan, speed) for speed in (self.x, self.y)))
        if best is None:
            return None
        own, other = (self.recording.tracks[n] for n in (self.log.reference, self.name))
        last, first = _place(own, other, float(self.time[0]) + best.at, best.before, best.after)
        return Jump(self.name, last, first, best.before, best.after)

    def _light(self) -> Mask:
        """Return when (T,) either robot may hold nothing."""
        out = np.zeros(len(self.time), np.bool_)
        for name in (self.log.reference, self.name):
            track = self.recording.tracks[name]
            rows = perhaps_idle(track, LIGHT, usual_push(self.log, name))
            out |= np.interp(self.time, track.time, rows) > 0
        return out

    def _best(self, x: Array, y: Array) -> Split | None:
        """Return the best split of two speeds (T,), NaN where they tell nothing, if it is sure."""
        usual = int(self.cost.sum(1).argmin()) - self.far
        splits = [best_split(x, y, common, round(LARGEST_S / STEP_S)) for common in {0, usual}]
        best = min((split for split in splits if split is not None), key=lambda split: split.left, default=None)
        return best if best is not None and best.sure else None

    def drift(self) -> ClockError | None:
        """Return how the clock surely runs fast or slow beside the reference's, so much that no fit would follow."""
        inner, left = self.x[self.far : -self.far], self.cost.sum(1)
        total, usual = float(((inner - inner.mean()) ** 2).sum()), float(left.min())
        third = self.cost.shape[1] // 3
        apart = int(self.cost[:, :third].sum(1).argmin()) - int(self.cost[:, -third:].sum(1).argmin())
        if usual < ROUGH * total or abs(apart) * STEP_S < DRIFTS_S / 2:
            return None
        bins, bin_s = self.cost.shape[1], STEP_S * self.width
        seconds = bin_s * (bins - 1)
        least, start, grows = best_line(self.cost, min(int(FASTEST * seconds / STEP_S), 2 * self.far))
        if abs(grows) * STEP_S < DRIFTS_S or least > LEFT * total or usual < DRIFTING * least:
            return None
        middle = float(self.time[0]) + STEP_S * self.far + 0.5 * bin_s * bins
        return ClockError(STEP_S * (start - self.far), STEP_S * grows / seconds, middle)


def _pairs(log: TeamLog, recording: TeamRecording) -> Iterator[tuple[str, _Pair]]:
    """Yield the pair of each robot and the reference of which enough is known."""
    begin, end = recording.span
    far = round(min(FARTHEST_S, SHARE * (end - begin)) / STEP_S)
    time = np.arange(begin, end - OVER_S, STEP_S)
    if log.reference not in recording.tracks or len(time) * STEP_S < 2 * (LEAST_S + LARGEST_S):
        return
    x = _speed(recording.tracks[log.reference], time)
    if x is None:
        return
    width = WIDTH * -(-((len(x) - 2 * far) // WIDTH) // FEW_BINS)
    for name in log.others:
        track = recording.tracks.get(name)
        y = None if track is None else _speed(track, time)
        if y is not None:
            yield name, _Pair(log, recording, name, time, x, y, far, width, costs(x, y, far, width))


def _speed(track: Track, time: Array) -> Array | None:
    """Return how fast a robot turns (T,), through its gaps too; None where that is not known at all."""
    speed = turning_speed(track, time, OVER_S)
    good = np.isfinite(speed)
    return np.interp(time, time[good], speed[good]) if good.sum() > 0.5 * len(time) else None


def _place(own: Track, other: Track, near: float, before: float, after: float) -> tuple[float, float]:
    """Return the last time before a jump and the first after it on the reference's clock."""
    for track, size, offsets in ((other, after - before, (before, after)), (own, before - after, (0.0, 0.0))):
        k = jump_gap(track.time, size, near + offsets[0])
        if k is not None:
            return float(track.time[k] - offsets[0]), float(track.time[k + 1] - offsets[1])
    return near - UNSURE_S, near + UNSURE_S


def _cut(recording: TeamRecording, jumps: Sequence[Jump]) -> tuple[TeamRecording, TeamRecording]:
    """Return what was recorded before and after jumps at about one time."""
    begin = min(float(track.time[0]) for track in recording.tracks.values())
    before, after = {jump.name: jump.before for jump in jumps}, {jump.name: jump.after for jump in jumps}
    last, first = min(jump.last for jump in jumps), max(jump.first for jump in jumps)
    parts = []
    for later, edge, own in ((False, last, before), (True, first, after)):
        tracks = {}
        for name, track in recording.tracks.items():
            time = track.time - own.get(name, 0.0)
            rows = time >= edge - 1e-9 if later else time <= edge + 1e-9
            if rows.sum() > 1:
                tracks[name] = track.rows(rows)
        parts.append(tracks)
    named = f"{recording.name} from {first - begin:.1f} s on"
    return replace(recording, tracks=parts[0]), replace(recording, tracks=parts[1], name=named)
