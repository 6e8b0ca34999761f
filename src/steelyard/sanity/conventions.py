"""Conventions: sign and axes of the wrench, sense of the rotation, order of quaternions, gravity, unit of torque.

The log as given is fitted beside the log under each rival convention (see `glance`). A rival is claimed only where it

* leaves less than a quarter of the force variance that the log as given leaves, and no more of the torque's;
* explains at least half of the force variance, by a mass of the right sign beyond five jackknife standard deviations;
* leaves less than half of what a freely tilted gravity would leave.

Then it is no matter of noise, and the recording is returned as the rival reads it. All forces and torques scaled
alike (lbf for N) fit as well as before, and so do the sign of the wrench and of gravity on a log at rest: no fit can
tell them apart, and the messages say so.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import REMEDIES, Finding, percent
from steelyard.logs.misread import MISREAD, Misread
from steelyard.logs.recording import Recording
from steelyard.sanity.axis_words import direction_words
from steelyard.sanity.blind_tilt import blind_tilt
from steelyard.sanity.both_masses import both_masses, examine_both_masses
from steelyard.sanity.glance import Glance, glance, in_other_axes
from steelyard.sanity.mirrored import Mirror, mirrored
from steelyard.sanity.mounts import mount_of, mount_remedy, vector
from steelyard.sanity.static_fit import StaticFit, fit
from steelyard.sanity.swapped import examine_swapped
from steelyard.sanity.tilt import GlanceTilt, Turn, blind_axis, tilt_of, turned_sensor
from steelyard.sanity.torques import examine_torques
from steelyard.sanity.units import scaled
from steelyard.sanity.weightless import require_weight

# A rival leaves less than this share of the force variance that the log as given leaves.
MUCH_BETTER = 0.25
# A reading that leaves less than the first share of the force variance has rotation and gravity right but for a tilt;
# one that leaves less than the second has the tilt right, too: two degrees leave more.
GOOD, LEVEL = 0.03, 2e-4
# Constant forces seem to turn with the sensor where a bias lies along gravity; torques then do not.
TORQUES_TOO = 0.3
# With fewer poses or stretches than this, a direction of gravity fits by chance.
FEWEST_BLOCKS = 6
# No hand holds a mass this far from its sensor [m].
FURTHEST_ARM = 2.0
# Gravity found this far off is corrected at once; beyond STEEP no base is that crooked [rad].
CERTAIN_TILT, STEEP = np.radians(2.0), np.radians(60.0)
# A sensor mounted this much askew is worth a word [rad].
SENSOR_TURN = np.radians(10.0)


@dataclass(frozen=True, eq=False)
class Reading:
    """One way to read the recording: words for what would be wrong, gravity, rotations, its fit, how they were misread.

    `misread` is None where the rotations are as given; `view` is what is seen where the wrench is in other axes.
    """

    words: str
    gravity: Array
    rotation: Array | None
    fit: StaticFit
    misread: Misread | None = None
    view: Glance | None = None


def examine_conventions(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording in the conventions that explain it, and a finding for each that was not as said.

    Raises CannotAnswer where the force shows no weight in any.
    """
    view = glance(recording)
    if view is None:
        return recording, ()
    recording, view, swapped = examine_swapped(recording, view)
    found = list(swapped)
    reading = _reading(view, "", recording.gravity, view.rotation)
    best = _best_rival(recording, view, reading)
    if best is not None:
        found.append(_rival_finding(best, reading))
        recording, reading, view = _as_read(recording, best), best, best.view or view
    found.extend(masses := examine_both_masses(view, recording.gravity, reading.rotation))
    # What a controller leaves of a weight may have either sign.
    left_over = any(finding.code == "weight-compensated" for finding in masses)
    flipped, findings = (recording, ()) if left_over else _signs(recording, view, reading)
    if findings:
        reading = _reading(view, "", flipped.gravity, reading.rotation)
    recording = flipped
    found.extend(findings)
    if not found:
        recording, findings = examine_torques(recording, view, recording.gravity, reading.rotation)
    if found or not findings:
        recording, findings = _lengths(recording, reading.fit)
    found.extend(findings)
    if best is None and reading.rotation is not None:
        recording, findings = _level(recording, view, reading)
        found.extend(findings)
        blind = None if findings else blind_axis(view, reading.rotation)
        if blind is not None and not found:
            found.extend(blind_tilt(view, recording.gravity, blind))
    if not found:
        require_weight(view, recording.gravity, reading.rotation, reading.fit)
    return recording, tuple(found)


