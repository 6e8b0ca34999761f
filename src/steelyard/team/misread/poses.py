"""Robots whose poses are read wrongly: positions in another unit, rotations or whole poses the other way round.

No grasps and homes then fit the team. Every common misreading is undone for each robot in turn, in all recordings or in
one, and for all robots at once where rotations are misread, as where one logger wrote them all: where one of them makes
poses fit, it is named. A reading is judged by its first grasps in closed form; only the best few are fitted.
Two robots whose files stand in each other's place in one recording leave no grasps and homes that fit, either.
Exchanged in every recording they are merely called by each other's name, which no pose can tell.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Generic, TypeVar

import numpy as np

from steelyard.check import FAILURES, Array
from steelyard.errors import BadValue
from steelyard.findings import quoted
from steelyard.logs.misread import MISREAD
from steelyard.logs.recording import INCH
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose, Rotation
from steelyard.team.adjoint import extent
from steelyard.team.changes.presence import SHARE as IDLE
from steelyard.team.changes.presence import idle
from steelyard.team.clocks.lags import far_lags
from steelyard.team.poses.fit import GUESS, ROUGHLY, Rows, fit_poses
from steelyard.team.poses.measured import TeamMotion, first_team, in_words
from steelyard.team.stacked import Stretch, stretches

# Rows of a recording that are enough to tell; readings that are fitted at most.
ROWS, MOST = 50, 4
# So read, noise is below this share of what each robot turns and moves, and these shares fall by this factor (rms).
FITS, CLOSES = 0.15, 4.0
# Readings within this factor of the best are as good; those within the other are worth a fit.
AS_GOOD, NEAR = 2.0, 20.0
# Nor is a reading worth one whose start is not better than the fit of poses as given by this factor.
BETTER = 2.0
# Of a team of so many, only those are tried without whom the others fit better by that factor.
MANY = 4
# A payload that turns by less [rad] does not turn.
STILL = 0.02

X = TypeVar("X")
SWAP = "Set the form that its quaternions have: quaternion-wxyz or quaternion-xyzw."
TRANSPOSE = 'Give its "rotation" from its grasp into its home: name the columns of the matrix in transposed order.'
# Rows of a recording that are enough to tell; exchanges that are tried at most.
EXCHANGED_ROWS, EXCHANGES = 100, 120
# The noise of all robots' turns and places must fall by this factor each on average.
EXCHANGE_CLOSES = 5.0


@dataclass(frozen=True)
class Reading(Generic[X]):
    """A way to read what is given: what was wrong, what to do, what turns it into what was meant; None if it cannot."""

    words: str
    remedy: str
    meant: Callable[[X], X | None]


@dataclass(frozen=True, eq=False)
class Try:
    """A reading of poses of one robot or all (None), in one recording (its number) or all (None), and rows so read."""

    robot: int | None
    reading: Reading[Pose]
    recording: int | None
    parts: tuple[Stretch, ...]


def _scaled(meant: str, read: str, factor: float) -> Reading[Pose]:
    much = f"{factor:.5g} times too small" if factor > 1 else f"{1 / factor:.5g} times too large"
    words = f"positions are {much}, as when {meant} are read as {read}"
    remedy = 'Set the unit ("m" or "mm") that its "position" has, or convert the numbers to one.'
    return Reading(words, remedy, lambda poses: Pose(poses.rotation, factor * poses.position))


def _turned(right: Callable[[Array], Array | None]) -> Callable[[Pose], Pose | None]:
    def meant(poses: Pose) -> Pose | None:
        turned = right(poses.rotation.matrix)
        return None if turned is None else Pose(Rotation.nearest(turned), poses.position)

    return meant


METRES: Mapping[str, float] = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "inches": INCH}
SCALES = tuple(_scaled(a, b, METRES[a] / METRES[b]) for a in METRES for b in METRES if a != b)
# Lengths that all robots tell in another unit fit one another as well as before, and so do poses that all tell the
# other way round, whose homes then pass for grasps; rotations alone do not.
TURNS = tuple(
    Reading(m.words, m.remedy or (SWAP if m.code == "quaternion-order" else TRANSPOSE), _turned(m.right))
    for m in MISREAD
)
INVERTED = Reading(
    "poses are those of its home in its grasp, not of its grasp in its home",
    "Write the inverse of each pose.",
    Pose.inverse,
)
READINGS = (*SCALES, INVERTED, *TURNS)


def require_well_read(log: TeamLog) -> None:
    """Raise BadValue where poses that do not fit do so once one robot's, or all, are read in another way.

    Clocks are taken as they are, but for those far off: how fast a grasp turns is the same in all these readings. Who
    pushes with next to nothing may hold nothing.
    """
    names, reference = log.names, log.names.index(log.reference)
    try:
        parts = stretches(far_lags(log).corrected(log), {})
    except BadValue:
        return
    held = zip(parts, idle(parts, IDLE), strict=True)
    parts = tuple(replace(part, seen=part.seen & ~rows).thinned(ROWS) for part, rows in held)
    # A fit may end beside the optimum: then its start is the better of the two.
    given = min((judged(parts, reference, exact) for exact in (True, False)), key=lambda one: one.cost)
    # Misread rotations show where the payload turns.
    turns = bool(_extents(TeamMotion.of(parts))[:, 0].max() > STILL)
    readings = READINGS if turns else SCALES
    suspects = _suspects(parts, reference, given)
    for tried in (
        _everywhere(parts, suspects, readings),
        _everywhere(parts, [None], TURNS if turns else ()),
        _in_one(parts, suspects, readings, reference, given),
    ):
        best = _best(tuple(tried), reference, given)
        if best:
            raise BadValue(_words(best, names, [part.name for part in parts], given))


def _best(tried: Sequence[Try], reference: int, given: Judged) -> list[tuple[Try, Judged]]:
    """Return the readings that make poses fit, best first: several where one is as good as another."""
    first = [judged(one.parts, reference, False) for one in tried]
    order = sorted(range(len(tried)), key=lambda k: first[k].cost)[:MOST]
    bar = min((j.cost for j in first), default=0.0) + np.log(NEAR)
    near = [tried[k] for k in order if first[k].cost < bar and first[k].beats(given, BETTER)]
    fitted = [(one, judged(one.parts, reference, True)) for one in near]
    able = [(one, j) for one, j in fitted if j.worst < FITS and j.beats(given, CLOSES)]
    able.sort(key=lambda pair: pair[1].cost)
    return [pair for pair in able if pair[1].cost < able[0][1].cost + np.log(AS_GOOD)]


def _suspects(parts: tuple[Stretch, ...], reference: int, given: Judged) -> list[int]:
    """Return the robots that may be misread: those without whom the others' poses fit better, or not at all."""
    count = parts[0].seen.shape[1]
    if count < MANY:
        return list(range(count))
    # The first of the others is the reference where that is left out.
    references = [0 if i == reference else reference - (i < reference) for i in range(count)]
    without = [judged(_left_out(parts, i), references[i], False) for i in range(count)]
    return [i for i, w in enumerate(without) if not w.fits or w.beats(given, BETTER)]


