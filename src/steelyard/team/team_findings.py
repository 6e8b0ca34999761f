"""What the joint answer must say beside its numbers: directions not shown, clocks, bad robots, gains, open inertia."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding, with_bar
from steelyard.spatial import unit_vectors
from steelyard.team.estimate import GraspEstimate, TeamEstimate
from steelyard.team.poses.measured import in_words

# A clock is called late from so much [s] and so many standard deviations.
LATE_S, LATE_STD = 1e-3, 3.0
# More than this is told in seconds.
LONG_S = 10.0
# A robot's poses are bad from so many times the noise of the middle one of the team.
BAD = 20.0
# A gain error is worth a word from this share.
GAIN = 3e-3
# And only where so little of the evidence is left for gains without error: a chance draw is no sign of one.
GAINLESS = 0.1
# What force sensors are good to.
USUAL_GAIN = 0.01
# A direction is called by an axis where it is within this cosine of it.
ALONG = 0.9
# Forces that stand still in the room are worth a word from this size [N].
ROOM_FORCE = 0.03
# From this share of the weight on it is more than the error of a sensor.
PULLS = 0.01
# Steps [standard deviations] that a fit may leave untaken without a word.
UNSETTLED = 0.1
AXES = ("x", "y", "z")


def lost_directions(
    grasps: Mapping[str, GraspEstimate], down: Array | None, apart: Array | None = None
) -> Iterator[Finding]:
    """Yield grasp-direction-lost for every grasp and direction in words.

    down  (3,) gravity in R, where known     apart  (2,) as of `MotionFit`
    """
    for name, grasp in grasps.items():
        if not len(grasp.lost):
            continue
        words = [_in_words(direction, down, name) for direction in _sparse(grasp.lost)]
        turned = np.linalg.matrix_rank(grasp.lost[:, :3], tol=1e-2)
        kinds = len(words)
        if apart is not None:
            yield Finding(
                "grasp-direction-lost",
                f"{_listed(words)}: robots disagree by {in_words(apart[None])}, which hides how the payload "
                "turned. Loud encoders do that, and so does a base that moves or drifts though it is said to stand.",
                'Where a base moves, say base = "moving" and log its twists; else measure better or turn farther.',
            )
            continue
        if turned == 0 and kinds == 1:
            why = "all rotation so far was about one axis. Tilt the payload about another axis"
        elif turned == 0:
            why = "the payload has not turned. Turn it about two axes"
        else:
            why = "the payload has turned about one fixed axis or not at all. Turn it about two axes and move it about"
        yield Finding.of("grasp-direction-lost", f"{_listed(words)}: {why}.")


def _sparse(lost: Array) -> Array:
    """Return a basis of the lost space with pure positions first, then what turns."""
    turning = lost[:, :3]
    u, s, _ = np.linalg.svd(turning)
    rank = int((s > 1e-2).sum())
    mixed = u.T @ lost
    mixed[rank:, :3] = 0.0
    rows = unit_vectors(mixed)
    return np.asarray(np.concatenate([rows[rank:], rows[:rank]]))


def _in_words(direction: Array, down: Array | None, name: str) -> str:
    """Return what a lost direction (6,) is: a place along an axis, or a turn about one."""
    turn, place = direction[:3], direction[3:]
    turning = float(np.linalg.norm(turn)) > 0.1
    axis = turn if turning else place
    axis = axis / max(float(np.linalg.norm(axis)), 1e-300)
    if down is not None and abs(float(axis @ down)) > ALONG * float(np.linalg.norm(down)):
        return (
            f"turn of grasp '{name}' about the vertical" if turning else f"height of grasp '{name}' along the vertical"
        )
    biggest = int(np.argmax(np.abs(axis)))
    if abs(axis[biggest]) > ALONG:
        where = f"{AXES[biggest]} of the reference grasp"
    else:
        where = f"({axis[0]:.2f}, {axis[1]:.2f}, {axis[2]:.2f}) of the reference grasp"
    return f"turn of grasp '{name}' about {where}" if turning else f"position of grasp '{name}' along {where}"


def _listed(words: Sequence[str]) -> str:
    unique = list(dict.fromkeys(words))
    text = unique[0] if len(unique) == 1 else f"{', '.join(unique[:-1])} and {unique[-1]}"
    return text[0].upper() + text[1:]


def late_clocks(late: Mapping[str, float], std: Mapping[str, float]) -> Iterator[Finding]:
    """Yield clock-offset for every robot whose stamps are late or early beyond doubt."""
    for name, seconds in late.items():
        doubt = std.get(name, 0.0)
        if abs(seconds) > max(LATE_S, LATE_STD * doubt):
            way = "late" if seconds > 0 else "early"
            unit, scale = ("s", 1.0) if abs(seconds) > LONG_S else ("ms", 1e3)
            text = f"The stamps of '{name}' are {with_bar(scale * abs(seconds), scale * doubt)} {unit} {way}"
            yield Finding.of("clock-offset", f"{text} against the reference; they were put right.")


def bad_robots(names: Sequence[str], noise: Array) -> Iterator[Finding]:
    """Yield robot-excluded for robots whose poses or twists (noise (N, 2)) disagree far more than the others'."""
    if len(names) < 3:
        return
    share = (noise / np.median(noise, axis=0)).max(1)
    for name, times in zip(names, share, strict=True):
        if times > BAD:
            yield Finding.of(
                "robot-excluded",
                f"What '{name}' says of its motion disagrees with the others {times:.0f} times more than theirs do; "
                "it counts for next to nothing.",
            )