def _reading(
    view: Glance, words: str, gravity: Array, rotation: Array | None, misread: Misread | None = None
) -> Reading:
    """Return a reading with the better of two fits: with the measured acceleration and without."""
    found = fit(view.seen(gravity, rotation), view.block)
    if view.acceleration is not None:
        still = fit(replace(view, acceleration=None).seen(gravity, rotation), view.block)
        found = min(found, still, key=lambda f: f.force_share)
    return Reading(words, gravity, rotation, found, misread)


def _rivals(view: Glance, gravity: Array) -> Iterator[Reading]:
    """Yield the ways in which rotation or gravity are commonly misread."""
    R = view.rotation
    if R is None:
        return
    for misread in MISREAD:
        meant = misread.right(R)
        if meant is not None:
            yield _reading(view, misread.words, gravity, meant, misread)
    size = float(np.linalg.norm(gravity))
    for axis in range(3):
        if abs(gravity[axis]) < 0.8 * size:
            for sign in (-1, 1):
                words = f"gravity points along {'+' if sign > 0 else '-'}{'xyz'[axis]} of W"
                yield _reading(view, words, sign * size * np.eye(3)[axis], R)


def _in_other_axes(recording: Recording, given: Reading) -> Iterator[Reading]:
    """Yield the reading of the wrench in W where it was said to be in S, and in S where it was said to be in W."""
    view = None if any(recording.dead) else glance(in_other_axes(recording))
    if view is not None and given.rotation is not None:
        words = f"the wrench is in the axes of {'W (the base), not of S' if view.world else 'S, not of W (the base)'}"
        yield replace(_reading(view, words, given.gravity, given.rotation), view=view)


def _best_rival(recording: Recording, view: Glance, given: Reading) -> Reading | None:
    """Return the rival that beats the reading as given, if there is one."""
    if view.rotation is None or given.fit.force_share < GOOD:
        return None
    free = tilt_of(view, given.gravity, view.rotation, given.fit.mass)
    bar = MUCH_BETTER * given.fit.force_share
    able = [
        r
        for r in (*_rivals(view, given.gravity), *_in_other_axes(recording, given))
        if r.fit.force_share < min(bar, 0.5)
        and r.fit.torque_share < 1.2 * given.fit.torque_share + 1e-3
        and r.fit.sign != 0
        and _varies(view, r)
        and _beats_tilt(r, free)
        and (r.view is None or r.fit.torque_share < TORQUES_TOO)
    ]
    # One mistake is likelier than two: a rival that also needs the wrench flipped must be much better than others.
    best = min(able, key=lambda r: r.fit.cost + (0.0 if r.fit.sign > 0 else -2 * np.log(MUCH_BETTER)), default=None)
    return best if best is not None and not _outdone(best, view, given.gravity) else None


def _outdone(reading: Reading, view: Glance, gravity: Array) -> bool:
    """Tell whether a turned sensor explains much more than the reading does, even with gravity tilted.

    In turns about one axis a turn of S is a tilt and a change of sign, too; then the reading holds.
    """
    free = tilt_of(reading.view or view, reading.gravity, reading.rotation, reading.fit.mass)
    left = min(reading.fit.force_share, 1.0 if free is None or free.angle > STEEP else free.force_share)
    turned = turned_sensor(view, gravity, 1) if left > LEVEL else None
    return turned is not None and turned.force_share < MUCH_BETTER * left


def _beats_tilt(rival: Reading, free: GlanceTilt | None) -> bool:
    """Tell whether a freely tilted gravity explains no more (an axis: much more) than the rival does."""
    if free is None:
        return True
    if rival.misread is not None or rival.view is not None:
        return rival.fit.force_share < 0.5 * free.force_share
    return rival.fit.force_share < 2 * free.force_share + 1e-3


def _varies(view: Glance, reading: Reading) -> bool:
    """Tell whether gravity, so read, moves about in S by more than a twentieth of its size."""
    pull = replace(view, acceleration=None).seen(reading.gravity, reading.rotation).pull
    return float(np.sqrt(pull.var(0).sum())) > 0.05 * float(np.linalg.norm(reading.gravity))


