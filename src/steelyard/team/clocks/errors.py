"""How late each robot's stamps are in each recording, beside one offset per robot: said, put right, put in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog, TeamRecording

# A difference is worth a word from so many standard deviations and so much [s], or [s/s].
BEYOND, LEAST_S, LEAST_RATE = 6.0, 1e-4, 1e-6
# Beside a clock that runs fast, rates count from this share of its own.
SHARE = 5e-3
WHICH = "Which of the two clocks is right no log tells."


@dataclass(frozen=True)
class ClockError:
    """Stamps of one robot in one recording that are late by `late` [s] at `middle` [s], and more so by `rate` [s/s].

    late_std, rate_std  standard deviations, zero where they are not known
    """

    late: float = 0.0
    rate: float = 0.0
    middle: float = 0.0
    late_std: float = 0.0
    rate_std: float = 0.0

    def __add__(self, more: ClockError) -> ClockError:
        """Return the error of stamps that have `more` beside what was put right before."""
        known = more.late_std or more.rate_std or not (self.late or self.rate)
        last = more if known else self
        late = self.at(last.middle) + more.at(last.middle)
        return replace(last, late=late, rate=self.rate + more.rate - self.rate * more.rate)

    def at(self, time: float) -> float:
        """Return how late stamps are [s] at a time [s]."""
        return self.late + self.rate * (time - self.middle)

    def right(self, time: Array) -> Array:
        """Return stamps (T,) [s] put right."""
        return np.asarray(time - (self.late + self.rate * (time - self.middle)))

    def own(self, time: Array) -> Array:
        """Return the stamps (T,) [s] that are right at `time` (T,)."""
        return np.asarray(time + (self.late + self.rate * (time - self.middle)) / (1 - self.rate))


PUNCTUAL = ClockError()

# By robot; others are punctual.
Errors = Mapping[str, ClockError]


def joined(errors: Errors, more: Errors) -> Errors:
    """Return the errors of stamps that have `more` beside what was put right before."""
    return {n: errors.get(n, PUNCTUAL) + more.get(n, PUNCTUAL) for n in sorted({*errors, *more})}


@dataclass(frozen=True)
class Step:
    """Stamps of `name` in one recording (its number) that are later by `size` [s] from `at` [s] on."""

    recording: int
    name: str
    at: float
    size: float


@dataclass(frozen=True)
class ClockErrors:
    """What clocks are off by in every recording; nothing where all are punctual.

    step  the clearest jump of a clock within a recording, which nothing in `recordings` holds
    """

    recordings: tuple[Errors, ...] = ()
    step: Step | None = None

    def __bool__(self) -> bool:
        return any(self.recordings)

    def __add__(self, more: ClockErrors) -> ClockErrors:
        if not (self and more):
            return more if more else self
        both = zip(self.recordings, more.recordings, strict=True)
        return ClockErrors(tuple(joined(before, after) for before, after in both))

    def corrected(self, log: TeamLog) -> TeamLog:
        """Return the log with all stamps put right."""
        if not self:
            return log
        pairs = zip(log.recordings, self.recordings, strict=True)
        return log.with_recordings(*(punctual(recording, errors) for recording, errors in pairs))

    def of_reference(self, log: TeamLog) -> ClockErrors:
        """Return what all stamps are off by where the reference itself runs fast or slow; nothing where it does not.

        Accelerations are told by one clock: of three robots and more it is the middle one's, of two the reference's.
        """
        pairs = zip(log.recordings, self.recordings, strict=True)
        found = ClockErrors(tuple(_of_reference(log.reference, recording, errors) for recording, errors in pairs))
        return found if found else NOTHING

    def first(self, log: TeamLog) -> Errors:
        """Return what clocks are off by in the first recording in motion, for which an answer tells its offsets."""
        moving = _moving(log)
        return self.recordings[moving[0]] if self and moving else {}

    def findings(self, log: TeamLog) -> Iterator[Finding]:
        """Yield clock-unsteady for every robot whose clock is set anew between recordings, or runs fast or slow."""
        if not self:
            return
        # What corrections one after the other leave of a fast clock is no rate of the others.
        least = max(LEAST_RATE, SHARE * max(abs(e.rate) for each in self.recordings for e in each.values()))
        for name in log.names:
            moving = [(log.recordings[k].name, self.recordings[k].get(name, PUNCTUAL)) for k in _moving(log)]
            runs = [*_runs(moving, least)]
            words = [*_set_anew(moving), *runs]
            if words:
                whose = "the others'" if name == log.reference else "the reference's"
                said = f"The stamps of '{name}' {' and '.join(words)}, beside {whose}; they were put right."
                yield Finding.of("clock-unsteady", said + (f" {WHICH}" if runs and len(log.names) == 2 else ""))


NOTHING = ClockErrors()


def _of_reference(reference: str, recording: TeamRecording, errors: Errors) -> Errors:
    rates = sorted(errors[name].rate if name in errors else 0.0 for name in recording.tracks)
    usual = float(np.clip(0.0, rates[(len(rates) - 1) // 2], rates[len(rates) // 2]))
    if not usual:
        return {}
    std = min(error.rate_std for error in errors.values())
    middle = float(np.mean([error.middle for error in errors.values()]))
    turned = ClockError(0.0, -usual / (1 - usual), middle)
    return {name: replace(turned, rate_std=std) if name == reference else turned for name in recording.tracks}


def punctual(recording: TeamRecording, errors: Errors) -> TeamRecording:
    """Return the recording with stamps put right."""
    return recording.changed(lambda track, error: track.stamped(error.right(track.time)), errors)


def _moving(log: TeamLog) -> list[int]:
    """Return which recordings tell how late clocks are."""
    return [k for k, recording in enumerate(log.recordings) if recording.kind != "still"]


def _set_anew(moving: Sequence[tuple[str, ClockError]]) -> Iterator[str]:
    """Yield in which recordings stamps are later or earlier than in the first."""
    (first, start), *others = moving
    for name, error in others:
        more, std = error.late - start.late, float(np.hypot(error.late_std, start.late_std))
        if abs(more) > max(LEAST_S, BEYOND * std):
            way = "later" if more > 0 else "earlier"
            yield f"are {1e3 * abs(more):.1f}{_give(1e3 * std)} ms {way} in '{name}' than in '{first}'"


def _runs(moving: Sequence[tuple[str, ClockError]], least: float) -> Iterator[str]:
    """Yield in which recordings a clock runs fast or slow, by at least so much [s/s]."""
    for name, error in moving:
        if abs(error.rate) > max(least, BEYOND * error.rate_std):
            way = "fast" if error.rate > 0 else "slow"
            yield f"run {1e6 * abs(error.rate):.0f}{_give(1e6 * error.rate_std)} ppm {way} in '{name}'"


def _give(std: float) -> str:
    return f" ± {std:.2g}" if std else ""