def _left_out(parts: tuple[Stretch, ...], robot: int) -> tuple[Stretch, ...]:
    """Return the recordings with the poses of the other robots only."""
    others = np.delete(np.arange(parts[0].seen.shape[1]), robot)
    return tuple(replace(part, poses=part.poses[:, others], seen=part.seen[:, others]) for part in parts)


def _everywhere(
    parts: tuple[Stretch, ...], whose: Sequence[int | None], readings: Sequence[Reading[Pose]]
) -> Iterator[Try]:
    """Yield readings in all recordings, of one robot or, for None, of all at once."""
    for robot in whose:
        robots = range(parts[0].seen.shape[1]) if robot is None else [robot]
        for reading in readings:
            read: tuple[Stretch | None, ...] = parts
            for i in robots:
                read = tuple(None if part is None else _read(part, i, reading) for part in read)
            made = tuple(part for part in read if part is not None)
            if len(made) == len(parts):
                yield Try(robot, reading, None, made)


def _in_one(
    parts: tuple[Stretch, ...], robots: Sequence[int], readings: Sequence[Reading[Pose]], reference: int, given: Judged
) -> Iterator[Try]:
    """Yield readings of one robot in one recording, where poses fit better without them, or not at all."""
    for k, part in enumerate(parts if len(parts) > 1 else ()):
        for i in (robot for robot in robots if part.seen[:, robot].any()):
            seen = part.seen.copy()
            seen[:, i] = False
            without = judged((*parts[:k], replace(part, seen=seen), *parts[k + 1 :]), reference, False)
            if without.fits and not without.beats(given, BETTER):
                continue
            for reading in readings:
                made = _read(part, i, reading)
                if made is not None:
                    yield Try(i, reading, k, (*parts[:k], made, *parts[k + 1 :]))


def _read(part: Stretch, i: int, reading: Reading[Pose]) -> Stretch | None:
    """Return the recording with one robot's poses read in another way."""
    seen = part.seen[:, i]
    if not seen.any():
        return part
    meant = reading.meant(part.poses[seen, i])
    if meant is None:
        return None
    turns, places = part.poses.rotation.matrix.copy(), part.poses.position.copy()
    turns[seen, i], places[seen, i] = meant.rotation.matrix, meant.position
    return replace(part, poses=Pose.trusted(Rotation.trusted(turns), places))