def gains(gain: float, gainless: float) -> Iterator[Finding]:
    """Yield common-gain-unseen where the recordings speak against gains without error (`gainless`, their share)."""
    if gain > GAIN and gainless < GAINLESS:
        yield Finding.of(
            "common-gain-unseen",
            f"Force gains err by about {100 * gain:.1f} % from axis to axis; an error that all robots share would look "
            "like mass, and the error bars do not hold it.",
        )


def open_parameters(identified: Mask, rank: int, count: int = 10) -> Iterator[Finding]:
    """Yield inertia-not-identified where some of the inertia is left open; `count` parameters are asked for."""
    if not identified[4:].all():
        asked = "ten" if count == 10 else f"{count}"
        told = f"fix {rank} of the {asked} parameters" if rank < count else f"show the {asked} parameters, but not well"
        yield Finding.of(
            "inertia-not-identified",
            f"The rows {told}; the inertia is not given{_weighed(identified)}. Turn the payload about all three axes, "
            "faster and slower.",
        )


def _weighed(identified: Mask) -> str:
    """Return what is said of mass and centre of mass where they are open, too."""
    if not identified[0]:
        return ", and neither mass nor centre of mass is known: do not use them"
    if not identified[1:4].all():
        open_axes = [axis for axis, known in zip(AXES, identified[1:4], strict=True) if not known]
        return f", and the centre of mass is not known along {_listed(open_axes).lower()}"
    return ""


def unseen_gains(team: TeamEstimate, share: float) -> tuple[str, ...]:
    """Return a note where gains of 1 % on every axis, which no motion tells, would move the mass beyond its bar.

    share  of the mass per gain error, as from `weight_by_gains`
    """
    moved = USUAL_GAIN * share * float(team.mass)
    if not team.identified[0] or moved < 2 * float(team.std[0]):
        return ()
    return (
        f"error bars hold no gain error that lasts: 1 % on every force axis would move the mass by {moved:.2g} kg, "
        "and the centre of mass with it.",
    )


def pulled_in_room(size: float, weight: float) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
    """Return cable-force, or a note where it is little, for forces of `size` [N] that stand still in the room.

    weight  of the payload [N]
    """
    if size < ROOM_FORCE:
        return (), ()
    what = f"Forces of about {size:.1g} N stand still in the axes of the robots' homes: they look like weight"
    if size < PULLS * weight:
        return (), (f"{what}, as errors of a Delta's springs do. They are fitted, and bars allow for them.",)
    why = "as where a cable pulls, or a controller takes away what it believes its arm bears"
    return (Finding.of("cable-force", f"{what}, {why}. They were fitted and taken out, and bars allow for them."),), ()


def uncalibrated(recurring: Array | None) -> tuple[str, ...]:
    """Return notes on what bars of grasps hold of the arms' calibration, by how much errors come back with the pose.

    recurring  (2,) rms [rad, m]; None where none show
    """
    constant = "No error bar holds a constant error of a robot's tool frame: its grasp is off by as much."
    if recurring is None:
        return (constant,)
    turn, place = np.degrees(recurring[0]), 1e3 * recurring[1]
    text = (
        f"Poses err by {turn:.2g} degrees and {place:.2g} mm in ways that come back with the pose: bars allow for it."
    )
    return text, constant


def unsettled(left: float) -> tuple[str, ...]:
    """Return a note where the fit of grasps ended while its steps were still long [standard deviations]."""
    if left <= UNSETTLED:
        return ()
    return (f"The fit of the grasps ended before it settled: its last step was {left:.2g} standard deviations long.",)
