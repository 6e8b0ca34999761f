"""Readings: the log as given beside the ways in which rotation, gravity or axes of the wrench are commonly misread.

A rival is claimed only where it

* leaves less than a quarter of the force variance that the log as given leaves, and no more of the torque's;
* explains at least half of the force variance, by a mass of the right sign beyond five jackknife standard deviations;
* leaves less than half of what a freely tilted gravity would leave.

Forces in the axes of W point down however the rotations are read, so that beside them torques decide: a rival way to
read the rotations leaves a tenth of the torque variance, and half of what any other, or other axes, would leave. Of a
load that stands upright, torques in S beside forces in W look like rotations that are turned round.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, frozen
from steelyard.findings import Finding
from steelyard.logs.misread import INVERTED, MISREAD, TURNED_ROUND, Misread
from steelyard.logs.recording import Recording
from steelyard.sanity.readings.glance import Glance, glance, in_axes
from steelyard.sanity.readings.orders import order_of_forces
from steelyard.sanity.readings.static_fit import StaticFit, better_fit, varies
from steelyard.sanity.readings.tilt import GlanceTilt, tilt_at_a_glance, turn_at_a_glance
from steelyard.sanity.words import unexplained

# A rival leaves less than this share of the force variance that the log as given leaves.
MUCH_BETTER = 0.25
# A reading that leaves less than the first share of the force variance has rotation and gravity right but for a tilt;
# one that leaves less than the second has the tilt right, too: two degrees leave more.
GOOD, LEVEL = 0.03, 2e-4
# By torques alone a rival leaves less than the first share of what is left as given, and less than the second of what
# any other leaves, torques in other axes too.
BY_TORQUE, BESIDE = 0.1, 0.5
# Constant forces seem to turn with the sensor where a bias lies along gravity; torques then do not.
TORQUES_TOO = 0.3
# Beyond this no base is crooked [rad].
STEEP = np.radians(60.0)
# A way to misread rotations, the recording with that undone, and what is seen of it.
Meant = tuple[Misread, Recording, Glance]


@dataclass(frozen=True, eq=False)
class Reading:
    """One way to read the recording: words for what would be wrong, gravity, rotations, its fit, how they were misread.

    `misread` is None where the rotations are as given; `view` is what is seen where the wrench is in other axes;
    `by_torque` says that torques alone tell it from the reading as given.
    """

    words: str
    gravity: Array
    rotation: Array | None
    fit: StaticFit
    misread: Misread | None = None
    view: Glance | None = None
    by_torque: bool = False

    @property
    def left(self) -> float:
        """Share of the variance that is left unexplained of the part of the wrench that tells."""
        return self.fit.torque_share if self.by_torque else self.fit.force_share


def reading_of(
    view: Glance, words: str, gravity: Array, rotation: Array | None, misread: Misread | None = None
) -> Reading:
    """Return a reading with its better fit.

    gravity, rotation  (3,) [m/s^2] in W, and S to W (N, 3, 3), as the reading has them
    """
    return Reading(words, gravity, rotation, better_fit(view, gravity, rotation), misread)


def best_rival(recording: Recording, view: Glance, given: Reading) -> Reading | None:
    """Return the rival that beats the reading as given, if there is one."""
    if view.rotation is None:
        return None
    return _best_by_force(recording, view, given) or _best_by_torque(recording, view, given)


def _best_by_force(recording: Recording, view: Glance, given: Reading) -> Reading | None:
    """Return the rival whose forces turn with gravity as those of the reading as given do not."""
    if given.fit.force_share < GOOD:
        return None
    free = tilt_at_a_glance(view, given.gravity, view.rotation, given.fit.mass)
    bar = MUCH_BETTER * given.fit.force_share

    def able(rivals: Iterable[Reading], bar: float) -> list[Reading]:
        return [
            r
            for r in rivals
            if r.fit.force_share < min(bar, 0.5)
            and r.fit.torque_share < 1.2 * given.fit.torque_share + 1e-3
            and r.fit.sign != 0
            and varies(view, r.gravity, r.rotation)
            and _beats_tilt(r, free)
            and (r.view is None or r.fit.torque_share < TORQUES_TOO)
        ]

    meant = tuple(_meant(recording, view))
    one = able((*_rivals(meant, view, given.gravity), *_in_other_axes(recording, view, given)), bar)
    # Of two mistakes each must leave much less than the other alone does.
    both = () if one else able(_misread_in_other_axes(meant, given.gravity), MUCH_BETTER * bar)
    best = min(one or both, key=_unlikely, default=None)
    lost = best is None or outdone(best, view, given.gravity) or _reordered(recording, view, given, best)
    return None if lost else best


def _reordered(recording: Recording, view: Glance, given: Reading, best: Reading) -> bool:
    """Tell whether force columns in another order explain much more than the best rival does."""
    order = order_of_forces(recording, view, given.gravity, given.rotation)
    return order is not None and order.left < MUCH_BETTER * best.fit.force_share


def _unlikely(reading: Reading) -> tuple[float, float]:
    """Return what a reading costs, and what it leaves where two cost the same.

    One mistake is likelier than two: one that also needs the wrench flipped must be much better than others.
    """
    flipped = 0.0 if reading.fit.sign > 0 else -2 * np.log(MUCH_BETTER)
    return reading.fit.cost + flipped, reading.fit.force_share + reading.fit.torque_share


def _best_by_torque(recording: Recording, view: Glance, given: Reading) -> Reading | None:
    """Return the rotations with which torques in W belong to forces in W, which as given they do not."""
    if any(view.dead) or given.fit.torque_share < GOOD:
        return None
    rivals = sorted(misread_rotations(recording, view, given), key=lambda r: r.left)
    if not rivals or rivals[0].left > BY_TORQUE * given.fit.torque_share:
        return None
    in_sensor = reading_of(replace(view, world=frozenset({"force"})), "", given.gravity, view.rotation)
    # Where rotations are turned round, positions may be, too: in slow motion either fits, and hardly matters.
    turned = [r for r in rivals if r.misread in (TURNED_ROUND, INVERTED)]
    alike = turned if rivals[0] in turned else rivals[:1]
    others = (in_sensor.fit.torque_share, *(r.left for r in rivals if r not in alike))
    return min(alike, key=lambda r: r.fit.cost) if rivals[0].left < BESIDE * min(others) else None


def misread_rotations(recording: Recording, view: Glance, given: Reading) -> Iterator[Reading]:
    """Yield the other ways to read rotations that explain forces in W as well, with torques in W, too; else none."""
    if view.world != {"torque", "force"}:
        return
    for rival in _rivals(_meant(recording, view), view, given.gravity):
        as_well = rival.fit.force_share < 1.2 * given.fit.force_share + 1e-3 and rival.fit.sign == given.fit.sign
        if rival.misread is not None and as_well:
            yield replace(rival, by_torque=True)


def _rivals(others: Iterable[Meant], view: Glance, gravity: Array) -> Iterator[Reading]:
    """Yield the ways in which rotation (`others`) or gravity are commonly misread."""
    R = view.rotation
    if R is None:
        return
    for misread, _, meant in others:
        yield reading_of(meant if misread.whole else view, misread.words, gravity, meant.rotation, misread)
    size = float(np.linalg.norm(gravity))
    for axis in range(3):
        if abs(gravity[axis]) < 0.8 * size:
            for sign in (-1, 1):
                words = f"gravity points along {'+' if sign > 0 else '-'}{'xyz'[axis]} of W"
                yield reading_of(view, words, sign * size * np.eye(3)[axis], R)


def _in_other_axes(recording: Recording, view: Glance, given: Reading) -> Iterator[Reading]:
    """Yield the reading of the wrench in W where it was said to be in S, and in S where it was said to be in W.

    Torques go with the forces, unless they belong to them much better in the others' axes.
    """
    if any(recording.dead) or given.rotation is None:
        return
    both = frozenset(() if "force" in view.world else ("torque", "force"))
    views = {world: glance(in_axes(recording, world), view) for world in (both, both ^ {"torque"})}
    found = [
        replace(reading_of(other, _axes_in_words(world), given.gravity, given.rotation), view=other)
        for world, other in views.items()
        if other is not None
    ]
    yield from found[:1]
    alone = next((r for r in found[1:] if r.fit.torque_share < BESIDE * found[0].fit.torque_share), None)
    if alone is not None and (whole := views[both]) is not None:
        # Rotations that are misread may do so better still, with the torques in the axes of the forces.
        misread = _best_by_torque(in_axes(recording, both), whole, found[0])
        yield from () if misread is not None else (alone,)


def _misread_in_other_axes(others: Iterable[Meant], gravity: Array) -> Iterator[Reading]:
    """Yield the wrench in other axes beside rotations that are misread, too: neither alone explains such a log."""
    for misread, put, meant in others:
        for rival in _in_other_axes(put, meant, reading_of(meant, "", gravity, meant.rotation)):
            yield replace(rival, words=f"{rival.words}, and {misread.words}", misread=misread)


def _meant(recording: Recording, view: Glance) -> Iterator[Meant]:
    """Yield the ways to misread rotations, and the recording and what is seen of it with each undone.

    Rotations are put right row by row before they are averaged: misread ones may leap.
    """
    for misread in (*MISREAD, INVERTED):
        put = _put_right(recording, misread)
        meant = None if put is None else glance(put, view)
        if put is not None and meant is not None and meant.rotation is not None:
            yield misread, put, meant


def _axes_in_words(world: frozenset[str]) -> str:
    if len(world) == 1:
        (turned,) = world
        return f"the {turned}s are in the axes of W (the base), the {'torque' if turned == 'force' else 'force'}s in S"
    return f"the wrench is in the axes of {'W (the base), not of S' if world else 'S, not of W (the base)'}"


def outdone(reading: Reading, view: Glance, gravity: Array) -> bool:
    """Tell whether a turned sensor explains much more than the reading does, even with gravity tilted.

    In turns about one axis a turn of S is a tilt and a change of sign, too; then the reading holds.
    """
    free = tilt_at_a_glance(reading.view or view, reading.gravity, reading.rotation, reading.fit.mass)
    left = min(reading.fit.force_share, 1.0 if free is None or free.angle > STEEP else free.force_share)
    turned = turn_at_a_glance(view, gravity, 1) if left > LEVEL else None
    return turned is not None and turned.force_share < MUCH_BETTER * left


def sign_of(view: Glance, reading: Reading) -> int:
    """Return the sign of the mass, 0 where it is not sure or a turn of S explains a negative one much better."""
    return 0 if reading.fit.sign < 0 and outdone(reading, view, reading.gravity) else reading.fit.sign


def _beats_tilt(rival: Reading, free: GlanceTilt | None) -> bool:
    """Tell whether a freely tilted gravity explains no more (an axis: much more) than the rival does."""
    if free is None:
        return True
    if rival.misread is not None or rival.view is not None:
        return rival.fit.force_share < 0.5 * free.force_share
    return rival.fit.force_share < 2 * free.force_share + 1e-3


def rival_findings(best: Reading, given: Reading) -> tuple[Finding, ...]:
    """Return what is said of the rival that is taken instead of the reading as given."""
    part, instead = ("torque", given.fit.torque_share) if best.by_torque else ("force", given.fit.force_share)
    message = (
        f"{best.words[0].upper()}{best.words[1:]}; so read, "
        f"{unexplained(best.left, instead, f'the {part}')}. The answer assumes this."
    )
    if best.view is None:
        return (Finding.of("gravity-frame", message) if best.misread is None else best.misread.finding(message),)
    axes = [f'frame = "{"W" if part in best.view.world else "S"}" in its {part}' for part in ("force", "torque")]
    remedy = f"Set {' and '.join(axes)} in the description of this stream."
    misread = best.misread
    beside = () if misread is None else (misread.finding(f"Beside the axes of the wrench, {misread.words}."),)
    return (Finding("gravity-frame", message, remedy), *beside)


def as_read(recording: Recording, best: Reading) -> Recording:
    """Return the recording with its rotations, gravity and axes of the wrench as the reading has them."""
    if best.view is None and best.misread is None:
        return replace(recording, gravity=best.gravity)
    put = recording if best.misread is None else _put_right(recording, best.misread) or recording
    return put if best.view is None else in_axes(put, best.view.world)


def _put_right(recording: Recording, misread: Misread) -> Recording | None:
    """Return the recording with the mistake undone in all rotations, of whole poses; None where it cannot be in any."""
    streams, able = [], False
    for stream in recording.streams:
        read, place = stream.channels.get("rotation"), stream.channels.get("position")
        if read is not None and (meant := misread.right(read)) is not None and not (misread.whole and place is None):
            put = {"rotation": meant}
            if misread.whole and place is not None:
                put["position"] = frozen(-np.einsum("nij,nj->ni", meant, place))
            stream, able = stream.with_channels(**put), True
        streams.append(stream)
    return replace(recording, streams=tuple(streams)) if able else None