def _rival_finding(best: Reading, given: Reading) -> Finding:
    message = (
        f"{best.words[0].upper()}{best.words[1:]}; so read, {percent(best.fit.force_share)} of the force variance is "
        f"left unexplained instead of {percent(given.fit.force_share)}. The answer assumes this."
    )
    if best.view is not None:
        remedy = f'Set frame = "{"W" if best.view.world else "S"}" in force and torque of this stream.'
        return Finding("gravity-frame", message, remedy)
    return Finding.of("gravity-frame", message) if best.misread is None else best.misread.finding(message)


def _as_read(recording: Recording, best: Reading) -> Recording:
    """Return the recording with its rotations, gravity and axes of the wrench as the reading has them."""
    if best.view is not None:
        return in_other_axes(recording)
    if best.misread is None:
        return replace(recording, gravity=best.gravity)
    streams = []
    for stream in recording.streams:
        if (read := stream.channels.get("rotation")) is not None and (meant := best.misread.right(read)) is not None:
            stream = replace(stream, channels={**stream.channels, "rotation": meant})
        streams.append(stream)
    return replace(recording, streams=tuple(streams))


def _signs(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with the wrench or gravity turned round where the mass comes out negative, or with both."""
    sign = _sign(view, reading)
    if sign == 0 or view.sign_free:
        return recording, ()
    if sign > 0:
        return _both_signs(recording, view, reading)
    mass = f"The mass comes out as {reading.fit.mass:.3g} ± {reading.fit.mass_std:.2g} kg"
    moved = _moved_sign(view, reading)
    upside_down = moved > 0
    if moved == 0 and reading.rotation is not None:
        # Nothing but habit can tell: a world whose z points down is rarer than a wrench of the other sign.
        upside_down = float(recording.gravity[2]) > 0.8 * float(np.linalg.norm(recording.gravity))
    doubt = "" if moved else "; a log at rest cannot tell the sign of the wrench from the sign of gravity"
    if upside_down:
        message = f"{mass}, so gravity points the other way in W; it was turned round{doubt}."
        return replace(recording, gravity=-recording.gravity), (Finding.of("gravity-frame", message),)
    was, now = ("on-object", "on-sensor") if recording.wrench_sign > 0 else ("on-sensor", "on-object")
    message = f'{mass}, so the wrench has the other sign; it was taken as "{now}" instead of "{was}"{doubt}.'
    return replace(recording, wrench_sign=-recording.wrench_sign), (Finding.of("wrench-sign-flipped", message),)


def _sign(view: Glance, reading: Reading) -> int:
    """Return the sign of the mass, 0 where it is not sure or a turn of S explains a negative one much better."""
    return 0 if reading.fit.sign < 0 and _outdone(reading, view, reading.gravity) else reading.fit.sign


def _both_signs(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with wrench and gravity turned round where what is accelerated has a negative mass.

    Turned round both, forces at rest stay what they are.
    """
    if _moved_sign(view, reading) >= 0:
        return recording, ()
    message = (
        "The force follows gravity as given, but the acceleration as that of a negative mass: wrench and gravity both "
        "have the other sign; both were turned round."
    )
    remedy = f"Check [log] gravity; {REMEDIES['wrench-sign-flipped'][0].lower()}{REMEDIES['wrench-sign-flipped'][1:]}"
    turned = replace(recording, wrench_sign=-recording.wrench_sign, gravity=-recording.gravity)
    return turned, (Finding("wrench-sign-flipped", message, remedy),)


def _moved_sign(view: Glance, reading: Reading) -> int:
    """Return the sign of the mass that the measured acceleration shows; 0 where none is measured or it is too weak."""
    if view.acceleration is None or reading.rotation is None:
        return 0
    masses, spread, _ = both_masses(view, reading.gravity, reading.rotation)
    sure = abs(masses[0]) > 5 * spread[0] and 0.5 < abs(masses[0] / masses[1]) < 2
    return int(np.sign(masses[0])) if sure else 0


def _lengths(recording: Recording, found: StaticFit) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with torques in N m where the centre of mass lies metres away."""
    size, spread = float(np.linalg.norm(found.moment)), float(np.linalg.norm(found.moment_std))
    if not found.sign or found.arm < FURTHEST_ARM or size < 5 * spread or found.torque_share > 0.7:
        return recording, ()
    where = f"The centre of mass comes out {found.arm:.3g} m from the sensor, with a mass of {abs(found.mass):.3g} kg"
    stream = next((s for s in recording.streams if "torque" in s.channels and "force" in s.channels), None)
    if stream is None:
        return recording, ()
    if found.arm / 1000 < FURTHEST_ARM and abs(found.mass) < 0.02:
        message = (
            f"{where}: the force is a thousand times too small, as when kN are read as N; it was multiplied by 1000."
        )
        return scaled(recording, stream, ("force",), 1e3), (Finding.of("force-unit", message),)
    if found.arm / 1000 < FURTHEST_ARM:
        message = f"{where}: the torque is in N mm; it was divided by 1000."
        return scaled(recording, stream, ("torque",), 1e-3), (Finding.of("length-in-mm", message),)
    message = f"{where}: the units of force and torque do not belong together."
    return recording, (replace(Finding.of("force-unit", message), left_in=True),)


def _level(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with gravity along the direction that the wrench shows, where that is plainly another."""
    if reading.fit.force_share < LEVEL or int(view.block.max()) + 1 < FEWEST_BLOCKS:
        return recording, ()
    tilt = tilt_of(view, reading.gravity, view.rotation, reading.fit.mass)
    turned = turned_sensor(view, reading.gravity, _sign(view, reading))
    stream = next(s for s in recording.streams if "force" in s.channels)
    mirror = mirrored(view, reading.gravity, _sign(view, reading))
    if mirror is not None and _columns_mixed(mirror, turned, tilt, reading.fit):
        message = (
            f"The forces fit one body if they are read as {mirror.words}: so, {percent(mirror.force_share)} of their "
            f"variance is left unexplained instead of {percent(reading.fit.force_share)}; the answer does not assume "
            "this."
        )
        remedy = "Check order and signs of the force columns in the description, and of the torque columns with them."
        return recording, (Finding("force-unit", message, remedy, left_in=True),)
    if turned is not None and _sensor_turned(turned, tilt, reading.fit):
        message = (
            f"The wrench is turned by {np.degrees(turned.rotation.angle()):.0f} degrees against the frame whose "
            f"rotation is given: '{stream.name}' looks mounted by the rotation vector "
            f"({vector(mount_of(stream, turned.rotation))}) rad in S. So read, {percent(turned.force_share)} of the "
            f"force variance is left unexplained instead of {percent(reading.fit.force_share)}; the answer does not "
            "assume this."
        )
        return recording, (Finding("sensor-turned", message, mount_remedy(stream, turned.rotation), left_in=True),)
    if tilt is None or not _plain(tilt, reading.fit):
        return recording, ()
    code = "base-tilted" if tilt.angle < STEEP else "gravity-frame"
    message = (
        f"Gravity fits {np.degrees(tilt.angle):.1f} ± {np.degrees(tilt.angle_std):.1g} degrees off the direction "
        f"given, along ({direction_words(tilt.gravity)}) of W; the answer uses the direction found{tilt.blind_words}."
    )
    return replace(recording, gravity=tilt.gravity), (Finding.of(code, message),)


def _sensor_turned(turned: Turn, tilt: GlanceTilt | None, given: StaticFit) -> bool:
    """Tell whether a constant turn of S explains what neither the given nor a tilted gravity does."""
    return (
        turned.rotation.angle() > SENSOR_TURN
        and turned.force_share < min(MUCH_BETTER * given.force_share, 0.3)
        and (tilt is None or turned.force_share < 0.5 * tilt.force_share)
    )


def _columns_mixed(mirror: Mirror, turned: Turn | None, tilt: GlanceTilt | None, given: StaticFit) -> bool:
    """Tell whether forces read in another order or sign explain what no turn of S and no tilted gravity does."""
    rivals = [found.force_share for found in (turned, tilt) if found is not None]
    bar = min(MUCH_BETTER * given.force_share, 0.3, *(0.5 * share for share in rivals))
    return mirror.force_share < bar


def _plain(tilt: GlanceTilt, given: StaticFit) -> bool:
    """Tell whether the tilt is large, sure, and explains most of what the given direction leaves."""
    return (
        tilt.angle > max(CERTAIN_TILT, 5 * tilt.angle_std)
        and tilt.force_share < 0.4 * given.force_share
        and tilt.force_share < 0.3
        and tilt.torque_share < 1.1 * given.torque_share + 1e-3
    )