@dataclass(frozen=True, eq=False)
class Judged:
    """Noise (N, 2) [rad, m] of poses, and which share of what each robot turns and moves it is; all if nothing fits."""

    noise: Array
    share: Array
    fits: bool

    @property
    def cost(self) -> float:
        """Logarithm of the shares (rms)."""
        return float(np.log((self.share**2).mean()) / 2)

    @property
    def worst(self) -> float:
        """The largest share."""
        return float(self.share.max())

    def beats(self, given: Judged, factor: float) -> bool:
        """Whether shares are smaller by a factor: all of them (rms), or the largest, as others are noisy either way."""
        return self.cost < given.cost - np.log(factor) or self.worst < given.worst / factor


def judged(parts: tuple[Stretch, ...], reference: int, exact: bool) -> Judged:
    """Return the noise of a rough fit, or only of where it would start."""
    data = TeamMotion.of(parts)
    size, guess = _extents(data), np.full((data.count, 2), GUESS)
    try:
        # What fails to start is not told by name.
        start = first_team(data, reference, ("",) * data.count)
        if exact:
            noise = fit_poses(data, start, reference, close=ROUGHLY).noise
        else:
            noise = Rows.settled(data, start, guess).noise(guess)
    except FAILURES:
        noise = np.full_like(size, np.nan)
    fits = bool(np.isfinite(noise).all())
    return Judged(noise if fits else size, noise / size if fits else np.ones_like(size), fits)


def _extents(data: TeamMotion) -> Array:
    """Return how much each robot turns and moves (N, 2) [rad, m], as read."""
    out = np.empty((data.count, 2))
    for i in range(data.count):
        path = data.poses[data.valid[:, i], i]
        out[i] = extent(path) if len(path.position) else 0.0
    return np.maximum(out, [STILL, 1e-12])


def _words(best: list[tuple[Try, Judged]], names: tuple[str, ...], recordings: Sequence[str], given: Judged) -> str:
    """Return what is wrong, or may be, and what to do."""
    said = []
    for one, _ in best:
        where = "" if one.recording is None else f" in '{recordings[one.recording]}'"
        whose = "all robots" if one.robot is None else f"'{names[one.robot]}'"
        said.append(f"those of {whose} are misread{where} ({one.reading.words})")
    remedies = dict.fromkeys(
        one.reading.remedy.replace(" its ", " their ") if one.robot is None else one.reading.remedy for one, _ in best
    )
    return (
        f"the robots' poses do not fit one payload, and do so if {' or if '.join(said)}: what they say of it then "
        f"differs by {in_words(best[0][1].noise)}, as given by {in_words(given.noise)}. {' '.join(remedies)}"
    )


def require_own_files(log: TeamLog) -> None:
    """Raise BadValue where exchanging two robots in one recording makes poses fit that do not fit as they are.

    Clocks are taken as they are: what a fit makes of them where files are exchanged is nothing to go by.
    """
    names, reference = log.names, log.names.index(log.reference)
    parts = stretches(log, {})
    few = tuple(part.thinned(EXCHANGED_ROWS) for part in parts)
    as_given, tried = judged(few, reference, True), _exchanges(few)
    if not as_given.fits or len(tried) > EXCHANGES:
        return
    best, noise = None, as_given.noise
    for number, pair in tried:
        found = judged((*few[:number], _exchanged(few[number], *pair), *few[number + 1 :]), reference, True)
        if found.fits and found.noise.prod() < noise.prod():
            best, noise = (number, pair), found.noise
    if best is None or float(np.log(as_given.noise / noise).mean()) < np.log(EXCHANGE_CLOSES):
        return
    number, (i, j) = best
    where = quoted((part.name for part in (parts if len(parts) == 2 else parts[number : number + 1])), " or ")
    raise BadValue(
        f"the files of '{names[i]}' and '{names[j]}' look exchanged in {where}: with each in the other's place, "
        f"what robots say of their poses differs by {in_words(noise)}, as given by {in_words(as_given.noise)}. "
        'Exchange their "path" there.'
    )


def _exchanges(parts: Sequence[Stretch]) -> list[tuple[int, tuple[int, int]]]:
    """Return recordings and pairs of robots to try; of two recordings, either one is as good."""
    numbers = range(len(parts)) if len(parts) > 2 else range(len(parts) - 1)
    return [
        (number, (i, j))
        for number in numbers
        for i, j in combinations(range(parts[0].seen.shape[1]), 2)
        if parts[number].seen[:, i].any() or parts[number].seen[:, j].any()
    ]


def _exchanged(part: Stretch, i: int, j: int) -> Stretch:
    order = np.arange(part.seen.shape[1])
    order[[i, j]] = j, i
    return replace(
        part, poses=Pose(part.poses.rotation[:, order], part.poses.position[:, order]), seen=part.seen[:, order]
    )
